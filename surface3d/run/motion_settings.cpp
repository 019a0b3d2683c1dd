#include "surface3d/run/motion_settings.hpp"

#include <algorithm>
#include <cmath>

#include "surface3d/run/motion_start.hpp"

namespace tubule::surface3d {
namespace {

// Measured choices: docs/decisions/surface_motion.md, "How large is the error of a surface in motion?".
constexpr int most_pairs = 6;
constexpr int first_triangles = 180, most_first_triangles = 1000, most_triangles = 40000;
constexpr double fewer = 1.8;                          // times fewer triangles of the coarser run
constexpr double smooth_order = 3.4, rough_order = 2;  // of errors in the mesh width
constexpr double per_smoothness = 1.7;                 // order, for each order of interpolation of H
constexpr double ahead_in_time = 1.3;                  // errors in time grow by so much more: they vary
constexpr double least_growth = 1.5, most_growth = 4;  // of the number of triangles, from pair to pair
constexpr double spare = 1.5;                          // the next pair is to be so many times better than asked
constexpr double later = 2;                            // errors grow from the start on
constexpr double tolerance_per_accuracy = 0.9;         // tolerance = this * asked accuracy^1.5
constexpr double loosest_tolerance = 1e-4;             // beyond it steps are too long to be compared
constexpr double loosest_of_coarser = 4e-4;            // beyond it they leave waves that no mesh resolves
constexpr double least_longer = 2;

double tolerance_for(double accuracy) {
    return std::clamp(tolerance_per_accuracy * std::pow(accuracy, 1.5), 1e-13, loosest_tolerance);
}

// Of errors, from a mesh to the coarser one; elements of one order less count as a mesh.
double growth_in_space(const MotionSettings& coarser, double order) {
    return coarser.role == Role::other_order ? order : std::pow(coarser.coarser_by, order / 2);
}

double order_in_time(const Case& c) {
    return entry(time_scheme(c)).order;
}

// The number of triangles from which on the energy of the start is as accurate as asked.
int triangles_for_start(const Case& c, const Start& start) {
    const int order = element_order(c);
    MotionSettings other{.role = Role::fewer_triangles};
    StartMesh coarse = start.mesh(fewer_triangles(first_triangles), order);
    for (int n = first_triangles;; n = static_cast<int>(fewer * n)) {
        StartMesh mesh = start.mesh(n, order);
        const Observables o = observe_start(c, mesh), before = observe_start(c, coarse);
        other.coarser_by = std::max(1.0 * mesh.mesh.triangles() / coarse.mesh.triangles(), least_longer / fewer);
        const double error = std::abs(free_energy(c, o, mesh.mesh.period) - free_energy(c, before, mesh.mesh.period)) /
                             (growth_in_space(other, smooth_order) - 1);
        const bool more = later * error > c.accuracy.energy * reference_energy(c, o, mesh.mesh.period);
        if (!more || fewer * n > most_first_triangles) return n;
        coarse = std::move(mesh);
    }
}

}  // namespace

Scheme time_scheme(const Case& c) {
    return c.surface.scheme.value_or(default_scheme(motion_law(c.model).inertia != 0));
}

MotionSettings first_settings(const Case& c, const Start& start) {
    return {c.surface.elements   ? *c.surface.elements
            : !start.resizable() ? first_triangles
                                 : triangles_for_start(c, start),
            c.surface.time_tolerance.value_or(tolerance_for(c.accuracy.energy))};
}

bool settings_given(const Case& c) {
    return c.surface.elements || c.surface.time_tolerance || c.surface.step;
}

int fewer_triangles(int triangles) {
    return static_cast<int>(triangles / fewer);
}

MotionSettings coarser(const Case& c, const MotionSettings& s, Role role, double coarser_by) {
    MotionSettings out{.elements = role == Role::other_order ? s.elements : fewer_triangles(s.elements),
                       .pair = s.pair,
                       .role = role,
                       .coarser_by = coarser_by};
    const double q = order_in_time(c),
                 longer = std::pow(ahead_in_time * growth_in_space(out, smooth_order), (q + 1) / q);
    out.tolerance = std::max(std::min(longer * s.tolerance, loosest_of_coarser), least_longer * s.tolerance);
    return out;
}

double error_by_difference(const Case& c, const MotionSettings& s, const MotionSettings& coarser, double smoothness) {
    const double q = order_in_time(c);
    const double in_time = c.surface.step ? std::pow(2, q) : std::pow(coarser.tolerance / s.tolerance, q / (q + 1));
    const double order =
        element_order(c) < 4 ? rough_order : std::clamp(per_smoothness * smoothness, rough_order, smooth_order);
    return 1 / (std::min(growth_in_space(coarser, order), in_time) - 1);
}

// Where the energies of a pair agree and the balance is off, waves are damped by steps that are too long: the mesh is
// kept, once.
MotionSettings finer(const MotionSettings& s, double asked, double error, double defect) {
    const double excess = spare * std::max(error, defect) / asked;
    if (error <= asked && s.difference == 0)
        return {s.elements, s.tolerance / std::clamp(excess * excess, 4.0, 64.0), error, s.pair + 1};
    const double by = std::clamp(std::sqrt(excess), least_growth, most_growth);
    return {static_cast<int>(std::ceil(by * s.elements)), s.tolerance / std::clamp(std::pow(excess, 1.5), 3.0, 64.0), 0,
            s.pair + 1};
}

bool can_be_finer(const MotionSettings& s) {
    return s.pair < most_pairs && s.elements * least_growth <= most_triangles;
}

}  // namespace tubule::surface3d
