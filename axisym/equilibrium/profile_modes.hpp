// Amplitudes of waves on a profile.
#pragma once

#include "axisym/splines/arc_length.hpp"

namespace tubule::axisym {

// The mean radius of a tube over its period, (1/L) INT r dz; of a closed cell, over the directions from the middle of
// its volume.
double mean_radius(const Curve& profile);

// Tube: the amplitude of cos and sin(2 pi n z/length) in r(z), n >= 1; where the profile overhangs, of INT r e^{iqz} dz
// along it. Closed cell: that of Y_n^0 in the distance from the middle of its volume, over the mean of that (as in
// shape.mode), without sign. Throws std::invalid_argument for half a profile, a torus, and n = 1 of a cell, its place.
double mode_amplitude(const Curve& profile, int n);

}  // namespace tubule::axisym
