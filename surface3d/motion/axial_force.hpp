// The axial force of a periodic tube.
#pragma once

#include "surface3d/motion/moving_surface.hpp"

namespace tubule::surface3d {

// The force that holds the period or lets it follow as it does, theory.md (3.19): dE/dL with tension or p, pressure and
// viscosity, potentials of places as tensions. 0 on a closed surface. `u`: velocities at the nodes without the stretch;
// M = INT H dS; `tension`, `pressure`: of the area and volume as a whole.
double axial_force(const MovingSurface& surface, const MotionState& state, const MotionFields& fields,
                   const VectorField& u, double M, double tension, double pressure);

}  // namespace tubule::surface3d
