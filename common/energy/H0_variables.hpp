// What a formula of a spontaneous curvature that varies may depend on: the place on the initial shape.
#pragma once

#include <array>
#include <string_view>

namespace tubule {

// Variables on profiles: the part of the area that is below (from the lower pole, or from the lower end of a period),
// and the point of the profile. On surfaces: the point in space.
inline constexpr std::array<std::string_view, 3> H0_of_profile{"area", "r", "z"}, H0_of_surface{"x", "y", "z"};

}  // namespace tubule
