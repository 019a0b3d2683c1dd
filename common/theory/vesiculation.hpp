// Vesiculated limits: spheres joined by necks that shrink to points, at given area and volume. theory.md (8.11)
#pragma once

#include <optional>
#include <string>

#include "common/energy/bending.hpp"

namespace tubule::theory {

// A sphere of `radius` and `others` equal ones of `other_radius`, beside it or inside, and the energy of all with their
// necks, area difference included. Inside it the others are turned over: H = 2/r.
struct LimitShape {
    int others = 1;
    bool inside = false;
    double radius = 1, other_radius = 1, energy = 0;
};

// The limit shape of least energy, with up to 200 spheres beside the first, or up to 6 inside. None where the area
// cannot enclose the volume; where H0 varies; and where the energy of a neck grows without bound as it shrinks (K^2).
std::optional<LimitShape> vesiculated_limit(const Bending& bending, double area, double volume);

// "2 spheres of radius 0.7071", "spheres of the radii 0.9 and 0.4", "a sphere of radius 0.9 and 3 of radius 0.2", "a
// sphere of radius 0.9 with 1 of radius 0.4 inside".
std::string described(const LimitShape& shape);

}  // namespace tubule::theory
