// How two curved surfaces fit best.
#pragma once

#include "tools/compare/distance.hpp"

namespace tubule::compare {

// The motion of `b` that minimises the mean square distance of `a` from it, as far as a search from many initial
// guesses finds it: translations and rotations of closed surfaces, translations and rotations about z of tubes, motions
// that preserve the axis for two surfaces of revolution. Throws as distance does.
RigidMotion alignment(const Surface& a, const Surface& b);

}  // namespace tubule::compare
