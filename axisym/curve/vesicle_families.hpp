// Families of vesicles: first guesses, and to which one a cell belongs.
#pragma once

#include <optional>
#include <string_view>

#include "common/case/equilibrium_choices.hpp"
#include "common/shapes/curve.hpp"

namespace tubule::axisym {

// A spheroid of this reduced volume (0 < v < 1) and the area 4 pi, prolate or oblate; two spheres (1/sqrt 2 < v < 1)
// joined by a round neck, the smaller one above; and a bowl, the shell between spheres of the radii 1 and
// 1 - thickness, open above the polar angle `opening` from its bottom, with a round rim.
Curve spheroid(double reduced_volume, bool prolate);
Curve pear(double reduced_volume);
Curve bowl(double thickness, double opening);

// Reduced volumes within this of 1 are those of spheres, which belong to no family.
inline constexpr double volume_off_sphere = 1e-3;

// A profile that is its own mirror image is prolate if longer than wide, else oblate; another one is a stomatocyte if a
// pole lies inside its height, else a pear. Nothing for a sphere.
std::optional<Family> family_of(const Curve& cell, double reduced_volume);
std::string_view name(Family family);

}  // namespace tubule::axisym
