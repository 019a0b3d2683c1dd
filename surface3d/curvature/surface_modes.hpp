// Amplitudes of waves on a curved surface: for growth rates, and for comparisons with the axisymmetric tier.
#pragma once

#include "surface3d/mesh/curved_mesh.hpp"

namespace tubule::surface3d {

// Amplitude of cos(2 pi n z/length + m theta + phase) in r(theta, z), any phase, by (1/(pi L)) INT r exp(-i ...) dtheta
// dz over the surface: of the waves m and -m together, the root of the sum of their squares. n = m = 0: the mean
// radius. Throws std::invalid_argument for a closed surface.
double tube_mode_amplitude(const CurvedMesh& tube, int n, int m);

// Amplitude of Y_l^m in the distance from the middle of the area, over its mean (as in shape.mode), any turn about z;
// l >= 2. l = 0: the mean distance itself. Throws std::invalid_argument for a tube and for l = 1, a translation.
double sphere_mode_amplitude(const CurvedMesh& surface, int l, int m);

}  // namespace tubule::surface3d
