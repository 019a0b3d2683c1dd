// The laws of motion, theory.md (3.1), as what a step of tier 2 has to solve for.
#pragma once

#include "common/case/case.hpp"

namespace tubule::surface3d {

//   inertia (d_t u + grad_w u) = (2 viscosity) div D(u) - friction u - grad p - p H nu + b nu - lambda nu
// Where nothing flows, u.nu is all that is unknown of u; its tangential part is -grad p/friction or zero.
struct MotionLaw {
    bool flows = true;         // the tangential velocity has inertia or viscosity: u has three components
    bool inextensible = true;  // div_P u = 0, with the pressure p
    bool keeps_volume = true;  // with the number lambda
    double inertia = 1, viscosity = 1, friction = 0;

    int components() const { return flows ? 3 : 1; }
};

inline MotionLaw motion_law(const Model& m) {
    MotionLaw law;
    law.flows = m.kind == ModelKind::stokes || m.kind == ModelKind::fluid;
    law.inextensible = m.kind != ModelKind::gradient_flow;
    law.keeps_volume = m.keeps_volume.value_or(law.inextensible);
    law.inertia = m.kind == ModelKind::fluid ? 1 : 0;
    law.viscosity = law.flows ? 1 / m.Re : 0;
    law.friction = law.flows ? m.gamma : 1;
    return law;
}

}  // namespace tubule::surface3d
