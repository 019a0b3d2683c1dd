#include "surface3d/run/motion_attempt.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "surface3d/meshing/remesh.hpp"
#include "surface3d/run/guards.hpp"
#include "surface3d/run/motion_series.hpp"
#include "surface3d/run/motion_start.hpp"

namespace tubule::surface3d {
namespace {

// Measured choices: docs/decisions.md, "Surfaces in motion".
constexpr double first_step = 1e-4;            // of the time in which the mesh relaxes
constexpr double moment = 1e-2;                // of the first step, see set_moving()
constexpr double growth = 1.6, safety = 0.85;  // of steps
constexpr double shortest_step = 1e-9;         // of the relaxation time: shorter ones are a failure
// A new mesh is made below this quality, or where a neck turns by so much from node to node, and not for some steps.
// Nodes of the coarser run of a pair are so much farther apart, and turn so much more.
constexpr double quality_to_remesh = 0.25, turn_to_remesh = 0.5, farther_apart = 1.5;
constexpr int steps_between_meshes = 20;
constexpr double unseen_move = 0.25;  // between looks for self-intersection, of the distance of nodes
constexpr double seconds_between_checkpoints = 20;

std::vector<double> output_times(const Case& c) {
    std::vector<double> out = c.time.output;
    out.push_back(c.time.end);
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    out.erase(out.begin(), std::upper_bound(out.begin(), out.end(), begin_time(c)));
    return out;
}

// What dissipates in a step of length tau after one of length `before`: the parabola through three rates.
double dissipated_in(double tau, double before, double rate, double now, double past) {
    const double slope = (rate - now) / tau;
    const double bend = before > 0 ? (slope - (now - past) / before) / (tau + before) : 0;
    return tau * (now + rate) / 2 - bend * tau * tau * tau / 6;
}

}  // namespace

std::optional<StopReport> find_pause(const Case& c, RunObserver& watch, Clock::time_point started, double time) {
    if (c.time.limit && std::chrono::duration<double>(Clock::now() - started).count() > *c.time.limit)
        return StopReport{Stop::time_limit, time, fmt::format("used the {} s of time.limit", *c.time.limit),
                          "go on with --resume"};
    if (watch.interrupted())
        return StopReport{Stop::interrupted, time, "interrupted by a signal", "go on with --resume"};
    return std::nullopt;
}

MotionAttempt::MotionAttempt(const Case& c, RunObserver& watch, const MotionSettings& settings,
                             const MotionTrace* coarser, Clock::time_point started)
    : case_(c), watch_(watch), coarser_(coarser), started_(started), outputs_(output_times(c)) {
    memory_.settings = settings;
    memory_.error = settings.difference;
}

double MotionAttempt::seconds() const {
    return std::chrono::duration<double>(Clock::now() - started_).count();
}

double MotionAttempt::length() const {
    return std::sqrt(memory_.area);
}

void MotionAttempt::use_mesh(const CurvedMesh& mesh) {
    const MotionControl control{.area = memory_.area,
                                .volume = memory_.volume,
                                .relaxation = memory_.relaxation,
                                .follow_curvature = case_.surface.follow_curvature,
                                .least_variation = memory_.least_variation,
                                .smoothing = case_.surface.smoothing};
    scheme_ = make_scheme(time_scheme(case_), mesh, motion_law(case_.model), case_.energy, control);
    summary.elements = mesh.triangles();
}

void MotionAttempt::begin(const Start& from) {
    const StartMesh start = from.mesh(memory_.settings.elements, element_order(case_));
    summary.warnings = from.notes();
    const SurfaceSpace space(start.mesh);
    if (const auto fold = find_fold(mesh_quality(start.mesh))) {
        early_ = *fold;
        return;
    }
    remember_start(case_, start, space, memory_);
    memory_.next_step =
        case_.surface.step.value_or(std::min(first_step * memory_.relaxation, case_.time.end - begin_time(case_)));
    use_mesh(start.mesh);
    const VectorField u = start_velocity(case_, start);
    state_ = u.size() > 0 ? surface().start(start.mesh, u.transpose().reshaped()) : surface().start(start.mesh);
    state_.time = begin_time(case_);
    if (surface().law().inertia == 0 && traits().controls_steps) set_moving();
    look();
    memory_.total_start = memory_.lowest_total = total();
    trace.add(state_.time, now_.bending.energy);
    write_row();
    write_frame();
}

// Without inertia the surface is not at rest at the start: the velocity of a very short step, which the error of the
// first one is measured by. Where there is none, the first step says why.
void MotionAttempt::set_moving() {
    try {
        const MotionState soon = scheme_->step(state_, moment * memory_.next_step).state;
        if (!is_finite(soon)) return;
        state_.u = soon.u, state_.w = soon.w;
        state_.p = soon.p, state_.lambda = soon.lambda;
    } catch (const SolveError&) {
    }
}

void MotionAttempt::resume(const Restart& restart) {
    auto [state, memory] = motion_restart(restart.record, time_scheme(case_));
    memory_ = memory;
    use_mesh(curved_mesh(restart.cells.value(), array("points", state.X)));
    state_ = std::move(state);
    look();
    next_output_ = std::upper_bound(outputs_.begin(), outputs_.end(), state_.time) - outputs_.begin();
    last_row_ = last_frame_ = state_.time;
    trace = MotionTrace(restart.record, own_trace);
    if (next_output_ == outputs_.size()) early_ = StopReport{Stop::finished, state_.time, "reached time.end", ""};
}

void MotionAttempt::look() {
    now_ = measure(surface(), state_);
}

// A coarser run is there to tell how large errors are: with 2.25 times fewer triangles five times as large at order 4.
std::optional<StopReport> MotionAttempt::impossible(const Observables& o, const VectorField& X) const {
    return find_impossible_motion(o, surface().mesh(X), reported() ? 0.01 : 0.05, state_.time);
}

std::optional<MotionAttempt::Refusal> MotionAttempt::judge(const MotionStep& next, const MotionMeasures& m) const {
    const double t = state_.time, rise = (m.bending.energy + m.kinetic - total()) / memory_.reference_energy;
    if (const auto spurious = impossible(m.bending, next.state.X))
        return Refusal{0.25, {spurious->reason, t, spurious->message, spurious->advice}};
    if (const auto rises = find_rise_in_step(rise, case_.accuracy.energy, t, next.state.step))
        return Refusal{0.25, *rises};
    return std::nullopt;
}

std::optional<MotionAttempt::Refusal> MotionAttempt::attempt(double tau) {
    const double t = state_.time;
    const auto failed = [&](const std::string& what) {
        return Refusal{0.25, {Stop::solver_failed, t, what, "try other elements, or another discretisation.order"}};
    };
    try {
        const MotionStep next = scheme_->step(state_, tau);
        if (!is_finite(next.state)) return failed("the step overflows");
        const double error = next.error / (memory_.settings.tolerance * length());
        if (!case_.surface.step && error > 2)
            return Refusal{std::clamp(safety / std::cbrt(error), 0.2, 0.7),
                           {Stop::solver_failed, t, fmt::format("steps of {:.3g} are still too inaccurate", tau),
                            "ask for less accuracy, or use more elements"}};
        const CurvedMesh mesh = surface().mesh(next.state.X);
        if (auto fold = find_fold(mesh_quality(mesh))) {
            fold->time = t;
            return Refusal{0.25, *fold};
        }
        const MotionMeasures m = measure(surface(), next.state, &state_);
        if (const auto refusal = judge(next, m)) return refusal;
        take(next, m);
        set_next_step(tau, memory_.next_step, error);
        return std::nullopt;
    } catch (const SolveError& failure) {
        return failed(failure.what());
    }
}

void MotionAttempt::take(const MotionStep& next, const MotionMeasures& m) {
    memory_.dissipated +=
        dissipated_in(next.state.step, state_.step, m.dissipation, now_.dissipation, memory_.dissipation_past);
    memory_.dissipation_past = now_.dissipation;
    memory_.corrected += std::abs(next.correction);
    state_ = next.state;
    now_ = m;
    memory_.lowest_total = std::min(memory_.lowest_total, total());
    memory_.defect = std::max(memory_.defect, std::abs(defect_now()));
    ++memory_.steps;
}

// A step that was cut short by an output says little about how long the next one may be.
void MotionAttempt::set_next_step(double tau, double asked, double error) {
    if (case_.surface.step) return;
    const double factor = error > 0 ? std::clamp(safety / std::cbrt(error), 0.4, growth) : growth;
    memory_.next_step = std::max(tau * factor, tau < asked ? std::min(asked, growth * tau) : 0.0);
}

bool MotionAttempt::wants_new_mesh() const {
    if (!traits().controls_mesh || memory_.steps < memory_.mesh_since + steps_between_meshes) return false;
    const double most = turn_to_remesh * (reported() ? 1 : farther_apart);
    return now_.quality.worst < quality_to_remesh || (now_.turn.saddle && now_.turn.angle > most);
}

// The same surface with good triangles, and small ones where it is sharp; the next step is again the first of its kind.
// What the energy jumps counts as an error. Where no better mesh can be made, the old one is kept: check_state() tells
// when it will do no longer.
void MotionAttempt::make_new_mesh() {
    memory_.mesh_since = memory_.steps;
    const int n = static_cast<int>(state_.X.cols()), d = surface().law().components();
    const auto found = remesh(surface().mesh(state_.X), state_.u.reshaped(n, d).transpose(), {});
    const auto* better = std::get_if<Remeshed>(&found);
    if (!better || better->quality.worst < now_.quality.worst) return;
    const double time = state_.time, energy = now_.bending.energy, before = total();
    const Eigen::VectorXd momenta = surface().momenta(state_);
    const int old_elements = summary.elements;
    std::unique_ptr<TimeScheme> old = std::move(scheme_);
    use_mesh(better->mesh);
    try {
        state_ = surface().start(better->mesh, better->fields.transpose().reshaped(), momenta);
    } catch (const SolveError&) {
        scheme_ = std::move(old), summary.elements = old_elements;
        return;
    }
    ++memory_.meshes;
    state_.time = time;
    look();
    memory_.error += std::abs(now_.bending.energy - energy);
    memory_.lowest_total += std::max(total() - before, 0.0);
    if (!case_.surface.step) memory_.next_step = std::min(memory_.next_step, first_step * memory_.relaxation);
}

std::optional<StopReport> MotionAttempt::step() {
    const double left = left_until_output();
    const auto tau = [&] { return left / std::ceil(left / memory_.next_step * (1 - 1e-9)); };  // no short last step
    while (const auto refusal = attempt(tau())) {
        ++memory_.rejected;
        memory_.next_step = refusal->shrink * tau();
        if (case_.surface.step || memory_.next_step < shortest_step * memory_.relaxation) return refusal->report;
        if (watch_.interrupted()) break;
    }
    trace.add(state_.time, now_.bending.energy);
    compare();
    write_row();
    if (reported()) watch_.progress(state_.time, now_.bending.energy, state_.step);
    const bool at_output = left_until_output() <= 1e-12 * case_.time.end;
    auto stop = check_state();
    if (!stop) stop = check_crossing(at_output);
    if (at_output) {
        state_.time = outputs_[next_output_++];
        if (stop) return stop;
        write_frame();
        if (next_output_ == outputs_.size()) return StopReport{Stop::finished, state_.time, "reached time.end", ""};
    }
    if (!stop) stop = check_progress();
    if (stop) return stop;
    if (seconds() > last_checkpoint_ + seconds_between_checkpoints) write_checkpoint();
    if (wants_new_mesh()) make_new_mesh();
    return std::nullopt;
}

void MotionAttempt::go() {
    std::optional<StopReport> stop = early_;
    if (!stop) stop = check_state();
    if (!stop) stop = impossible(now_.bending, state_.X);
    if (!stop) stop = check_crossing(true);
    if (stop && !early_) compare();
    while (!stop) stop = step();
    summarise(*stop);
}

// Whether the surface and its energy can be believed.
std::optional<StopReport> MotionAttempt::check_state() const {
    const double t = state_.time, asked = case_.accuracy.energy;
    if (auto bad = find_bad_shape(now_, case_.accuracy.r_min, t)) return bad;
    if (auto rise = find_slow_rise((total() - memory_.lowest_total) / memory_.reference_energy, asked, t)) return rise;
    if (traits().controls_mesh && surface().law().keeps_volume)
        if (auto drift = find_drift(now_.bending.volume / memory_.volume - 1, asked, t)) return drift;
    return std::nullopt;
}

// Looked for at outputs, and when nodes have moved so far since the last look: what crosses and parts again in between
// is no deeper than that.
std::optional<StopReport> MotionAttempt::check_crossing(bool at_output) {
    const double spacing = length() / std::sqrt(summary.elements) / element_order(case_);
    memory_.moved += state_.step * now_.speed;
    if (memory_.moved < unseen_move * spacing && !at_output) return std::nullopt;
    memory_.moved = 0;
    auto crossing = find_self_intersection(surface().mesh(state_.X));
    if (crossing) crossing->time = state_.time;
    return crossing;
}

// Whether it is worth while, and allowed, to go on.
std::optional<StopReport> MotionAttempt::check_progress() {
    const double t = state_.time;
    if (auto pause = find_pause(case_, watch_, started_, t)) return pause;
    if (case_.time.stationary && what_may_change() < *case_.time.stationary * memory_.reference_energy)
        return StopReport{Stop::stationary, t, "the energy changes no more, as asked by time.stationary", ""};
    return stall_.look(t, state_.step, first_step * memory_.relaxation, memory_.lowest_total / memory_.reference_energy,
                       case_.accuracy.energy);
}

// By how much the energy could change until the end, by what dissipates, moves and is accelerated now.
double MotionAttempt::what_may_change() const {
    const double left = case_.time.end - state_.time;
    return std::max({now_.dissipation * left, now_.kinetic, now_.acceleration * left * left});
}

void MotionAttempt::compare() {
    const double t = state_.time;
    error_now_ = memory_.reference_energy;  // nothing is known
    if (!coarser_ || t > coarser_->end()) return;
    error_now_ = std::abs(now_.bending.energy - (*coarser_)(t));
    memory_.error = std::max(memory_.error, error_now_);
}

void MotionAttempt::write_row() {
    if (!reported() || last_row_ == state_.time) return;
    last_row_ = state_.time;
    watch_.row(motion_values({state_, now_, defect_now(), memory_.corrected, error_now_, summary.elements, seconds()}));
}

void MotionAttempt::write_frame() {
    if (!reported() || state_.time == last_frame_) return;
    last_frame_ = state_.time;
    watch_.frame([&] { return record(); });
}

void MotionAttempt::write_checkpoint() {
    last_checkpoint_ = seconds();
    watch_.checkpoint(record());
}

Record MotionAttempt::record() const {
    const std::size_t mesh = watch_.mesh(cells_of(surface().mesh(state_.X)));
    Record out = motion_record(surface(), state_, now_, memory_, mesh);
    out.arrays.push_back(trace.array(own_trace));
    if (coarser_) out.arrays.push_back(coarser_->array(coarser_trace));
    return out;
}

void MotionAttempt::summarise(const StopReport& stop) {
    summary.stop = stop;
    summary.energy = now_.bending.energy;
    summary.reference_energy = memory_.reference_energy;
    if (!scheme_) return;
    write_row();
    if (!can_go_on(stop.reason))
        write_frame();
    else
        write_checkpoint();  // what a resumed run goes on from is no frame of its own
    const int nodes = static_cast<int>(state_.X.cols());
    summary.effort = fmt::format("{} steps ({} rejected), {} triangles of order {}, {} nodes", memory_.steps,
                                 memory_.rejected, summary.elements, element_order(case_), nodes);
    summary.details = {{"elements", std::int64_t{summary.elements}},
                       {"nodes", std::int64_t{nodes}},
                       {"order", std::int64_t{element_order(case_)}},
                       {"steps", std::int64_t{memory_.steps}},
                       {"rejected_steps", std::int64_t{memory_.rejected}},
                       {"time_tolerance", memory_.settings.tolerance},
                       {"meshes", std::int64_t{memory_.meshes}},
                       {"relaxation", memory_.relaxation},
                       {"dissipated", memory_.dissipated},
                       {"identity_defect", defect_now()},
                       {"correction_energy", memory_.corrected}};
}

}  // namespace tubule::surface3d
