#include "surface3d/run/motion_settings.hpp"

#include <algorithm>
#include <cmath>

namespace tubule::surface3d {
namespace {

// Measured choices: docs/decisions.md, "Surfaces in motion".
constexpr int most_pairs = 6;
constexpr int first_triangles = 180, most_triangles = 40000;    // of the finer run of a pair
constexpr double fewer_triangles = 2.25, longer_tolerance = 8;  // of the coarser one
constexpr double least_growth = 1.6, most_growth = 4;           // of the number of triangles, from pair to pair
constexpr double tolerance_per_accuracy = 0.5;                  // tolerance = this * asked accuracy^1.5
constexpr double loosest_tolerance = 1e-4;                      // beyond it steps are too long to be compared
constexpr double loosest_of_coarser = 4e-4;                     // beyond it they leave waves that no mesh resolves
constexpr double least_longer = 2;

double tolerance_for(double accuracy) {
    return std::clamp(tolerance_per_accuracy * std::pow(accuracy, 1.5), 1e-13, loosest_tolerance);
}

}  // namespace

Scheme time_scheme(const Case& c) {
    return c.surface.scheme.value_or(default_scheme(motion_law(c.model).inertia != 0));
}

MotionSettings first_settings(const Case& c) {
    return {c.surface.elements.value_or(first_triangles),
            c.surface.time_tolerance.value_or(tolerance_for(c.accuracy.energy))};
}

bool settings_given(const Case& c) {
    return c.surface.elements || c.surface.time_tolerance || c.surface.step;
}

MotionSettings coarser(const MotionSettings& s, Role role) {
    const int elements = role == Role::other_order ? s.elements : static_cast<int>(s.elements / fewer_triangles);
    const double tolerance =
        std::max(std::min(longer_tolerance * s.tolerance, loosest_of_coarser), least_longer * s.tolerance);
    return {.elements = elements, .tolerance = tolerance, .pair = s.pair, .role = role};
}

// Errors fall with the fourth power of the mesh width and the power 2/3 of the tolerance. Where the energies of a pair
// agree and the balance is off, waves are damped by steps that are too long: the mesh is kept, once.
MotionSettings finer(const MotionSettings& s, double asked, double difference, double defect) {
    const double excess = std::max(difference, defect) / asked;
    if (difference <= asked && s.difference == 0)
        return {s.elements, s.tolerance / std::clamp(excess * excess, 4.0, 64.0), difference, s.pair + 1};
    const double by = std::clamp(std::sqrt(excess), least_growth, most_growth);
    return {static_cast<int>(std::ceil(by * s.elements)), s.tolerance / std::clamp(std::pow(excess, 1.5), 4.0, 64.0), 0,
            s.pair + 1};
}

bool can_be_finer(const MotionSettings& s) {
    return s.pair < most_pairs && s.elements * least_growth <= most_triangles;
}

}  // namespace tubule::surface3d
