// The resolution of a run in motion, and of the coarser run from which its error is estimated.
#pragma once

#include <optional>

#include "common/case/problem.hpp"
#include "surface3d/motion/motion_measures.hpp"
#include "surface3d/run/start.hpp"

namespace tubule::surface3d {

constexpr int least_triangles = 80;  // fewer are too inaccurate to estimate an error

// What a run is for: its own sake, or for another to be compared with, on fewer triangles or with elements of another
// order.
enum class Role { reported, fewer_triangles, other_order };

struct MotionSettings {
    int elements = 0;
    double tolerance = 0;   // of the positions in a step, relative to the root of the area
    double difference = 0;  // of the energies, absolute, by a pair on this mesh with a looser tolerance
    int pair = 1;           // its number
    Role role = Role::reported;
    double coarser_by = 1;  // of a coarser run: triangles of the run over its own
};

// What the case gives, or what its accuracy requires: as many triangles as the initial energy needs.
MotionSettings first_settings(const Problem& c, const Start& start);

// About how many triangles the coarser run is to have.
int fewer_triangles(int triangles);
constexpr int steps_at_once = 3;  // of the run, that the coarser one goes over
// The coarser run, which has `coarser_by` times fewer triangles (elements of another order: 1).
MotionSettings coarser(const MotionSettings& s, Role role, double coarser_by);

// How much longer than its last step the next one of the coarser run may be, by the initial H on the mesh of the run.
// Where H is rough, errors of the first moments are large, and only several steps at once show them.
double growth_of_coarser(const Problem& c, const Smoothness& start);

// Whether the mesh does not resolve what it has to represent, by H.
bool is_rough(const Smoothness& smoothness);

// Fluids with rough initial shapes keep waves that no step resolves. The error of their energy is larger at some times
// than the coarser run and the balance show at others: the factor by which the stated error is larger, else 1.
double spare_for_waves(const Problem& c, const Smoothness& start);

// The error of a run over its difference from the coarser one, by the least orders of errors that can be relied on for
// this smoothness of H (MotionMeasures).
double error_by_difference(const Problem& c, const MotionSettings& coarser, double smoothness);

// Where a surface leaves the vicinity of a saddle point, earlier errors become a delay, and grow with the rate at which
// the energy falls. Whether it has left the slowest time so far, by the dissipation then and the largest since (models
// without inertia under constant loads: elsewhere dissipation changes for other reasons); the error over the change
// since then of the difference from the coarser run, if the run has made `more_steps` times its steps.
bool has_sped_up(const Problem& c, double fastest, double slowest);
double error_by_change(double more_steps);

// Whether steps are of so high an order that errors in time grow far more than those in space when several are made at
// once: both are then separated. Errors in space over the difference from the coarser run with the same steps; errors
// in time over the difference between steps of this order and several at once.
bool is_of_high_order(const Problem& c);
double error_in_space(const Problem& c, const MotionSettings& coarser, double smoothness);
double error_in_time(int order);

// Known absolute errors of a run: of the energy; the part that is due to time, where it is known separately; of the
// balance.
struct MotionErrors {
    double energy = 0;
    std::optional<double> in_time;
    double defect = 0;
};

// Settings of the next pair, after one with these errors, for the tolerance `asked`.
MotionSettings finer(const MotionSettings& s, double asked, const MotionErrors& errors);

// Whether more triangles are worth a try.
bool can_be_finer(const MotionSettings& s);

}  // namespace tubule::surface3d
