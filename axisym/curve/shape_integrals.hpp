// Integrals over a given shape, by quadrature on its meridian itself: no spline stands between.
#pragma once

#include <array>
#include <vector>

#include "common/energy/bending.hpp"
#include "common/shapes/curve.hpp"

namespace tubule::axisym {

// Area and volume of the whole cell or period; of a patch the volume between the planes of its ends.
std::array<double, 2> area_and_volume(const Curve& meridian);

struct ShapeEnergy {
    double energy = 0, magnitude = 0;  // the bending energy; the size of its terms, theory.md (11.1)
    double energy_kg = 0;              // of the gradient term, part of both, theory.md (2.25)
    double energy_alpha = 0, M = 0;    // theory.md (2.19)
    double potential = 0;              // part of the energy
    std::vector<double> energy_term;   // of each term, see term_names()
};
// Part of the magnitude of a patch, whose own terms may all be zero: that of a half sphere in a ring of this radius.
double patch_scale(const Bending& bending, double radius);
// To about 1e-10 of the magnitude, if the meridian is smooth between its seams. Not finite where the energy is not
// defined on the shape.
ShapeEnergy bending_energy(const Curve& meridian, const Bending& bending);

}  // namespace tubule::axisym
