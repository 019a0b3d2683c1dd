// A case with what follows from it decided once: what runs is given a Problem, and interprets no key again.
#pragma once

#include <vector>

#include "common/case/case.hpp"

namespace tubule {

// What is solved for.
enum class Unknowns {
    graph,           // r(z, t) of a tube; a profile curve instead where it overhangs
    curve,           // a profile curve in motion
    equilibrium,     // a stationary profile curve, or a branch of them
    moving_surface,  // a surface in motion
    surface_equilibrium,  // a stationary surface
    surface,         // nothing: energy and curvature of a surface as it is
    automatic        // a profile in motion, then a surface where modes m > 0 grow: tier "auto"
};

struct Problem : Case {
    // Implicit, as functions of a problem are called with a case, too. What keeps a reference needs one that outlives
    // it. To edit a problem edit a copy of its case: what follows from it is decided again.
    Problem(Case c = {});

    Unknowns unknowns{};
    MotionLaw law;    // without chosen loads: equilibria have their own
    Held held{};      // by an equilibrium
    Scheme scheme{};  // of a surface in motion
    // Elements of a surface: 2, 3, 4. In motion the fourth is more accurate, the third suffices for a single shape
    // (docs/decisions/surface_motion.md).
    int element_order = 0;
    double begin_time = 0;  // of a surface that continues a motion of tier axisym

    bool is_equilibrium() const { return equilibrium.has_value(); }
    bool runs_in_tier_axisym() const;  // alone: not where tier "auto" may leave it
    // The case gives elements, tolerance or step: the program must not choose them.
    bool profile_resolution_given() const { return discretisation.elements || discretisation.time_tolerance; }
    bool surface_resolution_given() const { return surface.elements || surface.time_tolerance || surface.step; }

    // The same motion in tier axisym, until `end` and with these output times, and in tier surface3d.
    Problem of_profile(double end, std::vector<double> output) const;
    Problem of_surface() const;
};

}  // namespace tubule
