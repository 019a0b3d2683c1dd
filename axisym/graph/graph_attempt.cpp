#include "axisym/graph/graph_attempt.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "axisym/graph/graph_derivatives.hpp"
#include "axisym/graph/graph_start.hpp"
#include "axisym/integration/bdf_flow.hpp"
#include "axisym/integration/rosenbrock_flow.hpp"
#include "common/run/energy_checks.hpp"
#include "common/run/error_scale.hpp"

namespace tubule::axisym {
namespace {

// Measured choices: docs/decisions/graphs.md, "Ask for accuracy".
constexpr double first_remesh_margin = 1.0 / 10;  // defect after a remesh / defect before
constexpr int few_steps = 10;                     // between two remeshes of a shape that keeps sharpening
constexpr int most_failures = 3;                  // of the integrator at one state
constexpr double path_error = 0.01;               // of states within a step, at most, relative to what was asked
constexpr double least_share = 0.01;              // of the tolerance of a step, that an error is at least
constexpr double hopeless_error = 0.1;            // of E_ref: explicit settings that lose the shape

}  // namespace

GraphAttempt::GraphAttempt(const Case& c, RunObserver& watch, const RunClock& clock, const GraphSettings& settings)
    : case_(c),
      clock_(clock),
      series_(graph_series(c)),
      settings_(settings),
      out_(watch, clock, true),
      outputs_(c),
      remesh_margin_(first_remesh_margin) {}

double GraphAttempt::Now::lost() const {
    return std::accumulate(defect.begin(), defect.end(), 0.0);
}

const Observation& GraphAttempt::observe(double t, const double* x, const double* v) {
    if (t != now_.time) {
        now_.o = stage_->look(x, v, &now_.defect);
        now_.time = t;
    }
    return now_.o;
}

void GraphAttempt::use_stage(std::unique_ptr<GraphStage> stage) {
    stage_ = std::move(stage);
    summary.elements = stage_->space.elements() * stage_->space.cell().images();
}

FlowSystem GraphAttempt::system() {
    const Forms& forms = stage_->forms;
    FlowSystem system;
    system.residual = [&forms](double, const double* at, const double* rate, double* out) {
        return forms.residual(at, rate, out);
    };
    system.jacobian = [&forms](double, const double* at, const double* rate, double cj, double* values) {
        forms.jacobian(at, rate, cj, values);
    };
    system.pattern = &forms.pattern();
    system.banded = stage_->space.cell().mirror;
    system.mass = [&forms](const double* at, double* values) { forms.mass(at, values); };
    system.dissipation = [this, &forms](double when, const double* at, const double* rate) {
        if (when != now_.time && is_one_step()) return forms.observe(at, rate).dissipation;  // within a step
        return observe(when, at, rate).dissipation;
    };
    system.guards = [this](double when, const double* at, const double* rate) {
        const Observation& o = observe(when, at, rate);
        if (is_one_step() && out_.reported() && seen_.size() < path_points.size()) seen_.emplace_back(when, o);
        Guards values;
        for (const GraphGuard& guard : graph_guards()) values.push_back(guard.value(o, limits()));
        return values;
    };
    system.n_guards = graph_guards().size();
    return system;
}

void GraphAttempt::make_flow(const Eigen::VectorXd& x, const Eigen::VectorXd& v, double t, double first_step) {
    if (flow_) {
        past_.dissipated = dissipated(flow_->time());
        past_.counters += flow_->counters();
    }
    TimeControl control;
    control.relative = settings_.time_tolerance;
    control.absolute =
        1e-3 * settings_.time_tolerance * std::min(std::get<Tube>(case_.shape).radius, 1e3 * case_.accuracy.r_min);
    control.max_order = case_.time.max_order;
    control.first_step = first_step;
    now_.time = std::numeric_limits<double>::quiet_NaN();
    if (is_one_step())
        flow_ = std::make_unique<RosenbrockFlow>(system(), x, v, t, control);
    else
        flow_ = std::make_unique<BdfFlow>(system(), x, v, t, control);
    stage_->transport.begin(flow_->x(), flow_->v());
    error_.begin(observe(t, flow_->x(), flow_->v()));
    dissipated_.begin(t, now_.o.dissipation);
    if (!least_symbol_) least_symbol_ = least_symbol_of(case_.energy, now_.o);
    good_.x = x;
    good_.time = t;
    good_.balance = now_.o.free_energy + dissipated(t);
}

void GraphAttempt::begin() {
    const Tube& tube = std::get<Tube>(case_.shape);
    const Cell cell = cell_of(tube, case_.discretisation.symmetry);
    const auto start = [&](double z) { return radius_at(tube, z); };
    FirstMesh mesh = first_mesh(case_, settings_, cell, start);
    summary.reference_energy = mesh.reference_energy;
    settings_.defect *= mesh.reference_energy;
    use_stage(std::make_unique<GraphStage>(cell, std::move(mesh.breaks), case_));
    const Eigen::VectorXd x = stage_->space.project(start);
    ErrorTransport& transport = stage_->transport;
    transport.total = transport.space().project(start) - transport.space().prolong(stage_->space, x);
    make_flow(x, stage_->forms.rate(x), 0, 0);
    error_.carry_on(*stage_, now_.o);  // so far that of the first mesh
    past_.energy_start = now_.o.free_energy;
    out_.note(doubt_before(case_, past_.energy_start, summary.reference_energy));
    write(0, error_.now(), now_.o, flow_->x(), flow_->v());
}

void GraphAttempt::resume(const Record& restart) {
    const GraphRestart state = graph_restart(restart);
    use_stage(std::make_unique<GraphStage>(state.cell, state.breaks, case_));
    stage_->transport.set(state.error_total, state.error_spatial);
    summary.reference_energy = state.reference_energy;
    settings_.time_tolerance = state.time_tolerance;
    settings_.defect = state.defect;
    past_.energy_start = state.energy_start;
    past_.dissipated = state.dissipated;
    error_.largest = state.error_max;
    least_symbol_ = state.least_symbol;
    outputs_.go_on_from(restart.time);
    out_.go_on_from(restart.time);
    make_flow(state.coefficients, stage_->forms.rate(state.coefficients), restart.time, 0);
}

GraphLimits GraphAttempt::limits() const {
    return {case_.accuracy.r_min, least_symbol_.value_or(0)};
}

// Carries the error on. True if it is beyond what was asked and something can be done about it.
bool GraphAttempt::must_give_up(const Observation& o) {
    error_.carry_on(*stage_, o);
    const double allowed = case_.accuracy.energy * summary.reference_energy / stated_over_computed;
    gave_up = settings_.may_give_up && error_.is_curable(settings_, allowed);
    return gave_up;
}

// Gradient flow does not let the energy rise: what it rises by is an error. Where that is more than the error known and
// more than the error asked for, the run goes back to the last good state.
std::optional<StopReport> GraphAttempt::find_rise(const Observation& o) {
    const double rise = o.free_energy - good_.least_energy, asked = case_.accuracy.energy * summary.reference_energy;
    if (rise > std::max(asked, stated_over_computed * error_.largest)) error_.carry_on(*stage_, o);
    if (rise <= std::max(asked, stated_over_computed * error_.now())) {
        error_.largest = std::max(error_.largest, rise / stated_over_computed);
        good_.least_energy = std::min(good_.least_energy, o.free_energy);
        return std::nullopt;
    }
    error_.latest = {rise, 0};
    gave_up = settings_.may_give_up && settings_.free_time;
    const Eigen::VectorXd x = good_.x;
    make_flow(x, stage_->forms.rate(x), good_.time, 0);
    return StopReport{
        Stop::resolution_lost, good_.time,
        fmt::format("the next step raises the energy by {:.2g} of E_ref, but this flow can only lose energy",
                    rise / summary.reference_energy),
        "ask for more accuracy; check that the energy resists bending where H = H0"};
}

std::optional<StopReport> GraphAttempt::find_lost_accuracy(double t) const {
    if (error_.now() <= hopeless_error * summary.reference_energy) return std::nullopt;
    const bool asked = !settings_.free_mesh || !settings_.free_time;
    return StopReport{
        Stop::resolution_lost, t,
        fmt::format("the error of the energy reached {:.2g} of E_ref{}", error_.now() / summary.reference_energy,
                    asked ? " with the given discretisation" : ""),
        asked ? "omit discretisation.elements and discretisation.time_tolerance, or refine them"
              : "ask for more accuracy: errors grow during the run from this start"};
}

std::optional<StopReport> GraphAttempt::check(Flow::Outcome outcome, const Observation& o) {
    const double t = flow_->time();
    if (outcome == Flow::Outcome::guard) return graph_guards()[flow_->tripped()].report(o, *stage_, flow_->x(), t);
    if (outcome == Flow::Outcome::end) return StopReport{Stop::finished, t, "reached time.end", ""};
    if (case_.time.stationary && past_.settling.is_settled(case_, t, o.dissipation, o.area) &&
        o.dissipation * (case_.time.end - t) < *case_.time.stationary * summary.reference_energy)
        return StopReport{Stop::stationary, t,
                          fmt::format("the energy dissipates at a rate of only {:.3g}", o.dissipation), ""};
    if (auto pause = clock_.find_pause(t)) return pause;
    if (auto lost = find_lost_accuracy(t)) return lost;
    if (o.symbol_3d <= 0 && summary.warnings.empty())
        summary.warnings.push_back(
            fmt::format("from t = {:.6g} on, the flow of the full surface is ill-posed in directions that axisymmetric "
                        "motion does not excite",
                        t));
    return std::nullopt;
}

// A shape that keeps sharpening gets more room each time, as every remesh restarts the integrator.
std::optional<StopReport> GraphAttempt::remesh() {
    const bool soon = flow_->counters().steps < few_steps && summary.meshes > 1;
    remesh_margin_ = soon ? std::max(remesh_margin_ / 8, 1e-3) : first_remesh_margin;
    const double t = flow_->time();
    const Observation o = now_.o;
    auto breaks = refined_breaks(stage_->space, now_.defect, settings_.defect * remesh_margin_, most_graph_elements);
    if (static_cast<int>(breaks.size()) > most_graph_elements + 1) {
        if (is_about_to_overhang(o)) return overhang(o, *stage_, flow_->x(), flow_->time());
        return StopReport{Stop::resolution_lost, t,
                          fmt::format("the profile needs more than {} elements per cell near z = {:.6g}",
                                      most_graph_elements, stage_->place(o.z_steep)),
                          "ask for less accuracy"};
    }
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(flow_->x(), stage_->space.size());
    auto next = std::make_unique<GraphStage>(stage_->space.cell(), std::move(breaks), case_);
    const Eigen::VectorXd projected = next->space.prolongation(stage_->space) * x;  // all knots of before are here
    next->transport.inherit(stage_->transport, x, projected);
    const double step = flow_->step_size();
    use_stage(std::move(next));  // from here on nothing pauses: stage and flow belong together
    make_flow(projected, stage_->forms.rate(projected), t, is_one_step() ? step : 0);
    ++summary.meshes;
    return std::nullopt;
}

// Names the terms whose derivatives are wrong at the last good state, if any.
std::string GraphAttempt::suspects() const {
    std::string keys;
    for (const TermCheck& term : check_terms(stage_->forms, good_.x))
        if (!term.check.pass()) keys += (keys.empty() ? "" : ", ") + term.key;
    return keys.empty() ? "the derivatives of all terms are right" : "wrong derivatives: " + keys;
}

StopReport GraphAttempt::failure(const std::string& what) const {
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(good_.x.size());
    const Observation o = stage_->look(good_.x.data(), rest.data(), nullptr);
    if (is_about_to_overhang(o)) return overhang(o, *stage_, flow_->x(), flow_->time());
    if (may_be_undefined(o.domain))
        return undefined_energy(o.domain, good_.time, fmt::format("z = {:.6g}", stage_->place(o.domain.place)));
    return {Stop::solver_failed, good_.time, fmt::format("{} ({})", what, suspects()),
            "ask for more accuracy, or lower time.max_order"};
}

std::optional<StopReport> GraphAttempt::recover() {
    const std::string said = flow_->failure();
    if (auto pause = clock_.find_pause(good_.time)) return pause;
    if (++good_.failures > most_failures) return failure("the time integrator gave up: " + said);
    const Eigen::VectorXd x = good_.x;
    make_flow(x, stage_->forms.rate(x), good_.time, 0);
    return std::nullopt;
}

// A start beyond a limit stops at once: the integrator only sees limits being crossed.
std::optional<StopReport> GraphAttempt::check_start() const {
    if (outputs_.done()) return StopReport{Stop::finished, flow_->time(), "reached time.end", ""};
    for (const GraphGuard& guard : graph_guards())
        if (guard.value(now_.o, limits()) <= 0) return guard.report(now_.o, *stage_, flow_->x(), flow_->time());
    return std::nullopt;
}

void GraphAttempt::go() {
    std::optional<StopReport> stop = check_start();
    try {
        while (!stop) stop = step();
    } catch (const SolveError& error) {
        stop = failure(error.what());
    } catch (const Paused& pause) {
        stop = pause_report(pause, flow_->time());
    }
    end_with(*stop);
}

// One step of the integrator, and all that is due after it.
std::optional<StopReport> GraphAttempt::step() {
    const double before = flow_->time(), error_before = error_.now();
    seen_.clear();
    const Flow::Outcome outcome = flow_->advance(case_.time.end);
    if (outcome == Flow::Outcome::failed) return recover();
    const double t = flow_->time();
    const StopReport given_up{Stop::resolution_lost, t, "the error exceeds the requested accuracy", ""};
    if (outcome == Flow::Outcome::guard) now_.time = std::numeric_limits<double>::quiet_NaN();
    const Observation o = observe(t, flow_->x(), flow_->v());
    if (t > before) {
        stage_->transport.add_step(*flow_, before, is_one_step());
        dissipated_.add(t, o.dissipation);
    }
    if (const auto rise = find_rise(o)) return rise;
    const bool due = error_.due(o, is_one_step());
    if ((due || outcome != Flow::Outcome::step) && must_give_up(o)) return given_up;
    write_outputs(before, std::max(error_before, error_.now()), o);
    write_row(t, error_.now(), o, flow_->x());
    out_.progress(t, o.energy, flow_->step_size());
    good_.x = Eigen::Map<const Eigen::VectorXd>(flow_->x(), stage_->space.size());
    good_.time = t;
    good_.balance = o.free_energy + dissipated(t);
    good_.failures = 0;
    if (const auto stop = check(outcome, o)) return stop;
    out_.safeguard([&] { return record(t, o, flow_->x(), flow_->v()); });
    const bool output_is_near = outputs_.next() - t < 1e-9 * t;
    if (!settings_.free_mesh || output_is_near || now_.lost() <= settings_.defect) return std::nullopt;
    if (must_give_up(o)) return given_up;
    return remesh();
}

// Few long steps may miss their own error: what is stated is not far below the tolerance of a step, unless the energy
// has hardly changed.
double GraphAttempt::least_error() const {
    if (!is_one_step()) return 0;
    return least_share * std::min(settings_.time_tolerance * summary.reference_energy,
                                  std::abs(now_.o.free_energy - past_.energy_start));
}

// Saves the state of a run that ended before its time, and sums up.
void GraphAttempt::end_with(const StopReport& stop) {
    const double t = flow_->time();
    if (!gave_up) out_.end(stop, t, [&] { return record(t, now_.o, flow_->x(), flow_->v()); });
    summary.stop = stop;
    summary.energy = now_.o.energy;
    if (const std::string doubt =
            doubt_after(case_, stop.reason, past_.energy_start, now_.o.free_energy, summary.reference_energy);
        !doubt.empty())
        summary.warnings.push_back(doubt);
    summary.estimated_error = std::max(stated_over_computed * error_.largest, least_error()) / summary.reference_energy;
    summary.time_tolerance = settings_.time_tolerance;
    summary.counters = past_.counters;
    summary.counters += flow_->counters();
}

// What is due after a step: frames at output times, and rows at points of its path. `error`: the larger one of the two
// ends, since the error may pass through zero at one of them.
void GraphAttempt::write_outputs(double from, double error, const Observation& o) {
    const double end = flow_->time();
    while (outputs_.due(end)) {
        const double t = outputs_.pass();
        write_path(from, t, error);
        from = t;
        if (t == end) {
            write(t, error_.now(), o, flow_->x(), flow_->v());
        } else {
            Eigen::VectorXd x(stage_->space.size()), v(stage_->space.size());
            flow_->look_back(t, x.data(), v.data());
            write(t, error, stage_->look(x.data(), v.data(), nullptr), x.data(), v.data());
        }
    }
    write_path(from, end, error);
}

// Long steps have rows on their way, where guards have looked at the path. Its order is below that of the steps: the
// balance of energy shows what its energy is off by, which counts as an error of the run. Where that is too much, a
// shorter step gets to the middle.
void GraphAttempt::write_path(double from, double until, double error) {
    const double asked = case_.accuracy.energy * summary.reference_energy;
    const double allowed = path_error * std::min(3 * settings_.time_tolerance * summary.reference_energy, asked);
    Eigen::VectorXd x(stage_->space.size()), v(stage_->space.size());
    for (const auto& [t, o] : seen_) {
        if (!(t > from && t < until) || !out_.wants_row(t)) continue;
        const double lost = std::abs(o.free_energy + dissipated(t) - good_.balance);
        const double both = error + lost / stated_over_computed;
        if (lost > allowed || stated_over_computed * both > asked) {
            if (&seen_[path_points.size() / 2].first != &t) continue;
            flow_->look_back(t, x.data(), v.data());
            write_row(t, error, stage_->look(x.data(), v.data(), nullptr), x.data());
        } else {
            error_.largest = std::max(error_.largest, both);
            flow_->interpolate(t, x.data(), v.data());
            write_row(t, both, o, x.data());
        }
    }
}

void GraphAttempt::write(double t, double error, const Observation& o, const double* x, const double* v) {
    write_row(t, error, o, x);
    out_.frame(t, [&] { return record(t, o, x, v); });
}

void GraphAttempt::write_row(double t, double error, const Observation& o, const double* x) {
    if (!out_.wants_row(t)) return;
    const long iterations = flow_->counters().newton_iterations + past_.counters.newton_iterations;
    out_.row(t,
             series_.values({t, o, x, *stage_, *flow_, iterations, o.free_energy - past_.energy_start + dissipated(t),
                             stated_over_computed * error, summary.elements, out_.seconds()}));
}

Record GraphAttempt::record(double t, const Observation& o, const double* x, const double* v) const {
    GraphRestart state;
    state.cell = stage_->space.cell();
    state.breaks = stage_->space.breaks();
    state.coefficients = Eigen::Map<const Eigen::VectorXd>(x, stage_->space.size());
    state.error_total = stage_->transport.total;
    state.error_spatial = stage_->transport.spatial();
    state.reference_energy = summary.reference_energy;
    state.time_tolerance = settings_.time_tolerance;
    state.defect = settings_.defect;
    state.energy_start = past_.energy_start;
    state.dissipated = dissipated(t);
    state.error_max = error_.largest;
    state.least_symbol = least_symbol_.value_or(0);
    return graph_record(t, stage_->space, state, Eigen::Map<const Eigen::VectorXd>(v, stage_->space.size()), o.energy);
}

}  // namespace tubule::axisym
