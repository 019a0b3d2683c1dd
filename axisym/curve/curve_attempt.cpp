#include "axisym/curve/curve_attempt.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "axisym/curve/curve_series.hpp"
#include "axisym/integration/bdf_flow.hpp"
#include "common/run/energy_checks.hpp"
#include "common/run/error_scale.hpp"
#include "common/solve/sparse.hpp"

namespace tubule::axisym {
namespace {

constexpr int steps_between_looks = 10;
// Measured choices: docs/decisions/curves.md, "How large is the error of a curve in motion?".
constexpr double error_per_defect = 0.5;           // of the energy balance
constexpr double least_error = 0.02;               // of what is asked for: no estimate is trusted below
constexpr double start_steps = 40;                 // over which steps grow where the integrator begins
constexpr double least_share = 0.2;                // of the difference of a pair, which is the error of the coarser run
constexpr double alike = 0.7, share_if_alike = 3;  // runs of a pair by their steps, where these are not few: share()
constexpr int few_steps = 8;
constexpr double hopeless_rise = 0.1;  // of E_ref: more is no error of a run that can be believed

// How often the integrator has begun by this time: at the start, and at each kink of the loads.
int beginnings(const MotionLaw& law, double t) {
    int count = 1;
    for (double kink = next_kink(law, 0); kink < t; kink = next_kink(law, kink)) ++count;
    return count;
}

}  // namespace

CurveAttempt::CurveAttempt(const Case& c, RunObserver& watch, const RunClock& clock, const Beginning& start,
                           const CurveSettings& settings, const EndedRun* coarser)
    : setup_(c, start, settings),
      clock_(clock),
      coarser_(coarser),
      out_(watch, clock, !settings.is_coarser),
      outputs_(c) {
    summary.reference_energy = setup_.reference_energy;
    summary.elements = setup_.elements();
    summary.time_tolerance = settings.tolerance;
    summary.attempts = settings.pair;
}

const Snapshot& CurveAttempt::observe(double t, const double* y, const double* rate) {
    if (t != observed_at_) {
        now_ = measure(*setup_.motion, t, y, rate);
        observed_at_ = t;
    }
    return now_;
}

void CurveAttempt::begin() {
    CurveBegin at;
    try {
        at = begin_state(setup_);
    } catch (const SolveError& error) {
        at = given_state(setup_);
        stop_ = StopReport{Stop::solver_failed, 0, error.what(),
                           "ask for more accuracy, set discretisation.elements, or choose a smoother initial shape"};
    }
    make_flow(at.y, at.rate, at.time, at.first_step);
    const Snapshot s = setup_.initial_shape(measure(*setup_.motion, 0, at.shown.data(), at.rate.data()));
    past_.total_start = s.total();
    past_.least = past_.total_start;
    out_.note(doubt_before(setup_.c, s.free_energy, summary.reference_energy));
    out_.note(setup_.start.note);
    compare(0, s);
    trace.add(0, s.free_energy, 0);
    add_to_trace(at.time);
    write_row(0, s, at.shown.data());
    write_frame(0, s, at.shown.data(), at.rate.data());
    if (!stop_) stop_ = find_event(s, 0);
    if (stop_) now_ = s;
    // In the time of the steps that lead from the curve to the first unknowns, changing loads do work at this shape;
    // the rest of the difference dissipates.
    const auto at_loads = [&](double t) {
        return loads_at(setup_.motion->law(), t).energy(now_.o.area, now_.o.volume, now_.period);
    };
    past_.work = at_loads(at.time) - at_loads(0);
    past_.dissipated = past_.total_start + past_.work - now_.total();
}

void CurveAttempt::resume(const Record& restart) {
    const CurveRestart state = curve_restart(restart);
    past_.total_start = state.total_start, past_.dissipated = state.dissipated, past_.work = state.work;
    error = state.error;
    least_symbol = state.least_symbol;
    mesh_need = state.mesh_need;
    summary.reference_energy = state.reference_energy;
    trace = pair_memory(restart).own;
    outputs_.go_on_from(restart.time);
    out_.go_on_from(restart.time);
    make_flow(state.y, state.rate, restart.time, 0);
    past_.least = now_.total() - past_.work;
    add_to_trace(restart.time);
}

void CurveAttempt::make_flow(const Eigen::VectorXd& y, const Eigen::VectorXd& rate, double time, double first_step) {
    FlowSystem system = setup_.system();
    system.dissipation = [this](double t, const double* at, const double* v) {
        return observe(t, at, v).balance.dissipation;
    };
    past_.rates = load_rates(setup_.motion->law(), time);
    system.work = [this](double t, const double* at, const double* v) {
        const Snapshot& s = observe(t, at, v);
        return past_.rates.energy(s.o.area, s.o.volume, s.period);
    };
    system.guards = [this](double t, const double* at, const double* v) {
        const Snapshot& s = observe(t, at, v);
        Guards values;
        for (const CurveGuard& guard : curve_guards()) values.push_back(guard.value(s, setup_.c.accuracy.r_min));
        return values;
    };
    system.n_guards = curve_guards().size();
    observed_at_ = std::numeric_limits<double>::quiet_NaN();
    flow_ = std::make_unique<BdfFlow>(std::move(system), y, rate, time, setup_.control(first_step));
    observe(time, flow_->x(), flow_->v());
    keep_good();
}

// From another state, or with loads that change at another rate.
void CurveAttempt::restart_flow(const Eigen::VectorXd& y, const Eigen::VectorXd& rate, double time) {
    past_.dissipated = dissipated(time), past_.work = work(time);
    past_.counters = counters();
    make_flow(y, rate, time, 0);
}

FlowCounters CurveAttempt::counters() const {
    FlowCounters out = past_.counters;
    return out += flow_->counters();
}

void CurveAttempt::add_to_trace(double t) {
    const MotionLaw& law = setup_.motion->law();
    const Loads loads = loads_at(law, t);
    const Eigen::VectorXd gradient = setup_.motion->forms().gradient(
                              {.energy = 1, .area = loads.tension, .volume = -loads.pressure},
                              setup_.curve(flow_->x())),
                          moves = setup_.curve(flow_->v());
    const double lengthens = law.free_period ? setup_.space->images() * moves[setup_.motion->layout().rise] : 0;
    trace.add(
        t, now_.free_energy,
        gradient.dot(moves) - loads.force * lengthens + past_.rates.energy(now_.o.area, now_.o.volume, now_.period));
}

// Bound of the change of the energy until the end, from the present dissipation, kinetic energy and acceleration.
double CurveAttempt::what_may_change(double t) const {
    const double left = setup_.c.time.end - t;
    return std::max({now_.balance.dissipation * left, now_.balance.kinetic, now_.balance.acceleration * left * left});
}

void CurveAttempt::look_at_mesh() {
    std::vector<double> lost;
    setup_.motion->forms().observe(setup_.curve(flow_->x()), &lost);
    mesh_need.add(setup_.space->splines(), lost);
}

std::optional<StopReport> CurveAttempt::check(double t) {
    const std::optional<double> stationary = setup_.c.time.stationary;
    if (auto pause = clock_.find_pause(t)) return pause;
    const bool loads_rest = next_kink(setup_.motion->law(), t) == HUGE_VAL;
    if (stationary && loads_rest && past_.settling.is_settled(setup_.c, t, now_.balance.dissipation, now_.o.area) &&
        what_may_change(t) < *stationary * summary.reference_energy)
        return StopReport{Stop::stationary, t, "the energy no longer changes by more than time.stationary allows", ""};
    if (flow_->counters().steps % steps_between_looks != 0) return std::nullopt;
    look_at_mesh();
    return find_bad_profile(*setup_.space, setup_.curve(flow_->x()), now_, t);
}

std::optional<StopReport> CurveAttempt::step() {
    const double end = setup_.c.time.end, kink = next_kink(setup_.motion->law(), flow_->time());
    Flow::Outcome outcome = flow_->advance(std::min(kink, end));
    const double t = flow_->time();
    const bool at_kink = outcome == Flow::Outcome::end && t < end;
    if (at_kink) outcome = Flow::Outcome::step;
    if (auto stall = stall_.after_step(t, flow_->step_size(), end)) return stall;
    if (outcome == Flow::Outcome::failed && may_be_undefined(now_.o.domain))
        return undefined_energy(now_.o.domain, t, fmt::format("s = {:.4g}", now_.o.domain.place));
    if (outcome == Flow::Outcome::failed)
        return StopReport{Stop::solver_failed, t, "the time integrator gave up: " + flow_->failure(),
                          "try another accuracy, discretisation.elements or parametrisation"};
    if (outcome == Flow::Outcome::guard) observed_at_ = std::numeric_limits<double>::quiet_NaN();
    const Snapshot s = observe(t, flow_->x(), flow_->v());
    if (auto rise = find_rise(s)) return rise;
    least_symbol = std::min(least_symbol, s.o.symbol);
    add_to_trace(t);
    compare(t, s);
    write_outputs(t);
    write_row(t, s, flow_->x());
    out_.progress(t, s.o.energy, flow_->step_size());
    if (outcome == Flow::Outcome::guard) return curve_guards()[flow_->tripped()].report(s, t);
    if (outcome == Flow::Outcome::end) return StopReport{Stop::finished, t, "reached time.end", ""};
    keep_good();
    if (at_kink) restart_flow(Eigen::VectorXd(past_.y), Eigen::VectorXd(past_.rate), t);
    out_.safeguard([this] { return record(); });
    return check(t);
}

// Of the difference of a pair: the smaller the more steps the tolerance has limited, as steps that only grow are alike
// in both. Where the finer run has had fewer limited steps than the coarser one, what both had in common while their
// steps grew may be most of their errors: an instability that it has set going amplifies it.
double CurveAttempt::share(double t) const {
    const int own = trace.limited_steps(step_growth_of(setup_.settings), t),
              other = coarser_->trace.limited_steps(step_growth_of(coarser(setup_.settings)), t);
    if (other >= few_steps && own < alike * other) return share_if_alike;
    const double growing = start_steps * beginnings(setup_.motion->law(), t);
    return std::clamp(growing / std::max(trace.size(), 1), least_share, 1.0);
}

// The error is a share of the difference from the coarser run, or a part of the energy that is unaccounted for, as the
// runs of a pair may have errors of their steps in common. That part is often too large: it alone never asks for a
// finer run.
void CurveAttempt::compare(double t, const Snapshot& s) {
    if (!coarser_) return;
    const bool given = settings_given(setup_.c);
    const double asked = setup_.c.accuracy.energy * summary.reference_energy,
                 unbalanced = t > 0 ? error_per_defect * std::abs(defect(t, s)) : 0;
    const double least = given ? unbalanced : std::clamp(unbalanced, least_error * asked, asked);
    const std::optional<double> difference = coarser_->trace.difference(t, s.free_energy);
    error_now_ = std::max(difference ? share(t) * *difference : error_now_, least);
    error = std::max(error, error_now_);
}

// No law of motion lets the total energy, less the work of loads that change, rise: what it rises by is an error. Where
// that is larger than the errors asked for and known, or the shape is none of a membrane, the run goes back to the last
// good step.
std::optional<StopReport> CurveAttempt::find_rise(const Snapshot& s) {
    const bool asked = out_.reported() && !settings_given(setup_.c);
    const double bound = s.total() - work(flow_->time()), rise = bound - past_.least,
                 hopeless = hopeless_rise * summary.reference_energy,
                 wanted = setup_.c.accuracy.energy * summary.reference_energy,
                 allowed = asked ? std::max(wanted, std::min(error, hopeless)) : hopeless;
    if (!is_admissible(s) || !(rise <= allowed)) {
        restart_flow(Eigen::VectorXd(past_.y), Eigen::VectorXd(past_.rate), past_.time);
        return StopReport{
            Stop::resolution_lost, past_.time,
            fmt::format("the next step raises the energy by {:.2g} of E_ref, but this flow can only lose energy",
                        rise / summary.reference_energy),
            "ask for more accuracy; check that the energy resists bending where H = H0"};
    }
    error = std::max(error, rise);
    past_.least = std::min(past_.least, bound);
    return std::nullopt;
}

void CurveAttempt::keep_good() {
    const int n = setup_.motion->layout().size;
    past_.y = Eigen::Map<const Eigen::VectorXd>(flow_->x(), n);
    past_.rate = Eigen::Map<const Eigen::VectorXd>(flow_->v(), n);
    past_.time = flow_->time();
}

// IDA sees only guards that change their sign later.
std::optional<StopReport> CurveAttempt::check_start() {
    const double t = flow_->time();
    if (outputs_.done()) return StopReport{Stop::finished, t, "reached time.end", ""};
    auto event = find_event(now_, t);
    if (event) write_row(t, now_, flow_->x());
    return event;
}

std::optional<StopReport> CurveAttempt::find_event(const Snapshot& s, double t) const {
    for (const CurveGuard& guard : curve_guards())
        if (!(guard.value(s, setup_.c.accuracy.r_min) > 0)) return guard.report(s, t);
    return std::nullopt;
}

void CurveAttempt::go() {
    look_at_mesh();
    std::optional<StopReport> stop = stop_ ? stop_ : check_start();
    try {
        while (!stop) stop = step();
    } catch (const Paused& pause) {
        stop = pause_report(pause, flow_->time());
    }
    summary.stop = *stop;
    summary.energy = now_.o.energy;
    if (const std::string doubt = doubt_after(setup_.c, stop->reason, past_.total_start,
                                              now_.total() - work(flow_->time()), summary.reference_energy);
        !doubt.empty())
        summary.warnings.push_back(doubt);
    summary.counters = counters();
    out_.end(*stop, stop_ ? 0 : flow_->time(), [this] { return record(); });
    describe_effort(summary);
}

void CurveAttempt::write_outputs(double until) {
    while (outputs_.due(until)) {
        const double t = outputs_.pass();
        if (t == until) {
            write_row(t, now_, flow_->x());
            write_frame(t, now_, flow_->x(), flow_->v());
        } else if (out_.reported()) {
            Eigen::VectorXd y(setup_.motion->layout().size), rate(y.size());
            flow_->interpolate(t, y.data(), rate.data());
            const Snapshot between = measure(*setup_.motion, t, y.data(), rate.data());
            write_row(t, between, y.data());
            write_frame(t, between, y.data(), rate.data());
        }
    }
}

void CurveAttempt::write_row(double t, const Snapshot& s, const double* y) {
    if (!out_.wants_row(t)) return;
    out_.row(t, setup_.series.values({t, s, y, *setup_.motion, *flow_, defect(t, s), work(t), error_now_,
                                      summary.elements, out_.seconds()}));
}

void CurveAttempt::write_frame(double t, const Snapshot& s, const double* y, const double* rate) {
    out_.frame(t, [&] { return record(t, s, y, rate); });
}

Record CurveAttempt::record(double t, const Snapshot& s, const double* y, const double* rate) const {
    const int n = setup_.motion->layout().size;
    const CurveRestart state{setup_.space->splines().breaks(),
                             Eigen::Map<const Eigen::VectorXd>(y, n),
                             Eigen::Map<const Eigen::VectorXd>(rate, n),
                             setup_.settings,
                             past_.total_start,
                             dissipated(t),
                             error,
                             summary.reference_energy,
                             least_symbol,
                             work(t),
                             mesh_need};
    Record out = curve_record(t, *setup_.motion, state, s.o.energy);
    add_to_record(out, trace, coarser_);
    return out;
}

}  // namespace tubule::axisym
