// A case with what follows from it decided once: runs are given a Problem, and interpret no key again.
#pragma once

#include "common/case/case.hpp"

namespace tubule {

struct Problem : Case {
    // Implicit, as functions of a problem are called with a case, too. What keeps a reference needs one that outlives
    // it.
    Problem(const Case& c);

    MotionLaw law;          // without chosen loads: equilibria have their own
    Scheme scheme{};        // of a surface in motion
    int element_order = 0;  // of a surface: 2, 3, 4
    double begin_time = 0;  // of a surface that continues a motion of tier axisym

    // The case gives elements, tolerance or step: the program must not choose them.
    bool profile_resolution_given() const { return discretisation.elements || discretisation.time_tolerance; }
    bool surface_resolution_given() const { return surface.elements || surface.time_tolerance || surface.step; }
};

}  // namespace tubule
