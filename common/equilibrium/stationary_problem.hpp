// Stationary shapes of E + sigma A + lambda V - force L: what is held, the loads on what is free, and the equations of
// the multipliers. Both tiers solve them, each for its own unknowns.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/energy/bending.hpp"
#include "common/model/model.hpp"

namespace tubule {

// V / (4 pi/3 (A/4 pi)^(3/2)), 1 for a sphere.
double reduced_volume(double area, double volume);

// What is held fixed: area, volume, both or neither; or the reduced volume alone, with the size free.
struct Constraints {
    std::optional<double> area, volume, reduced_volume;
};

// Where a patch ends: its place, which is held, and where it is clamped its tangent (r, z), in the direction of the
// profile.
struct Ring {
    double r = 0, z = 0;
    std::optional<std::array<double, 2>> tangent{};

    int conditions() const { return tangent ? 3 : 2; }
};
inline int condition_count(const std::vector<Ring>& rings) {
    int sum = 0;
    for (const Ring& ring : rings) sum += ring.conditions();
    return sum;
}

struct StationaryProblem {
    Bending bending;
    Constraints constraints;
    Loads loads{};             // tension of a free area, pressure of a free volume, force of a free period
    bool free_period = false;  // of a tube; of half a tube in tier 1
    std::optional<Beads> beads{};
    double bead_distance = 0;   // of the initial shape
    std::vector<Ring> rings{};  // of a patch, which has one or two

    // That is held; none where the force between them is given.
    std::optional<double> held_distance() const {
        if (!beads || !beads->extension) return std::nullopt;
        return bead_distance + beads->extension->at(0);
    }
};

// Whether beads that pull with this force resist motions across the axis and turns out of it; weaker ones do so by less
// than the error of a mesh.
bool hold_axis(const StationaryProblem& problem, double force, double size, double reference_energy);

// Whether shapes of all sizes have the same energy, and nothing acts on them.
bool scale_free(const StationaryProblem& problem);

// Throws std::invalid_argument for loads on what is held (with a reduced volume, neither tension nor pressure), for
// constraints that contradict each other, and for values that no shape has. `period`: 0 of a closed surface or a patch.
void check_problem(const StationaryProblem& problem, double period);

// The two equations for sigma and lambda, F = 0: what is held has its value, what is free its load, and with a reduced
// volume a change of size does no work; with their derivatives in (area, volume) and in (sigma, lambda).
struct MultiplierEquations {
    Eigen::Vector2d F;
    Eigen::Matrix2d by_extent, by_multipliers;
};
MultiplierEquations multiplier_equations(const StationaryProblem& problem, double area, double volume, double sigma,
                                         double lambda);

// What the energy and the loads become with the multipliers: stationary, in the shape, where the constraints hold.
double lagrangian(const StationaryProblem& problem, double energy, double area, double volume, double length,
                  double sigma, double lambda);

// The functional of (area, volume) that a reduced volume fixes, V - v A^(3/2)/(6 sqrt(pi)): derivatives, and the second
// one in the area.
struct ReducedVolumeSlopes {
    double by_area, by_area_twice;
};
ReducedVolumeSlopes reduced_volume_slopes(double reduced_volume, double area);

// Deviation of area and volume from what is held, 0 for what is free, in units of a length.
double constraint_error(const Constraints& c, const MultiplierEquations& equations, double length);

// What a shape has and may be held, with L of theory.md (3.16).
struct Extents {
    double area, volume, length;
};
// E_ref of theory.md (11.1), from E and the sum of the magnitudes of its terms.
double reference_energy(const StationaryProblem& problem, double energy, double magnitude, const Extents& at);
// The problem part of the way from a shape of these extents to its own constraints, 0 <= part <= 1.
StationaryProblem between(const StationaryProblem& goal, const Extents& from, double part);
// How far that is: the largest |log| of a ratio.
double distance(const StationaryProblem& goal, const Extents& from);

// Whether the search is to lead from a closed shape, a sphere, to a smaller reduced volume: there area and volume have
// one gradient. `rounding`: of the reduced volume of a sphere on the mesh.
bool begins_at_sphere(const Constraints& goal, double area, double volume, double rounding);

// Words about the latter; `shape`: what to begin with.
std::string why_no_sphere(const char* shape);

// Why no shape was found after so many iterations of Newton's method, and where the search `descended` from the first
// shape to the last.
std::string why_none(const Constraints& goal, const Extents& first, const Extents& last, bool descended,
                     int iterations);

}  // namespace tubule
