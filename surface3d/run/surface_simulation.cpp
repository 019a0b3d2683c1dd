#include "surface3d/run/surface_simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/run/energy_checks.hpp"
#include "common/run/stall.hpp"
#include "common/run/stops.hpp"
#include "common/solve/memory.hpp"
#include "common/solve/pause.hpp"
#include "surface3d/meshing/remesh.hpp"
#include "surface3d/meshing/transfer.hpp"
#include "surface3d/run/companion_runs.hpp"
#include "surface3d/run/guards.hpp"
#include "surface3d/run/motion_frame.hpp"
#include "surface3d/run/motion_start.hpp"

namespace tubule::surface3d {
namespace {

// Measured choices: docs/decisions/surface_motion.md, "Surfaces in motion".
constexpr double first_step = 1e-4;            // of the time in which the mesh relaxes
constexpr double moment = 1e-2;                // of the first step, see set_moving()
constexpr double growth = 1.6, safety = 0.85;  // of steps
constexpr double shortest_step = 1e-9;         // of the relaxation time: shorter ones are a failure
// A new mesh is made below this quality, or where the normal on a neck turns by this from node to node; then none for
// some steps.
// Nodes of companions are farther apart, and normals turn more, by this factor.
constexpr double quality_to_remesh = 0.25, turn_to_remesh = 0.5, farther_apart = 1.5;
constexpr int steps_between_meshes = 20;
constexpr double finer_at = 0.9;  // of the coarsest mesh at walls and beads
// Errors of a companion over those of the run: with 2.25 times fewer triangles of order 4.
constexpr double larger_errors = 5;
// Coarser meshes once the motion is smooth: steps from try to try, most of them; the largest jump of the energy over
// the tolerance, the least quality of triangles; the first step there over the one before.
constexpr int steps_between_looks = 6, most_thinned = 2;
constexpr double part_of_jump = 0.25, quality_of_thinner = 0.5, shorter_first_step = 0.1;
constexpr int most_stalled = 100;       // steps
constexpr double one_condition = 1e-6;  // lack of volume, relative: below, meshes cannot keep both area and volume
constexpr double unseen_move = 0.25;    // between looks for self-intersection, of the distance of nodes
constexpr double kept = 1e-8;           // area and volume, relative: a larger drift is reported

// Integral over a step of length tau, after one of length `before`, of the parabola through three rates.
double integral_over_step(double tau, double before, double rate, double now, double past) {
    const double slope = (rate - now) / tau;
    const double bend = before > 0 ? (slope - (now - past) / before) / (tau + before) : 0;
    return tau * (now + rate) / 2 - bend * tau * tau * tau / 6;
}

}  // namespace

SurfaceSimulation::SurfaceSimulation(const Problem& c, RunObserver& watch, const MotionSettings& settings,
                                     CompanionRuns* companions)
    : case_(c), watch_(watch), companions_(companions) {
    memory_.settings = settings;
    memory_.error = settings.difference;
}

double SurfaceSimulation::begin_time() const {
    return case_.begin_time;
}

void SurfaceSimulation::use_mesh(const CurvedMesh& mesh) {
    const MotionControl control{.area = memory_.scale.area,
                                .volume = memory_.scale.volume,
                                .distance = memory_.scale.bead_distance,
                                .relaxation = memory_.scale.relaxation,
                                .follow_curvature = case_.surface.follow_curvature,
                                .least_variation = memory_.scale.least_variation,
                                .most_drift = std::max(most_drift / 2 * case_.accuracy.energy, one_condition),
                                .smoothing = case_.surface.smoothing};
    scheme_ = make_scheme(case_.scheme, mesh, case_.law, case_.energy, control);
    surface().carry_H0(memory_.H0);
    summary.elements = mesh.triangles();
}

void SurfaceSimulation::begin(const Start& from) {
    start_ = &from;
    if (from.resizable()) memory_.initial_mesh_of = memory_.settings.elements;
    const StartMesh start = from.mesh(memory_.settings.elements, case_.element_order);
    summary.warnings = from.notes();
    const SurfaceSpace space(start.mesh);
    if ((initial_stop_ = find_fold(mesh_quality(start.mesh)))) return;
    if (start.mesh.period > 0) require_periodic_sources(case_, start.mesh.period);
    remember_start(case_, start, space, memory_);
    summary.reference_energy = memory_.scale.reference_energy;
    memory_.next_step = first_step_from(std::min(first_step * memory_.scale.relaxation, case_.time.end - begin_time()));
    use_mesh(start.mesh);
    const SurfaceLaw& law = surface().law();
    if (law.keeps_volume && surface().area_is_volume(start.mesh, surface().fields(start.mesh))) refuse_to_deform(case_);
    const VectorField u = start_velocity(case_, start);
    state_ = u.size() > 0 ? surface().start(start.mesh, u.transpose().reshaped(), {}, begin_time())
                          : surface().start(start.mesh, begin_time());
    if (moves_from_the_first()) set_moving();
    if (surface().law().holds_rate()) jump();
    measure_first_state();
    memory_.balance.total_start = memory_.balance.lowest_total = total();
    if (companions_) memory_.error = std::max(memory_.error, companions_->begin(summary.elements, now_));
    update_error();  // the begin time is compared, too
    error_now_ = std::max(error_now_, memory_.error);
}

// The first step of a scheme that remembers earlier ones: `by_error`, unless the case gives its steps. Then a scheme of
// high order, whose first steps are of low order, begins with steps so short that they leave no error of low order.
double SurfaceSimulation::first_step_from(double by_error) const {
    if (!case_.surface.step) return by_error;
    const double step = *case_.surface.step, share = std::min(step / (case_.time.end - begin_time()), 1.0);
    return is_of_high_order(case_) ? step * std::pow(share, 1.5) : step;
}

bool SurfaceSimulation::moves_from_the_first() const {
    return case_.law.inertia == 0 && traits().controls_steps;
}

void SurfaceSimulation::measure_first_state() {
    measure_state();
    if (moves_from_the_first() && is_reported() && !is_rough(now_.smoothness)) now_.dissipation = initial_dissipation();
}

// Without inertia the surface moves from t = 0 on: takes the velocity of a very short step, against which the error of
// the first one is measured. If that fails, the first step says why.
void SurfaceSimulation::set_moving() {
    try {
        const MotionState soon = scheme_->step(state_, moment * memory_.next_step).state;
        if (!is_finite(soon)) return;
        state_.u = soon.u, state_.w = soon.w;
        state_.p = soon.p, state_.lambda = soon.lambda, state_.tension = soon.tension, state_.force = soon.force;
        state_.stretch = soon.stretch;
    } catch (const SolveError&) {
    }
}

// With inertia the velocity jumps where the rate of a distance that is held does: to that of a very short step. What
// acts from then on is that of another one. Returns the work of what pulls, which is at the mean of both rates.
double SurfaceSimulation::jump() {
    const auto rate = [&] {
        const CurvedMesh now = surface().mesh(state_);
        return surface().distance_rate(now, surface().bead_numbers(now),
                                       surface().velocity(state_, surface().fields(now)));
    };
    const double before = rate(), force = state_.force;
    state_.memory.reset(), state_.step = 0;
    memory_.next_step = first_step_from(std::min(memory_.next_step, shortest_usual_step()));
    set_moving();
    const double impulse = moment * memory_.next_step * state_.force;
    state_.force = force;
    set_moving();
    return impulse * (before + rate()) / 2;
}

// Initial dissipation. Short steps show the noise of the force, longer implicit steps damp it. Steps tau, 4 tau, 16 tau
// ...: each pair is extrapolated to tau = 0; the pair that changes least from the one before counts (below 0.5 %:
// enough; all above 10 %: the last).
double SurfaceSimulation::initial_dissipation() {
    constexpr double enough = 0.005, much = 0.1;
    constexpr int most_trials = 6;
    const auto after = [&](double tau) {
        const MotionState soon = scheme_->step(state_, tau).state;
        MotionState now = state_;
        now.u = soon.u, now.w = soon.w, now.p = soon.p, now.lambda = soon.lambda, now.tension = soon.tension;
        return measure(surface(), now).dissipation;
    };
    double best = now_.dissipation, least_change = HUGE_VAL;
    try {
        double tau = moment * memory_.next_step, of_step = best, before = 0;
        for (int i = 0; i < most_trials && !(least_change <= enough); ++i) {
            const double of_longer = after(tau *= 4), extrapolated = (4 * of_step - of_longer) / 3;
            const double change = i > 0 ? std::abs(extrapolated / before - 1) : HUGE_VAL;
            if (change < least_change || least_change > much) best = extrapolated, least_change = change;
            before = extrapolated, of_step = of_longer;
        }
    } catch (const SolveError&) {    // the first step says why
    } catch (const Paused& pause) {  // the initial row is written; a run that resumes from it computes this again
        initial_stop_ = pause_report(pause, state_.time);
    }
    return best;
}

void SurfaceSimulation::resume(const Restart& restart, const Start& start) {
    start_ = &start;
    summary.warnings = start.notes();
    auto [state, memory] = motion_restart(restart.record, case_.scheme);
    memory_ = memory;
    summary.reference_energy = memory_.scale.reference_energy;
    use_mesh(frame_surface(restart.record, restart.cells.value()));
    state_ = std::move(state);
    if (memory_.count.steps > 0)
        measure_state();
    else
        measure_first_state();
    if (companions_) companions_->resume(restart.record, summary.elements);
}

// Why the initial shape is not valid.
std::optional<StopReport> SurfaceSimulation::check_start() {
    if (initial_stop_) return initial_stop_;
    if (auto stop = check_state()) return stop;
    if (auto stop = impossible(now_.bending, state_)) return stop;
    return check_crossing(true);
}

Energetics SurfaceSimulation::energetics() const {
    return {.bending = now_.bending.energy,
            .free_energy = now_.free_energy,
            .total = total(),
            .total_start = memory_.balance.total_start,
            .total_least = memory_.balance.lowest_total,
            .kinetic = now_.kinetic,
            .dissipation = now_.dissipation,
            .acceleration = now_.acceleration,
            .area = now_.bending.area};
}

double SurfaceSimulation::shortest_usual_step() const {
    return first_step * memory_.scale.relaxation;
}

void SurfaceSimulation::measure_state() {
    now_ = measure(surface(), state_);
}

std::optional<StopReport> SurfaceSimulation::impossible(const Observables& o, const MotionState& s) const {
    return find_impossible_motion(o, surface().mesh(s), is_reported() ? 0.01 : 0.01 * larger_errors, state_.time);
}

std::optional<SurfaceSimulation::Refusal> SurfaceSimulation::check_trial(const MotionStep& next,
                                                                         const MotionMeasures& m) const {
    const double t = state_.time, E_ref = memory_.scale.reference_energy;
    const double asked = case_.accuracy.energy * (is_reported() ? 1 : larger_errors);
    const double then = m.free_energy + m.kinetic - memory_.balance.done() - work_of(next, m) - supplied_by(next, m);
    if (const auto spurious = impossible(m.bending, next.state))
        return Refusal{0.25, {spurious->reason, t, spurious->message, spurious->advice}};
    if (const auto rises = find_rise_in_step((then - total()) / E_ref, asked, t, next.state.step))
        return Refusal{0.25, *rises};
    const double since = then - memory_.balance.lowest_total;
    if (const auto rises = find_slow_rise(since / E_ref, asked, t))
        return Refusal{0, *rises};  // shorter steps would creep on
    return std::nullopt;
}

std::optional<SurfaceSimulation::Refusal> SurfaceSimulation::try_step(double tau) {
    const double t = state_.time;
    const auto failed = [&](const std::string& what) {
        if (may_be_undefined(now_.domain)) return Refusal{0.25, undefined_energy(now_, t)};
        if (may_be_undefined(now_.pressure_domain)) return Refusal{0.25, undefined_pressure(now_.pressure_domain, t)};
        return Refusal{0.25, {Stop::solver_failed, t, what, advice_where_it_fails()}};
    };
    try {
        surface().linear_work() = {};
        const MotionStep next = scheme_->step(state_, tau);
        memory_.linear_work.solves += surface().linear_work().solves,
            memory_.linear_work.lu += surface().linear_work().lu;
        memory_.linear_work.iterations += surface().linear_work().iterations;
        if (!is_finite(next.state)) return failed("the step overflows");
        const double error = next.error / (memory_.settings.tolerance * memory_.scale.length());
        if (!case_.surface.step && error > 2)
            return Refusal{std::clamp(safety / std::cbrt(error), 0.2, 0.7),
                           {Stop::solver_failed, t, fmt::format("steps of {:.3g} are still too inaccurate", tau),
                            "use a looser accuracy.energy, or more elements"}};
        const CurvedMesh mesh = surface().mesh(next.state);
        if (auto fold = find_fold(mesh_quality(mesh))) {
            fold->time = t;
            return Refusal{0.25, *fold};
        }
        const MotionMeasures m = measure(surface(), next.state, &state_);
        if (const auto refusal = check_trial(next, m)) return refusal;
        take(next, m);
        choose_next_step(tau, memory_.next_step, error, next.order);
        return std::nullopt;
    } catch (const TooLarge& failure) {  // for steps of any length
        return Refusal{0, {Stop::solver_failed, t, failure.what(), ""}};
    } catch (const SolveError& failure) {
        return failed(failure.what());
    }
}

// Length of the step before; 0 where a load changed its slope at its end: rates have a kink there.
double SurfaceSimulation::since_kink() const {
    const double before = std::nextafter(state_.time, -HUGE_VAL);
    return tubule::next_kink(surface().law(), before) == state_.time ? 0 : state_.step;
}

// Work of the loads in a step, in which none changes its slope, and of what draws beads apart.
double SurfaceSimulation::work_of(const MotionStep& next, const MotionMeasures& m) const {
    const SurfaceLaw& law = surface().law();
    const double extends = law.beads ? law.beads->rate(state_.time) : 0;
    const auto power = [&](const Extent& e, double force) { return law.power(state_.time, e) + force * extends; };
    return integral_over_step(next.state.step, state_.step,
                              power({m.bending.area, m.bending.volume, m.length}, m.force),
                              power(extent_now(), now_.force), power(memory_.balance.past, memory_.balance.force_past));
}

// What sources bring in a step, or kinetic energy of a reservoir: the mean of it per area, times the new area. Exact
// where a surface moves without a change of its velocity.
double SurfaceSimulation::supplied_by(const MotionStep& next, const MotionMeasures& m) const {
    if (surface().law().source.act())
        return integral_over_step(next.state.step, state_.step, m.source_power, now_.source_power,
                                  memory_.balance.source_past);
    if (!surface().law().supplies_kinetic_energy()) return 0;
    const double A = now_.bending.area, A_next = m.bending.area;
    return (now_.kinetic / A + m.kinetic / A_next) / 2 * (A_next - A);
}

void SurfaceSimulation::take(const MotionStep& next, const MotionMeasures& m) {
    memory_.balance.work += work_of(next, m);
    memory_.balance.supplied += supplied_by(next, m);
    memory_.balance.source_past = now_.source_power;
    memory_.balance.past = extent_now(), memory_.balance.force_past = now_.force;
    memory_.balance.dissipated += integral_over_step(next.state.step, since_kink(), m.dissipation, now_.dissipation,
                                                     memory_.balance.dissipation_past);
    memory_.balance.dissipation_past = now_.dissipation;
    memory_.balance.corrected += std::abs(next.correction);
    state_ = next.state;
    memory_.order = next.order;
    now_ = m;
    memory_.balance.lowest_total = std::min(memory_.balance.lowest_total, total());
    memory_.balance.imbalance = std::max(memory_.balance.imbalance, std::abs(memory_.balance.imbalance_at(total())));
    ++memory_.count.steps;
    memory_.count.rough += is_rough(m.smoothness);
}

// A step that was cut short by an output says little about how long the next one may be.
void SurfaceSimulation::choose_next_step(double tau, double asked, double error, int order) {
    if (case_.surface.step) {
        memory_.next_step = std::min(*case_.surface.step, growth * tau);
        return;
    }
    const double factor = error > 0 ? std::clamp(safety / std::pow(error, 1.0 / (order + 1)), 0.4, growth) : growth;
    memory_.next_step = std::max(tau * factor, tau < asked ? std::min(asked, growth * tau) : 0.0);
}

bool SurfaceSimulation::wants_new_mesh() const {
    if (!traits().controls_mesh || memory_.count.steps < memory_.count.mesh_since + steps_between_meshes) return false;
    const double most = turn_to_remesh * (is_reported() ? 1 : farther_apart);
    return now_.quality.worst < quality_to_remesh || (now_.turn.saddle && now_.turn.angle > most) || is_coarse();
}

// The same surface with good triangles, and small ones where it is sharp; the next step is again the first of its kind.
// Where no better mesh can be made, the old one is kept: check_state() stops the run when it is no longer good enough.
void SurfaceSimulation::make_new_mesh() {
    memory_.count.mesh_since = memory_.count.steps;
    const CurvedMesh now = surface().mesh(state_);
    const auto& beads = surface().law().beads;
    RemeshOptions options;
    if (beads || !case_.energy.potentials.empty())
        options.largest = largest_edges(now, case_.energy.potentials, beads,
                                        beads ? surface().bead_numbers(now) : BeadNumbers::Zero().eval()) *
                          (is_reported() ? 1 : farther_apart);
    const auto found = remesh(now, carried(), options);
    const auto* better = std::get_if<Remeshed>(&found);
    if (!better || (better->quality.worst < now_.quality.worst && !is_coarse())) return;
    if (!change_mesh(better->mesh, better->fields, HUGE_VAL)) return;
    memory_.initial_mesh_of = 0;
    memory_.next_step = first_step_from(std::min(memory_.next_step, first_step * memory_.scale.relaxation));
}

// Where companions can take fewer triangles, too: where they have got to the same time.
bool SurfaceSimulation::may_be_thinned() const {
    if (!case_.surface.coarsen || !is_reported() || memory_.count.thinned == most_thinned) return false;
    const int since = memory_.count.steps - memory_.count.mesh_since, next = fewer_triangles(memory_.initial_mesh_of);
    if (since < steps_between_meshes || memory_.count.steps % steps_between_looks != 0) return false;
    return companions_ ? fewer_triangles(next) >= least_triangles && companions_->is_at(state_.time)
                       : next >= least_triangles;
}

// Takes the mesh of about `triangles` of the initial shape, with its nodes where the same points are now. False where
// that is not a good mesh, or the energy would jump by more than `most_jump`, absolutely.
bool SurfaceSimulation::thin_to(int triangles, double most_jump) {
    if (memory_.initial_mesh_of == 0) return false;
    const int order = case_.element_order;
    try {
        const CurvedMesh from = start_->mesh(memory_.initial_mesh_of, order).mesh,
                         to = start_->mesh(triangles, order).mesh;
        if (to.triangles() >= from.triangles()) return false;
        const std::vector<MeshPoint> places = places_of_nodes(to, from);
        const CurvedMesh now = surface().mesh(state_), next = moved_to(places, now, to);
        if (!(mesh_quality(next).worst > quality_of_thinner)) return false;
        if (is_reported() && coarseness_of(next) > finer_at * most_coarse()) return false;
        if (!change_mesh(next, values_at(places, now, carried()), most_jump)) return false;
    } catch (const SolveError&) {
        return false;
    }
    memory_.initial_mesh_of = triangles;
    memory_.count.mesh_since = memory_.count.steps;
    ++memory_.count.thinned;
    memory_.next_step = first_step_from(shorter_first_step * memory_.next_step);
    return true;
}

void SurfaceSimulation::look_for_thinner() {
    const double most = part_of_jump * case_.accuracy.energy * memory_.scale.reference_energy;
    if (!thin_to(fewer_triangles(memory_.initial_mesh_of), most)) return;
    watch_.note(fmt::format("t = {:.4g}: continues with {} triangles", state_.time, summary.elements));
    if (companions_) companions_->thinned(memory_.initial_mesh_of, summary.elements);
}

std::optional<StopReport> SurfaceSimulation::take_thinner_mesh(int triangles, int of_run) {
    if (!thin_to(triangles, HUGE_VAL))
        return StopReport{Stop::resolution_lost, state_.time,
                          fmt::format("there is no mesh of {} triangles", triangles), ""};
    memory_.settings.coarser_by = 1.0 * of_run / summary.elements;
    return std::nullopt;
}

// Nodal fields to carry to another mesh: velocities, and H0 where it varies.
Eigen::MatrixXd SurfaceSimulation::carried() const {
    const Eigen::Index n = state_.X.cols(), d = state_.u.size() / n;
    Eigen::MatrixXd out = state_.u.reshaped(n, d).transpose();
    if (memory_.H0.size() == 0) return out;
    out.conservativeResize(d + 1, n);
    out.row(d) = memory_.H0.transpose();
    return out;
}

// Changes to another mesh of the same surface, with the fields carried there. The jump of the energy counts as an
// error. Where it would exceed `most_jump`, or area and volume cannot be kept, the old mesh is kept.
bool SurfaceSimulation::change_mesh(const CurvedMesh& mesh, const Eigen::MatrixXd& fields, double most_jump) {
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
        state_ = surface().start(mesh, fields.topRows(d).transpose().reshaped(), momenta, old_state.time);
        state_.stretch = old_state.stretch, state_.force = old_state.force;
        measure_state();
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

std::optional<StopReport> SurfaceSimulation::advance(double until) {
    if (surface().law().holds_rate() && state_.time > begin_time() &&
        case_.law.beads->next_kink(std::nextafter(state_.time, -HUGE_VAL)) == state_.time) {
        memory_.balance.work += jump();
        measure_state();
    }
    const double kink = next_kink(), left = std::min(kink, until) - state_.time;
    const auto tau = [&] { return left / std::ceil(left / memory_.next_step * (1 - 1e-9)); };  // no short last step
    while (const auto refusal = try_step(tau())) {
        ++memory_.count.rejected;
        memory_.next_step = refusal->shrink * tau();
        const double shortest = shortest_step * memory_.scale.relaxation;  // 0 where numbers are too large for any step
        if (refusal->shrink == 0 || case_.surface.step || !(memory_.next_step > shortest)) return refusal->report;
        check_pause();
    }
    for (const double target : {kink, until})
        if (std::abs(state_.time - target) <= moment_of_time()) state_.time = target;
    return std::nullopt;
}

std::optional<StopReport> SurfaceSimulation::find_event(bool at_output) {
    if (auto stop = check_state()) return stop;
    return check_crossing(at_output);
}

std::optional<StopReport> SurfaceSimulation::check_error() {
    if (!companions_ || memory_.error <= companions_->give_up * memory_.scale.reference_energy) return std::nullopt;
    // Not shown: a finer run replaces this one.
    return StopReport{Stop::resolution_lost, state_.time, "far less accurate than asked for, already", ""};
}

std::optional<StopReport> SurfaceSimulation::adapt_mesh() {
    if (wants_new_mesh()) make_new_mesh();
    if (may_be_thinned()) look_for_thinner();
    return std::nullopt;
}

std::string SurfaceSimulation::advice_where_it_fails() const {
    const MotionLaw& law = case_.law;
    if (law.beads && law.beads->extension && !law.area_is_free() && law.keeps_volume)
        return "fixed area and volume allow only some distances of the beads: free one of them, end the extension "
               "earlier, or try another discretisation.elements";
    if (const auto step = case_.surface.step)
        return fmt::format("discretisation.step = {:g} may be too long: leave it out, or try {:g}", *step, *step / 10);
    return "try another discretisation.elements or discretisation.order";
}

StopReport SurfaceSimulation::failure(const SolveError& error) {
    return {Stop::solver_failed, state_.time, error.what(), advice_where_it_fails()};
}

// At walls and beads.
double SurfaceSimulation::most_coarse() const {
    return coarsest_place * (is_reported() ? 1 : farther_apart);
}

double SurfaceSimulation::coarseness_of(const CurvedMesh& mesh) const {
    const double at_walls = wall_coarseness(mesh, case_.energy.potentials).value;
    if (!surface().beads()) return at_walls;
    const BeadNumbers beads = bead_numbers(SurfaceSpace(mesh), mesh, *surface().beads(), 1);
    return std::max(at_walls, bead_coarseness(mesh, beads, surface().beads()->width()).value);
}

bool SurfaceSimulation::is_coarse() const {
    return std::max(now_.coarse_wall.value, now_.coarse_bead.value) > finer_at * most_coarse();
}

// Why the surface or its energy is not valid.
std::optional<StopReport> SurfaceSimulation::check_state() const {
    const double t = state_.time, asked = case_.accuracy.energy;
    if (auto bad = find_bad_shape(now_, least_neck(case_, memory_.scale.area), t)) return bad;
    if (auto coarse = find_coarse_place(now_, most_coarse(), t)) return coarse;
    if (traits().controls_mesh)
        if (auto drift = find_drift(volume_drift(), asked, t)) return drift;
    return std::nullopt;
}

// Checks at outputs, and when nodes have moved by `unseen_move` since the last check: parts that cross and separate
// again in between are no deeper than that.
std::optional<StopReport> SurfaceSimulation::check_crossing(bool at_output) {
    const double spacing = memory_.scale.length() / std::sqrt(summary.elements) / case_.element_order;
    memory_.moved += state_.step * (now_.speed + std::abs(state_.stretch) * state_.period);
    if (memory_.moved < unseen_move * spacing && !at_output) return std::nullopt;
    auto crossing = find_self_intersection(surface().mesh(state_));
    memory_.moved = 0;
    if (!crossing) return std::nullopt;
    crossing->time = state_.time;
    if (memory_.count.steps == 0)
        crossing->advice = "change the shape; if only its triangles intersect, use more elements or another mesh";
    return crossing;
}

// The error stated in a row is the largest one until then, since at one instant the energies of a pair may agree by
// chance. It is at least the rise of the energy, and the imbalance: both runs of the pair may have these errors in
// common.
std::optional<StopReport> SurfaceSimulation::update_error() {
    if (!is_reported()) return std::nullopt;
    std::optional<double> error;
    if (companions_)
        error =
            companions_->compare_at(state_.time, comparable(), now_.dissipation, memory_.order, now_.smoothness.order);
    const double rise = total() - memory_.balance.lowest_total, spare = companions_ ? companions_->spare() : 1,
                 imbalance = spare * std::abs(memory_.balance.imbalance_at(total()));
    if (error) memory_.error = std::max({memory_.error, *error, rise});
    error_now_ = std::max(error ? memory_.error : memory_.scale.reference_energy, imbalance);
    return std::nullopt;
}

// Change of a volume that is to be kept, relative to the initial one.
double SurfaceSimulation::volume_drift() const {
    return surface().law().keeps_volume ? now_.bending.volume / memory_.scale.volume - 1 : 0;
}

void SurfaceSimulation::warn_of_drift() {
    const double area = surface().law().conserves_area() ? std::abs(now_.bending.area / memory_.scale.area - 1) : 0;
    const double volume = std::abs(volume_drift());
    const std::string why = traits().controls_mesh ? "on this shape, keeping the area nearly keeps the volume"
                                                   : fmt::format("scheme \"{}\" does not correct them", traits().name);
    if (std::max(area, volume) > kept)
        summary.warnings.push_back(
            fmt::format("area and volume drifted by {:.2g} and {:.2g} (relative): {}", area, volume, why));
}

class SurfaceSimulation::View : public StateView {
public:
    explicit View(const SurfaceSimulation& run) : run_(run) {}

    std::vector<double> row(double wall_seconds) const override {
        const MotionBalance& balance = run_.memory_.balance;
        return motion_series(run_.case_)
            .values({run_.state_, run_.now_, balance.done(), run_.volume_drift(), balance.imbalance_at(run_.total()),
                     balance.corrected, run_.error_now_, run_.summary.elements, wall_seconds});
    }

    Record record() const override {
        const std::size_t mesh = run_.watch_.mesh(cells_of(run_.mesh()));
        Record out = motion_record(run_.surface(), run_.state_, run_.now_, run_.memory_, mesh);
        if (run_.companions_) run_.companions_->save(out);
        return out;
    }

private:
    const SurfaceSimulation& run_;
};

// Steps end at outputs: no other time is asked for.
std::unique_ptr<StateView> SurfaceSimulation::at(double) {
    return std::make_unique<View>(*this);
}

void SurfaceSimulation::summarise() {
    summary.details = {{"pairs", std::int64_t{memory_.settings.pair}}};
    if (!scheme_) return;
    summary.rough_steps = memory_.count.rough;
    warn_of_drift();
    const int nodes = static_cast<int>(state_.X.cols());
    summary.effort = fmt::format("{} steps ({} rejected), {} triangles of order {}, {} nodes", memory_.count.steps,
                                 memory_.count.rejected, summary.elements, case_.element_order, nodes);
    summary.details.insert(summary.details.begin(), {{"elements", std::int64_t{summary.elements}},
                                                     {"nodes", std::int64_t{nodes}},
                                                     {"order", std::int64_t{case_.element_order}},
                                                     {"steps", std::int64_t{memory_.count.steps}},
                                                     {"rejected_steps", std::int64_t{memory_.count.rejected}},
                                                     {"linear_solves", memory_.linear_work.solves},
                                                     {"gmres_iterations", memory_.linear_work.iterations},
                                                     {"lu_solves", memory_.linear_work.lu},
                                                     {"time_tolerance", memory_.settings.tolerance},
                                                     {"meshes", std::int64_t{memory_.count.meshes}},
                                                     {"relaxation", memory_.scale.relaxation},
                                                     {"dissipated", memory_.balance.dissipated},
                                                     {"work", memory_.balance.done()},
                                                     {"identity_defect", memory_.balance.imbalance_at(total())},
                                                     {"correction_energy", memory_.balance.corrected}});
}

Loop loop_of(SurfaceSimulation& run, const Problem& c, RunObserver& watch, const RunClock& clock) {
    Loop out(run, c, watch, clock, run.is_reported());
    if (run.has_state())
        out.add(std::make_unique<Stall>(most_stalled, run.shortest_usual_step(), c.accuracy.energy,
                                        "use a looser accuracy.energy, or more elements"));
    return out;
}

}  // namespace tubule::surface3d
