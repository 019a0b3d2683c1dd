#include "surface3d/run/motion_settings.hpp"

#include <algorithm>
#include <cmath>

#include "surface3d/run/motion_start.hpp"

namespace tubule::surface3d {
namespace {

// Measured choices: docs/decisions/surface_motion.md, "How large is the error of a surface in motion?".
constexpr int most_pairs = 6;
constexpr int first_triangles = 180, most_first_triangles = 1000, most_triangles = 40000;
constexpr double fewer = 2.25;                         // times fewer triangles of a companion
constexpr double smooth_order = 4, rough_order = 2;    // of errors in the mesh width
constexpr double per_smoothness = 2.1;                 // order, for each order of interpolation of H
constexpr double least_growth = 1.5, most_growth = 4;  // of the number of triangles, from pair to pair
constexpr double growth_of_start = 1.22;               // of that number, until the initial energy is accurate
constexpr double spare = 1.5;                          // tolerance over the error that the next pair aims at
constexpr double part_of_asked = 0.4;                  // of space and of time, where they are known separately
constexpr double later = 2;                            // errors grow from the initial ones
constexpr double tolerance_per_accuracy = 0.8;         // tolerance = this * asked accuracy^1.5, of order 2
constexpr double tolerance_of_order_4 = 0.2;           // tolerance = this * asked accuracy^1.25
constexpr double loosest_tolerance = 1e-4;             // beyond it steps are too long to be compared
constexpr double loosest_of_companion = 2e-3;          // beyond it they leave waves that no mesh resolves
constexpr double least_fewer = 1.1;
constexpr double spare_at_places = 0.85;                  // of the coarsest mesh at walls and beads: the surface moves
constexpr double rough_below = 0.5, rough_missed = 0.03;  // order and error of H, linear between nodes, at kinks
constexpr double stable_growth = 2.4, any_growth = 1e9;   // of steps; beyond the first bdf2 is unstable
constexpr double spare_in_time = 1.25;                    // at most 1.1 of the error was seen to be missing
constexpr double unresolved_waves = 1.6;                  // of rough fluids: at most 1.37 was seen to be missing
constexpr double between_compared = 1.25;  // of other fluids, whose errors have maxima between the steps compared
constexpr double sped_up = 2;              // times the least dissipation: the motion has left what it rested at
constexpr double least_more_steps = 1.5;   // of the run, than of its companion: fewer would tell nothing
constexpr double surest_growth = 4.5;      // of errors: they have maxima between the steps that are compared

double tolerance_for(const Problem& c) {
    const double accuracy = c.accuracy.energy;
    const double tolerance = entry(c.scheme).most_order > 2 ? tolerance_of_order_4 * std::pow(accuracy, 1.25)
                                                            : tolerance_per_accuracy * std::pow(accuracy, 1.5);
    return std::clamp(tolerance, 1e-13, loosest_tolerance);
}

// Factor of errors from a run to its companion; elements of one order less count as a mesh.
double growth_in_space(const MotionSettings& companion, double order) {
    return companion.role == Role::other_order ? order : std::pow(companion.coarser_by, order / 2);
}

double order_in_space(const Problem& c, double smoothness) {
    return c.element_order < 4 ? rough_order : std::clamp(per_smoothness * smoothness, rough_order, smooth_order);
}

// Near walls and beads, or for waves that grow where kg > 0.
bool too_coarse_at_places(const Problem& c, const CurvedMesh& mesh) {
    double coarse = wall_coarseness(mesh, c.energy.potentials).value;
    if (c.law.beads) {
        const BeadEquations beads(c.law.beads->width, BeadEquations::in_space);
        coarse = std::max(
            coarse, bead_coarseness(mesh, bead_numbers(SurfaceSpace(mesh), mesh, beads, 0), c.law.beads->width).value);
    }
    if (coarse > spare_at_places * coarsest_place) return true;
    if (c.energy.kg == 0) return false;
    const SurfaceSpace space(mesh);
    const MotionFields fields = motion_fields(space, mesh, Projection(space, mesh));
    return wave_coarseness(mesh, fields, c.energy).value > spare_at_places;
}

// The number of triangles from which on the initial energy is as accurate as asked, by a coarser mesh and by a
// finer one: two of them may agree by chance.
int triangles_for_start(const Problem& c, const Start& start) {
    const int order = c.element_order;
    const bool rough = is_rough(start.mesh(first_triangles, order).mesh);
    MotionSettings other{.role = Role::fewer_triangles};
    for (int n = first_triangles;; n = static_cast<int>(growth_of_start * n)) {
        const StartMesh mesh = start.mesh(n, order), coarse = start.mesh(fewer_triangles(n), order);
        const Observables o = observe_start(c, mesh);
        const double length = start_length(c, mesh.mesh);
        const double energy = free_energy(c, o, length),
                     before = free_energy(c, observe_start(c, coarse), start_length(c, coarse.mesh));
        other.coarser_by = std::max(1.0 * mesh.mesh.triangles() / coarse.mesh.triangles(), least_fewer);
        const double error = later * std::abs(energy - before) / (growth_in_space(other, smooth_order) - 1);
        const double asked = c.accuracy.energy * reference_energy(c, o, length);
        const bool at_places = too_coarse_at_places(c, mesh.mesh) && growth_of_start * n < most_triangles;
        const bool more = (error > asked || error_of_start(c, start, n, energy, rough) > asked) &&
                          growth_of_start * n < most_first_triangles;
        if (!more && !at_places) return n;
    }
}

}  // namespace

bool is_rough(const Smoothness& smoothness) {
    return smoothness.order < rough_below && smoothness.missed > rough_missed;
}

bool is_rough(const CurvedMesh& mesh) {
    const SurfaceSpace space(mesh);
    return is_rough(smoothness_of(mesh, motion_fields(space, mesh, Projection(space, mesh)).H));
}

MotionSettings first_settings(const Problem& c, const Start& start) {
    return {c.surface.elements   ? *c.surface.elements
            : !start.resizable() ? first_triangles
                                 : triangles_for_start(c, start),
            c.surface.time_tolerance.value_or(tolerance_for(c))};
}

int fewer_triangles(int triangles) {
    return static_cast<int>(triangles / fewer);
}

MotionSettings companion_settings(const MotionSettings& s, Role role, double coarser_by) {
    return {.elements = role == Role::other_order ? s.elements : fewer_triangles(s.elements),
            .tolerance = std::max(loosest_of_companion, s.tolerance),
            .pair = s.pair,
            .role = role,
            .coarser_by = coarser_by};
}

bool is_of_high_order(const Problem& c) {
    return entry(c.scheme).most_order > 2;
}

double growth_of_companion(const Problem& c, const Smoothness& start) {
    const bool rough = c.element_order < 4 || is_rough(start);
    return rough || is_of_high_order(c) ? any_growth : stable_growth;
}

double spare_for_waves(const Problem& c, const Smoothness& start) {
    if (c.law.inertia == 0) return 1;
    return c.element_order == 4 && is_rough(start) ? unresolved_waves : between_compared;
}

double error_by_difference(const Problem& c, const MotionSettings& companion, double smoothness) {
    const double in_time = std::pow(steps_at_once, entry(c.scheme).order);
    return 1 / (std::min({growth_in_space(companion, order_in_space(c, smoothness)), in_time, surest_growth}) - 1);
}

bool has_sped_up(const Problem& c, double fastest, double slowest) {
    const MotionLaw law = c.law;
    return law.inertia == 0 && !law.loads_change() && fastest > sped_up * slowest;
}

double error_by_change(double steps_per_step) {
    return 1 / (std::max(steps_per_step, least_more_steps) - 1);
}

double error_in_space(const Problem& c, const MotionSettings& companion, double smoothness) {
    return 1 / (growth_in_space(companion, order_in_space(c, smoothness)) - 1);
}

double error_in_time(int order) {
    return spare_in_time / (std::pow(steps_at_once, order) - 1);
}

// Where the energies of a pair agree and the balance is off, waves are damped by steps that are too long: the mesh is
// kept, once. So it is where errors in time are known apart and those in space are small, and the tolerance is where
// those in time are.
MotionSettings finer(const MotionSettings& s, double asked, const MotionErrors& errors) {
    const double excess = spare * std::max(errors.energy, errors.imbalance) / asked;
    if (errors.energy <= asked && s.difference == 0)
        return {s.elements, s.tolerance / std::clamp(excess * excess, 4.0, 64.0), errors.energy, s.pair + 1};
    double in_space = excess, in_time = std::pow(excess, 1.5);
    if (errors.in_time) {
        const double part = part_of_asked * asked, space = (errors.energy - *errors.in_time) / part,
                     time = *errors.in_time / part;
        if (space > 1 || time > 1) in_space = space, in_time = std::pow(time, 1.25);
    }
    const double by = in_space > 1 ? std::clamp(std::sqrt(in_space), least_growth, most_growth) : 1;
    return {static_cast<int>(std::ceil(by * s.elements)),
            s.tolerance / (in_time > 1 ? std::clamp(in_time, 3.0, 64.0) : 1), 0, s.pair + 1};
}

bool can_be_finer(const MotionSettings& s) {
    return s.pair < most_pairs && s.elements * least_growth <= most_triangles;
}

}  // namespace tubule::surface3d
