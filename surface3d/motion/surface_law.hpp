// A law of motion, theory.md (3.1), as a step of tier 2 solves for it.
#pragma once

#include "common/model/model.hpp"

namespace tubule::surface3d {

struct SurfaceLaw : MotionLaw {
    SurfaceLaw(const MotionLaw& law) : MotionLaw(law) {}

    // The tangential velocity has inertia or viscosity: u has three components. Else u.nu is all that is unknown of u,
    // and its tangential part is -grad p/friction, or zero where the membrane is extensible.
    bool flows = inertia != 0 || viscosity != 0;

    int components() const { return flows ? 3 : 1; }
};

}  // namespace tubule::surface3d
