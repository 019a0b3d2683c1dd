// The resolution of a run in motion, and of the companions from which its error is estimated.
#pragma once

#include <optional>

#include "common/case/problem.hpp"
#include "surface3d/motion/motion_measures.hpp"
#include "surface3d/run/start.hpp"

namespace tubule::surface3d {

constexpr int least_triangles = 80;  // fewer are too inaccurate to estimate an error

// What a run is for: to be reported, or as a companion of such a run, to be compared with it: on fewer triangles or
// with elements of another order.
enum class Role { reported, fewer_triangles, other_order };

struct MotionSettings {
    int elements = 0;
    double tolerance = 0;   // of the positions in a step, relative to the root of the area
    double difference = 0;  // of the energies, absolute, by a pair on this mesh with a looser tolerance
    int pair = 1;           // its number
    Role role = Role::reported;
    double coarser_by = 1;  // of a companion: triangles of the run over its own
};

// What the case gives, or what its accuracy requires: as many triangles as the initial energy needs.
MotionSettings first_settings(const Problem& c, const Start& start);

// About how many triangles a companion on fewer is to have.
int fewer_triangles(int triangles);
constexpr int steps_at_once = 3;  // of the run, that a companion goes over
// Those of a companion, which has `coarser_by` times fewer triangles (elements of another order: 1).
MotionSettings companion_settings(const MotionSettings& s, Role role, double coarser_by);

// How much longer than its last step the next one of a companion may be, by the initial H on the mesh of the run.
// Where H is rough, errors of the first moments are large, and only several steps at once show them.
double growth_of_companion(const Problem& c, const Smoothness& start);

// Whether the mesh does not resolve what it has to represent, by H.
bool is_rough(const Smoothness& smoothness);
bool is_rough(const CurvedMesh& mesh);

// Fluids with rough initial shapes keep waves that no step resolves. The error of their energy is larger at some times
// than its companion and the balance show at others: the factor by which the stated error is larger, else 1.
double spare_for_waves(const Problem& c, const Smoothness& start);

// The error of a run over its difference from its companion, by the least orders of errors that can be relied on for
// this smoothness of H (MotionMeasures).
double error_by_difference(const Problem& c, const MotionSettings& companion, double smoothness);

// has_sped_up(): the dissipation since its least value has more than doubled, as after a saddle point. Early errors
// then act as a delay and grow with it. Only without inertia, under constant loads. error_by_change(n): error over the
// growth of the difference since then; n: steps of the run per step of the companion.
bool has_sped_up(const Problem& c, double fastest, double slowest);
double error_by_change(double steps_per_step);

// A scheme of order above 2: several steps at once would hide the error in space. So one companion takes the steps of
// the run (error in space), another three at once (with the first: error in time). The two functions turn these
// differences into errors.
bool is_of_high_order(const Problem& c);
double error_in_space(const Problem& c, const MotionSettings& companion, double smoothness);
double error_in_time(int order);

// Known absolute errors of a run: of the energy; the part that is due to time, where it is known separately; of the
// balance.
struct MotionErrors {
    double energy = 0;
    std::optional<double> in_time;
    double imbalance = 0;
};

// Settings of the next pair, after one with these errors, for the tolerance `asked`.
MotionSettings finer(const MotionSettings& s, double asked, const MotionErrors& errors);

// Whether more triangles are worth a try.
bool can_be_finer(const MotionSettings& s);

}  // namespace tubule::surface3d
