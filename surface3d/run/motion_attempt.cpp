#include "surface3d/run/motion_attempt.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/run/energy_checks.hpp"
#include "common/run/error_scale.hpp"
#include "common/solve/memory.hpp"
#include "surface3d/meshing/remesh.hpp"
#include "surface3d/meshing/transfer.hpp"
#include "surface3d/run/guards.hpp"
#include "surface3d/run/motion_error.hpp"
#include "surface3d/run/motion_series.hpp"
#include "surface3d/run/motion_start.hpp"

namespace tubule::surface3d {
namespace {

// Measured choices: docs/decisions/surface_motion.md, "Surfaces in motion".
constexpr double first_step = 1e-4;            // of the time in which the mesh relaxes
constexpr double moment = 1e-2;                // of the first step, see set_moving()
constexpr double growth = 1.6, safety = 0.85;  // of steps
constexpr double shortest_step = 1e-9;         // of the relaxation time: shorter ones are a failure
// A new mesh is made below this quality, or where a neck turns by so much from node to node, and not for some steps.
// Nodes of the coarser run of a pair are so much farther apart, and turn so much more.
constexpr double quality_to_remesh = 0.25, turn_to_remesh = 0.5, farther_apart = 1.5;
constexpr int steps_between_meshes = 20;
// Errors of a coarser run may be so many times larger: with 2.25 times fewer triangles they are at order 4.
constexpr double larger_errors = 5;
// Coarser meshes for what has become smooth: looked for after so many steps, at most so often, where the energy jumps
// by at most this part of what is asked, and triangles are good; the first step there, of the one before.
constexpr int steps_between_looks = 6, most_coarser = 2;
constexpr double part_of_jump = 0.25, quality_of_coarser = 0.5, shorter_first_step = 0.1;
// A coarser run gets over some steps of the run in so many trials at most: the trials of one whose mesh is no longer
// good enough would otherwise have no end.
constexpr int most_at_once = 40;
constexpr double one_condition = 1e-6;  // lack of volume, relative: below, meshes cannot keep both area and volume
constexpr double unseen_move = 0.25;    // between looks for self-intersection, of the distance of nodes
constexpr double kept = 1e-8;           // area and volume, relative: a larger drift is reported

// What comes together in a step of length tau after one of length `before`: the parabola through three rates.
double sum_of_step(double tau, double before, double rate, double now, double past) {
    const double slope = (rate - now) / tau;
    const double bend = before > 0 ? (slope - (now - past) / before) / (tau + before) : 0;
    return tau * (now + rate) / 2 - bend * tau * tau * tau / 6;
}

// The first of the fewest steps over an interval that grow evenly from the last one, each by at most this factor.
double first_of_steps(double interval, double last, double most_growth) {
    if (!(last > 0) || interval <= most_growth * last) return interval;
    int count = 1;
    const auto sum = [&](double r) { return r * (std::pow(r, count) - 1) / (r - 1); };
    while (last * sum(most_growth) < interval) ++count;
    double low = 1, high = most_growth;
    while (high - low > 1e-6) {
        const double r = (low + high) / 2;
        (last * sum(r) < interval ? low : high) = r;
    }
    return high * last;
}

}  // namespace

MotionAttempt::MotionAttempt(const Case& c, RunObserver& watch, const RunClock& clock, const MotionSettings& settings,
                             MotionError* error)
    : case_(c),
      clock_(clock),
      error_(error),
      out_(watch, clock, settings.role == Role::reported),
      outputs_(c, begin_time(c)) {
    memory_.settings = settings;
    memory_.error = settings.difference;
}

void MotionAttempt::use_mesh(const CurvedMesh& mesh) {
    const MotionControl control{.area = memory_.scale.area,
                                .volume = memory_.scale.volume,
                                .relaxation = memory_.scale.relaxation,
                                .follow_curvature = case_.surface.follow_curvature,
                                .least_variation = memory_.scale.least_variation,
                                .most_drift = std::max(most_drift / 2 * case_.accuracy.energy, one_condition),
                                .smoothing = case_.surface.smoothing};
    scheme_ = make_scheme(time_scheme(case_), mesh, motion_law(case_.model), case_.energy, control);
    surface().carry_H0(memory_.H0);
    summary.elements = mesh.triangles();
}

void MotionAttempt::begin(const Start& from) {
    start_ = &from;
    if (from.resizable()) memory_.grid = memory_.settings.elements;
    const StartMesh start = from.mesh(memory_.settings.elements, element_order(case_));
    summary.warnings = from.notes();
    const SurfaceSpace space(start.mesh);
    if (const auto fold = find_fold(mesh_quality(start.mesh))) {
        stop_ = *fold;
        return;
    }
    remember_start(case_, start, space, memory_);
    memory_.next_step = case_.surface.step.value_or(
        std::min(first_step * memory_.scale.relaxation, case_.time.end - begin_time(case_)));
    use_mesh(start.mesh);
    const VectorField u = start_velocity(case_, start);
    state_ = u.size() > 0 ? surface().start(start.mesh, u.transpose().reshaped()) : surface().start(start.mesh);
    state_.time = begin_time(case_);
    if (surface().law().inertia == 0 && traits().controls_steps) set_moving();
    look();
    out_.note(doubt_before(case_, now_.free_energy, memory_.scale.reference_energy));
    memory_.balance.total_start = memory_.balance.lowest_total = total();
    if (error_) memory_.error = std::max(memory_.error, error_->begin(summary.elements, now_));
    compare();
    error_now_ = std::max(error_now_, memory_.error);
    write_row();
    write_frame();
    check_start();
}

// Without inertia the surface is not at rest at the start: the velocity of a very short step, which the error of the
// first one is measured by. Where there is none, the first step says why.
void MotionAttempt::set_moving() {
    try {
        const MotionState soon = scheme_->step(state_, moment * memory_.next_step).state;
        if (!is_finite(soon)) return;
        state_.u = soon.u, state_.w = soon.w;
        state_.p = soon.p, state_.lambda = soon.lambda, state_.tension = soon.tension, state_.stretch = soon.stretch;
    } catch (const SolveError&) {
    }
}

void MotionAttempt::resume(const Restart& restart, const Start& start) {
    start_ = &start;
    auto [state, memory] = motion_restart(restart.record, time_scheme(case_));
    memory_ = memory;
    use_mesh(frame_surface(restart.record, restart.cells.value()));
    state_ = std::move(state);
    look();
    outputs_.go_on_from(state_.time);
    out_.go_on_from(state_.time);
    if (error_) error_->resume(restart.record, summary.elements);
    if (outputs_.done())
        stop_ = StopReport{Stop::finished, state_.time, "reached time.end", ""};
    else
        check_start();
}

// Whether it is worth while to go on at all.
void MotionAttempt::check_start() {
    stop_ = check_state();
    if (!stop_) stop_ = impossible(now_.bending, state_);
    if (!stop_) stop_ = check_crossing(true);
}

void MotionAttempt::look() {
    now_ = measure(surface(), state_);
}

std::optional<StopReport> MotionAttempt::impossible(const Observables& o, const MotionState& s) const {
    return find_impossible_motion(o, surface().mesh(s), out_.reported() ? 0.01 : 0.01 * larger_errors, state_.time);
}

std::optional<MotionAttempt::Refusal> MotionAttempt::judge(const MotionStep& next, const MotionMeasures& m) const {
    const double t = state_.time, E_ref = memory_.scale.reference_energy;
    const double asked = case_.accuracy.energy * (out_.reported() ? 1 : larger_errors);
    const double then = m.free_energy + m.kinetic - memory_.balance.work - work_of(next, m);
    if (const auto spurious = impossible(m.bending, next.state))
        return Refusal{0.25, {spurious->reason, t, spurious->message, spurious->advice}};
    if (const auto rises = find_rise_in_step((then - total()) / E_ref, asked, t, next.state.step))
        return Refusal{0.25, *rises};
    const double since = then - memory_.balance.lowest_total;
    if (const auto rises = find_slow_rise(since / E_ref, asked, t))
        return Refusal{0, *rises};  // shorter steps would creep on
    return std::nullopt;
}

std::optional<MotionAttempt::Refusal> MotionAttempt::attempt(double tau) {
    const double t = state_.time;
    const auto failed = [&](const std::string& what) {
        if (may_be_undefined(now_.domain)) return Refusal{0.25, undefined_energy(now_, t)};
        return Refusal{0.25,
                       {Stop::solver_failed, t, what, "try another discretisation.elements or discretisation.order"}};
    };
    try {
        surface().linear_work() = {};
        const MotionStep next = scheme_->step(state_, tau);
        linear_work_.solves += surface().linear_work().solves, linear_work_.lu += surface().linear_work().lu;
        linear_work_.iterations += surface().linear_work().iterations;
        if (!is_finite(next.state)) return failed("the step overflows");
        const double error = next.error / (memory_.settings.tolerance * memory_.scale.length());
        if (!case_.surface.step && error > 2)
            return Refusal{std::clamp(safety / std::cbrt(error), 0.2, 0.7),
                           {Stop::solver_failed, t, fmt::format("steps of {:.3g} are still too inaccurate", tau),
                            "ask for less accuracy, or use more elements"}};
        const CurvedMesh mesh = surface().mesh(next.state);
        if (auto fold = find_fold(mesh_quality(mesh))) {
            fold->time = t;
            return Refusal{0.25, *fold};
        }
        const MotionMeasures m = measure(surface(), next.state, &state_);
        if (const auto refusal = judge(next, m)) return refusal;
        take(next, m);
        set_next_step(tau, memory_.next_step, error, next.order);
        return std::nullopt;
    } catch (const TooLarge& failure) {  // for steps of any length
        return Refusal{0, {Stop::solver_failed, t, failure.what(), ""}};
    } catch (const SolveError& failure) {
        return failed(failure.what());
    }
}

// Of the step before; 0 where a load has changed its slope since: rates have a kink there.
double MotionAttempt::since_kink() const {
    const double before = std::nextafter(state_.time, -HUGE_VAL);
    return surface().law().next_kink(before) == state_.time ? 0 : state_.step;
}

// Of the loads in a step, in which none changes its slope.
double MotionAttempt::work_of(const MotionStep& next, const MotionMeasures& m) const {
    const auto power = [&](const Extent& e) { return surface().law().power(state_.time, e); };
    return sum_of_step(next.state.step, state_.step, power({m.bending.area, m.bending.volume, next.state.period}),
                       power(extent_now()), power(memory_.balance.past));
}

void MotionAttempt::take(const MotionStep& next, const MotionMeasures& m) {
    memory_.balance.work += work_of(next, m);
    memory_.balance.past = extent_now();
    memory_.balance.dissipated +=
        sum_of_step(next.state.step, since_kink(), m.dissipation, now_.dissipation, memory_.balance.dissipation_past);
    memory_.balance.dissipation_past = now_.dissipation;
    memory_.balance.corrected += std::abs(next.correction);
    state_ = next.state;
    memory_.order = next.order;
    now_ = m;
    memory_.balance.lowest_total = std::min(memory_.balance.lowest_total, total());
    memory_.balance.defect = std::max(memory_.balance.defect, std::abs(memory_.balance.defect_at(total())));
    ++memory_.count.steps;
    rough_steps_ += is_rough(m.smoothness);
}

// A step that was cut short by an output says little about how long the next one may be.
void MotionAttempt::set_next_step(double tau, double asked, double error, int order) {
    if (case_.surface.step) return;
    const double factor = error > 0 ? std::clamp(safety / std::pow(error, 1.0 / (order + 1)), 0.4, growth) : growth;
    memory_.next_step = std::max(tau * factor, tau < asked ? std::min(asked, growth * tau) : 0.0);
}

bool MotionAttempt::wants_new_mesh() const {
    if (!traits().controls_mesh || memory_.count.steps < memory_.count.mesh_since + steps_between_meshes) return false;
    const double most = turn_to_remesh * (out_.reported() ? 1 : farther_apart);
    return now_.quality.worst < quality_to_remesh || (now_.turn.saddle && now_.turn.angle > most);
}

// The same surface with good triangles, and small ones where it is sharp; the next step is again the first of its kind.
// Where no better mesh can be made, the old one is kept: check_state() stops the run when it is no longer good enough.
void MotionAttempt::make_new_mesh() {
    memory_.count.mesh_since = memory_.count.steps;
    const auto found = remesh(surface().mesh(state_), carried(), {});
    const auto* better = std::get_if<Remeshed>(&found);
    if (!better || better->quality.worst < now_.quality.worst) return;
    if (!change_mesh(better->mesh, better->fields, HUGE_VAL)) return;
    memory_.grid = 0;
    if (!case_.surface.step) memory_.next_step = std::min(memory_.next_step, first_step * memory_.scale.relaxation);
}

// Where the coarser run can follow, which is where it has got to the same time.
bool MotionAttempt::may_be_coarser() const {
    if (!case_.surface.coarsen || !out_.reported() || memory_.count.coarser == most_coarser) return false;
    const int since = memory_.count.steps - memory_.count.mesh_since, next = fewer_triangles(memory_.grid);
    if (since < steps_between_meshes || memory_.count.steps % steps_between_looks != 0) return false;
    return error_ ? fewer_triangles(next) >= least_triangles && error_->is_at(state_.time) : next >= least_triangles;
}

// The start's mesh of about so many triangles, with its nodes where the same points of the start are now. False where
// that is not a good mesh, or the energy would jump by more, absolutely.
bool MotionAttempt::make_coarser(int triangles, double most_jump) {
    if (memory_.grid == 0) return false;
    const int order = element_order(case_);
    try {
        const CurvedMesh from = start_->mesh(memory_.grid, order).mesh, to = start_->mesh(triangles, order).mesh;
        if (to.triangles() >= from.triangles()) return false;
        const std::vector<MeshPoint> places = places_of_nodes(to, from);
        const CurvedMesh now = surface().mesh(state_), next = moved_to(places, now, to);
        if (!(mesh_quality(next).worst > quality_of_coarser)) return false;
        if (!change_mesh(next, values_at(places, now, carried()), most_jump)) return false;
    } catch (const SolveError&) {
        return false;
    }
    memory_.grid = triangles;
    memory_.count.mesh_since = memory_.count.steps;
    ++memory_.count.coarser;
    if (!case_.surface.step) memory_.next_step = shorter_first_step * memory_.next_step;
    return true;
}

void MotionAttempt::look_for_coarser() {
    const double most = part_of_jump * case_.accuracy.energy * memory_.scale.reference_energy;
    if (!make_coarser(fewer_triangles(memory_.grid), most)) return;
    out_.note(fmt::format("t = {:.4g}: goes on with {} triangles", state_.time, summary.elements));
    if (error_) error_->coarsen(memory_.grid, summary.elements);
}

void MotionAttempt::follow_to(int triangles, int of_run) {
    if (!make_coarser(triangles, HUGE_VAL))
        return end(
            {Stop::resolution_lost, state_.time, fmt::format("there is no mesh of {} triangles", triangles), ""});
    memory_.settings.coarser_by = 1.0 * of_run / summary.elements;
}

// At the nodes, what goes along to another mesh: velocities, and H0 where it varies.
Eigen::MatrixXd MotionAttempt::carried() const {
    const Eigen::Index n = state_.X.cols(), d = state_.u.size() / n;
    Eigen::MatrixXd out = state_.u.reshaped(n, d).transpose();
    if (memory_.H0.size() == 0) return out;
    out.conservativeResize(d + 1, n);
    out.row(d) = memory_.H0.transpose();
    return out;
}

// To another mesh of the same surface, with what is carried there. The jump of the energy counts as an error. Where it
// would be larger, or area and volume cannot be kept, the old mesh is.
bool MotionAttempt::change_mesh(const CurvedMesh& mesh, const Eigen::MatrixXd& fields, double most_jump) {
    const int d = surface().law().components();
    const double energy = comparable(), before = total();
    const Eigen::VectorXd momenta = surface().momenta(state_);
    const MotionState old_state = state_;
    const MotionMeasures old_measures = now_;
    const int old_elements = summary.elements;
    const Eigen::VectorXd old_H0 = memory_.H0;
    std::unique_ptr<TimeScheme> old = std::move(scheme_);
    const auto keep_old = [&] {
        scheme_ = std::move(old), state_ = old_state, now_ = old_measures;
        summary.elements = old_elements, memory_.H0 = old_H0;
    };
    try {
        if (old_H0.size() > 0) memory_.H0 = fields.row(d).transpose();
        use_mesh(mesh);
        state_ = surface().start(mesh, fields.topRows(d).transpose().reshaped(), momenta);
        state_.time = old_state.time, state_.stretch = old_state.stretch;
        look();
    } catch (const SolveError&) {
        keep_old();
        return false;
    } catch (const Paused&) {
        keep_old();
        throw;
    }
    const double jump = std::max(std::abs(comparable() - energy), std::abs(total() - before));
    if (!(jump <= most_jump)) {
        keep_old();
        return false;
    }
    ++memory_.count.meshes;
    memory_.error += std::abs(comparable() - energy);
    memory_.balance.lowest_total += std::max(total() - before, 0.0);
    return true;
}

std::optional<StopReport> MotionAttempt::step() {
    const double kink = next_kink(), left = std::min({outputs_.next(), kink, until_}) - state_.time;
    const auto tau = [&] { return left / std::ceil(left / memory_.next_step * (1 - 1e-9)); };  // no short last step
    while (const auto refusal = attempt(tau())) {
        ++memory_.count.rejected;
        memory_.next_step = refusal->shrink * tau();
        const double shortest = shortest_step * memory_.scale.relaxation;  // 0 where numbers are too large for any step
        if (refusal->shrink == 0 || case_.surface.step || !(memory_.next_step > shortest)) return refusal->report;
        check_pause();
    }
    if (std::abs(state_.time - kink) <= moment_of_time()) state_.time = kink;
    compare();
    write_row();
    if (out_.reported()) out_.progress(state_.time, now_.bending.energy, state_.step);
    const bool at_output = left_until_output() <= moment_of_time();
    auto stop = check_state();
    if (!stop) stop = check_crossing(at_output);
    if (at_output) {
        state_.time = outputs_.pass();
        if (stop) return stop;
        write_frame();
        if (outputs_.done()) return StopReport{Stop::finished, state_.time, "reached time.end", ""};
    }
    if (!stop) stop = check_progress();
    if (stop) return stop;
    if (out_.reported()) out_.safeguard([this] { return record(); });
    if (wants_new_mesh()) make_new_mesh();
    if (may_be_coarser()) look_for_coarser();
    return std::nullopt;
}

void MotionAttempt::go() {
    while (!stop_) advance();
    summarise(*stop_);
}

void MotionAttempt::advance() {
    try {
        stop_ = step();
    } catch (const Paused& pause) {
        stop_ = pause_report(pause, state_.time);
    }
}

void MotionAttempt::advance_to(double time, double growth) {
    memory_.next_step = std::min(time - state_.time, state_.step > 0 ? growth * state_.step : HUGE_VAL);
    const auto tried = [this] { return memory_.count.steps + memory_.count.rejected; };
    const auto before = tried(), rejected = memory_.count.rejected;
    while (!stop_ && is_before(state_.time, time)) {
        until_ = time;
        if (surface().law().inertia == 0 && memory_.count.rejected == rejected) {
            memory_.next_step = first_of_steps(time - state_.time, state_.step, growth);
            if (memory_.next_step < time - state_.time) until_ = state_.time + memory_.next_step;
        }
        advance();
        if (!stop_ && tried() - before > most_at_once)
            end({Stop::resolution_lost, state_.time,
                 fmt::format("{} triangles need steps of {:.2g} where the run takes {:.2g}", summary.elements,
                             memory_.next_step, time - state_.time),
                 ""});
    }
}

// Whether the surface and its energy can be believed.
std::optional<StopReport> MotionAttempt::check_state() const {
    const double t = state_.time, asked = case_.accuracy.energy;
    if (auto bad = find_bad_shape(now_, least_neck(case_, memory_.scale.area), t)) return bad;
    if (traits().controls_mesh)
        if (auto drift = find_drift(volume_drift(), asked, t)) return drift;
    return std::nullopt;
}

// Looked for at outputs, and when nodes have moved so far since the last look: what crosses and parts again in between
// is no deeper than that.
std::optional<StopReport> MotionAttempt::check_crossing(bool at_output) {
    const double spacing = memory_.scale.length() / std::sqrt(summary.elements) / element_order(case_);
    memory_.moved += state_.step * (now_.speed + std::abs(state_.stretch) * state_.period);
    if (memory_.moved < unseen_move * spacing && !at_output) return std::nullopt;
    try {
        auto crossing = find_self_intersection(surface().mesh(state_));
        memory_.moved = 0;
        if (!crossing) return std::nullopt;
        crossing->time = state_.time;
        if (memory_.count.steps == 0)
            crossing->advice = "change the shape; if only its triangles intersect, use more elements or another mesh";
        return crossing;
    } catch (const Paused&) {  // what is due at this time is written first; the next step looks again
        return std::nullopt;
    }
}

// Whether it is worth while, and allowed, to go on.
std::optional<StopReport> MotionAttempt::check_progress() {
    const double t = state_.time;
    if (auto pause = clock_.find_pause(t)) return pause;
    if (error_ && memory_.error > error_->give_up * memory_.scale.reference_energy)
        return StopReport{Stop::resolution_lost, t, "far less accurate than asked for, already", ""};
    if (case_.time.stationary && std::isinf(next_kink()) &&
        settling_.is_settled(case_, t, now_.dissipation, now_.bending.area) &&
        what_may_change() < *case_.time.stationary * memory_.scale.reference_energy)
        return StopReport{Stop::stationary, t, "the energy no longer changes by more than time.stationary allows", ""};
    return stall_.look(t, state_.step, first_step * memory_.scale.relaxation,
                       memory_.balance.lowest_total / memory_.scale.reference_energy, case_.accuracy.energy);
}

// By how much the energy could change until the end, by what dissipates, moves and is accelerated now.
double MotionAttempt::what_may_change() const {
    const double left = case_.time.end - state_.time;
    return std::max({now_.dissipation * left, now_.kinetic, now_.acceleration * left * left});
}

// What a row states is at least what its energy has risen by, and the defect of its balance: there both runs of the
// pair may be wrong alike.
void MotionAttempt::compare() {
    if (!out_.reported()) return;
    std::optional<double> error;
    if (error_) error = error_->at(state_.time, comparable(), now_.dissipation, memory_.order, now_.smoothness.order);
    const double rise = total() - memory_.balance.lowest_total, spare = error_ ? error_->spare() : 1,
                 defect = spare * std::abs(memory_.balance.defect_at(total()));
    error_now_ = std::max({error.value_or(memory_.scale.reference_energy), rise, defect});
    if (error) memory_.error = std::max({memory_.error, *error, rise});
}

// Of a volume that is to be kept, relative to that of the start.
double MotionAttempt::volume_drift() const {
    return surface().law().keeps_volume ? now_.bending.volume / memory_.scale.volume - 1 : 0;
}

void MotionAttempt::warn_of_drift() {
    const double area = !surface().law().area_is_free() ? std::abs(now_.bending.area / memory_.scale.area - 1) : 0;
    const double volume = std::abs(volume_drift());
    const std::string why = traits().controls_mesh ? "on this shape, keeping the area nearly keeps the volume"
                                                   : fmt::format("scheme \"{}\" does not correct them", traits().name);
    if (std::max(area, volume) > kept)
        summary.warnings.push_back(
            fmt::format("area and volume drifted by {:.2g} and {:.2g} (relative): {}", area, volume, why));
}

void MotionAttempt::write_row() {
    if (!out_.wants_row(state_.time)) return;
    out_.row(state_.time,
             motion_series(case_.energy)
                 .values({state_, now_, memory_.balance.work, volume_drift(), memory_.balance.defect_at(total()),
                          memory_.balance.corrected, error_now_, summary.elements, out_.seconds()}));
}

void MotionAttempt::write_frame() {
    out_.frame(state_.time, [this] { return record(); });
}

Record MotionAttempt::record() {
    const std::size_t mesh = out_.mesh(cells_of(surface().mesh(state_)));
    Record out = motion_record(surface(), state_, now_, memory_, mesh);
    if (error_) error_->save(out);
    return out;
}

void MotionAttempt::summarise(const StopReport& stop) {
    summary.stop = stop;
    summary.energy = now_.bending.energy;
    summary.reference_energy = memory_.scale.reference_energy;
    summary.details = {{"pairs", std::int64_t{memory_.settings.pair}}};
    if (!scheme_) return;
    warn_of_drift();
    if (const std::string doubt =
            doubt_after(case_, stop.reason, memory_.balance.total_start, total(), summary.reference_energy);
        !doubt.empty())
        summary.warnings.push_back(doubt);
    write_row();
    out_.end(stop, state_.time, [this] { return record(); });
    const int nodes = static_cast<int>(state_.X.cols());
    summary.effort = fmt::format("{} steps ({} rejected), {} triangles of order {}, {} nodes", memory_.count.steps,
                                 memory_.count.rejected, summary.elements, element_order(case_), nodes);
    summary.details.insert(summary.details.begin(), {{"elements", std::int64_t{summary.elements}},
                                                     {"nodes", std::int64_t{nodes}},
                                                     {"order", std::int64_t{element_order(case_)}},
                                                     {"steps", std::int64_t{memory_.count.steps}},
                                                     {"rejected_steps", std::int64_t{memory_.count.rejected}},
                                                     {"linear_solves", linear_work_.solves},
                                                     {"gmres_iterations", linear_work_.iterations},
                                                     {"lu_solves", linear_work_.lu},
                                                     {"time_tolerance", memory_.settings.tolerance},
                                                     {"meshes", std::int64_t{memory_.count.meshes}},
                                                     {"relaxation", memory_.scale.relaxation},
                                                     {"dissipated", memory_.balance.dissipated},
                                                     {"work", memory_.balance.work},
                                                     {"identity_defect", memory_.balance.defect_at(total())},
                                                     {"correction_energy", memory_.balance.corrected}});
}

}  // namespace tubule::surface3d
