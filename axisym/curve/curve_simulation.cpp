#include "axisym/curve/curve_simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "axisym/curve/coarser_curve.hpp"
#include "common/run/stall.hpp"
#include "common/run/stops.hpp"
#include "common/solve/sparse.hpp"

namespace tubule::axisym {
namespace {

constexpr int steps_between_looks = 10;
// Measured choices: docs/decisions/curves.md, "How large is the error of a curve in motion?".
constexpr double error_per_imbalance = 0.5;  // of the energy balance
constexpr double least_error = 0.02;         // of what is asked for: no estimate is trusted below
const char* const too_far =
    "fixed area and volume allow only some distances of the beads: free one of them, end the extension earlier, or try "
    "another accuracy.energy";
const char* const too_far_for_area =
    "a fixed area allows only some distances of the bead from the ring: free the area, end the extension earlier, or "
    "try another accuracy.energy";
const char* const another_resolution =
    "try another accuracy.energy, discretisation.elements or discretisation.parametrisation";
constexpr int most_stalled = 2000;  // steps, the last ones shorter than this part of the end
constexpr double tiny_step = 1e-9;
constexpr double hopeless_rise = 0.1;  // of E_ref: more is no error of a run that can be believed

}  // namespace

// A state at one time, with what has dissipated and what loads that change have done until then.
struct CurveSimulation::View : StateView {
    const CurveSimulation& run;
    double t, dissipated, work;
    Eigen::VectorXd y, rate;
    Snapshot s;

    View(const CurveSimulation& r, double time, double lost, double done, const Eigen::VectorXd& unknowns,
         const Eigen::VectorXd& rates, const Snapshot& measured)
        : run(r), t(time), dissipated(lost), work(done), y(unknowns), rate(rates), s(measured) {}

    std::vector<double> row(double wall_seconds) const override {
        const double imbalance = s.total() - run.past_.total_start + dissipated - work;
        return run.setup_.series.values({t, s, y.data(), *run.setup_.motion, *run.integrator_,
                                         run.counters().newton_iterations, imbalance, work, run.error_now_,
                                         run.summary.elements, wall_seconds});
    }

    CurveRestart state() const {
        return {run.setup_.space->splines().breaks(),
                y,
                rate,
                run.setup_.settings,
                run.past_.total_start,
                dissipated,
                run.error,
                run.summary.reference_energy,
                run.least_symbol,
                work,
                run.mesh_need,
                run.trace};
    }

    Record record() const override {
        Record out = curve_record(t, *run.setup_.motion, state(), s.o.energy);
        if (run.coarser_) run.coarser_->save(out);
        return out;
    }
};

CurveSimulation::~CurveSimulation() = default;

CurveSimulation::CurveSimulation(const Problem& c, const InitialShape& start, const CurveSettings& settings,
                                 CoarserCurve* coarser)
    : setup_(c, start, settings), coarser_(coarser) {
    summary.reference_energy = setup_.reference_energy;
    summary.elements = setup_.elements();
    summary.attempts = settings.pair;
}

const Snapshot& CurveSimulation::observe(double t, const double* y, const double* rate) {
    if (t != observed_at_) {
        now_ = measure(*setup_.motion, t, y, rate);
        observed_at_ = t;
    }
    return now_;
}

void CurveSimulation::begin() {
    InitialState at;
    try {
        at = initial_state(setup_);
    } catch (const SolveError& error) {
        at = state_without_velocity(setup_);
        initial_stop_ = StopReport{
            Stop::solver_failed, 0, error.what(),
            "use a tighter accuracy.energy, set discretisation.elements, or choose a smoother initial shape"};
    }
    make_integrator(at.y, at.rate, at.time, at.step);
    const Snapshot s = setup_.with_exact_shape(measure(*setup_.motion, 0, at.shown.data(), at.rate.data()));
    past_.total_start = s.total();
    past_.least = past_.total_start;
    compare(0, s);
    trace.add(0, s.free_energy, 0);
    add_to_trace(at.time);
    initial_ = std::make_unique<View>(*this, 0, 0, 0, at.shown, at.rate, s);
    if (!initial_stop_) initial_stop_ = find_guard(s, 0);
    if (initial_stop_) now_ = s;
    // In the time of the steps that lead from the curve to the first unknowns, changing loads and a reservoir do work
    // at this shape; the rest of the difference dissipates.
    const auto at_loads = [&](double t) {
        return loads_at(setup_.motion->law(), t).energy(now_.o.area, now_.o.volume, now_.length);
    };
    past_.work = at_loads(at.time) - at_loads(0) + at.time * power_supplied(now_);
    past_.dissipated = past_.total_start + past_.work - now_.total();
    look_at_mesh();
}

void CurveSimulation::resume(const Record& restart) {
    const CurveRestart state = curve_restart(restart);
    past_.total_start = state.total_start, past_.dissipated = state.dissipated, past_.work = state.work;
    error = state.error;
    least_symbol = state.least_symbol;
    mesh_need = state.mesh_need;
    summary.reference_energy = state.reference_energy;
    trace = state.trace;
    make_integrator(state.y, state.rate, restart.time, 0);
    past_.least = now_.total() - past_.work;
    add_to_trace(restart.time);
    look_at_mesh();
    at_kink_ = next_kink(setup_.motion->law(), std::nextafter(restart.time, -HUGE_VAL)) == restart.time;
}

Energetics CurveSimulation::energetics() const {
    const Snapshot& s = initial_ ? initial_->s : now_;
    return {.bending = s.o.energy,
            .free_energy = s.free_energy,
            .total = s.total() - work(integrator_->time()),
            .total_start = past_.total_start,
            .total_least = past_.least,
            .kinetic = s.balance.kinetic,
            .dissipation = s.balance.dissipation,
            .acceleration = s.balance.acceleration,
            .area = s.o.area};
}

Record CurveSimulation::restart_state() {
    return state_record(time(), view(time())->state());
}

std::unique_ptr<StateView> CurveSimulation::at(double t) {
    return view(t);
}

std::unique_ptr<CurveSimulation::View> CurveSimulation::view(double t) {
    if (initial_ && t == 0) return std::make_unique<View>(*initial_);
    const int n = setup_.motion->layout().size;
    if (t == integrator_->time())
        return std::make_unique<View>(*this, t, dissipated(t), work(t),
                                      Eigen::Map<const Eigen::VectorXd>(integrator_->x(), n),
                                      Eigen::Map<const Eigen::VectorXd>(integrator_->v(), n), now_);
    Eigen::VectorXd y(n), rate(n);
    integrator_->interpolate(t, y.data(), rate.data());
    return std::make_unique<View>(*this, t, dissipated(t), work(t), y, rate,
                                  measure(*setup_.motion, t, y.data(), rate.data()));
}

void CurveSimulation::make_integrator(const Eigen::VectorXd& y, const Eigen::VectorXd& rate, double time,
                                      double first_step) {
    ImplicitSystem system = setup_.system();
    system.dissipation = [this](double t, const double* at, const double* v) {
        return observe(t, at, v).balance.dissipation;
    };
    const MotionLaw& law = setup_.motion->law();
    past_.rates = load_rates(law, time);
    past_.extends = law.beads ? law.beads->rate(time) : 0;
    system.work = [this](double t, const double* at, const double* v) {
        const Snapshot& s = observe(t, at, v);
        return past_.rates.energy(s.o.area, s.o.volume, s.length) + power_supplied(s);
    };
    system.guards = [this](double t, const double* at, const double* v) {
        const Snapshot& s = observe(t, at, v);
        Guards values;
        for (const CurveGuard& guard : curve_guards()) values.push_back(guard.value(s, setup_.c.accuracy.r_min));
        return values;
    };
    system.n_guards = curve_guards().size();
    observed_at_ = std::numeric_limits<double>::quiet_NaN();
    integrator_ = make_ida(std::move(system), y, rate, time, setup_.control(first_step));
    observe(time, integrator_->x(), integrator_->v());
    keep_good();
}

// Whether area, volume and the distance of beads are held; of a patch the area alone limits the distance.
bool CurveSimulation::holds_all() const {
    const MotionLaw& law = setup_.motion->law();
    return law.beads && law.beads->extension && !law.area_is_free() && (law.keeps_volume || setup_.space->is_patch());
}

// By a reservoir, and by what holds the distance of beads.
double CurveSimulation::power_supplied(const Snapshot& s) const {
    return s.balance.supplied + s.balance.loads.force * past_.extends;
}

// From the last good state, with its loads.
void CurveSimulation::restart_integrator() {
    const Eigen::VectorXd y = past_.y, rate = past_.rate;
    const double time = past_.time;
    past_.dissipated = dissipated(time), past_.work = work(time);
    past_.counters = counters();
    const bool jumps = at_kink_ && setup_.motion->layout().reach >= 0;
    const InitialState at = jumps ? state_after(setup_, y, time) : InitialState{y, rate, time};
    past_.work += at.work;
    make_integrator(at.y, at.rate, at.time, at.step);
}

IntegratorCounters CurveSimulation::counters() const {
    IntegratorCounters out = past_.counters;
    return out += integrator_->counters();
}

void CurveSimulation::add_to_trace(double t) {
    const MotionLaw& law = setup_.motion->law();
    const Loads loads = loads_at(law, t);
    const CurveForms& forms = setup_.motion->forms();
    const Eigen::VectorXd gradient = forms.gradient({.energy = 1,
                                                     .area = loads.tension,
                                                     .volume = -loads.pressure_at(now_.o.volume),
                                                     .M = area_difference_force(forms.bending(), now_.o.M)},
                                                    setup_.curve(integrator_->x())),
                          moves = setup_.curve(integrator_->v());
    const double lengthens = setup_.motion->lengthening(integrator_->x(), integrator_->v());
    trace.add(
        t, now_.free_energy,
        gradient.dot(moves) - loads.force * lengthens + past_.rates.energy(now_.o.area, now_.o.volume, now_.length));
}

void CurveSimulation::look_at_mesh() {
    std::vector<double> lost;
    setup_.motion->forms().observe(setup_.curve(integrator_->x()), &lost);
    mesh_need.add(setup_.space->splines(), lost);
}

// At intervals, since it takes long; not at the end, which no longer needs a mesh.
std::optional<StopReport> CurveSimulation::find_event(bool) {
    const double t = integrator_->time();
    if (outcome_ == TimeIntegrator::Outcome::guard) return curve_guards()[integrator_->tripped()].report(now_, t);
    const bool due = at_kink_ || integrator_->counters().steps % steps_between_looks == 0;
    if (outcome_ == TimeIntegrator::Outcome::end || !due) return std::nullopt;
    look_at_mesh();
    return find_bad_profile(*setup_.space, setup_.curve(integrator_->x()), now_, t);
}

std::optional<StopReport> CurveSimulation::advance(double until) {
    initial_.reset();
    if (at_kink_) restart_integrator();
    outcome_ = integrator_->advance(std::min(next_kink(setup_.motion->law(), integrator_->time()), until));
    const double t = integrator_->time();
    at_kink_ = outcome_ == TimeIntegrator::Outcome::end && t < until;
    if (at_kink_) outcome_ = TimeIntegrator::Outcome::step;
    if (outcome_ == TimeIntegrator::Outcome::failed && may_be_undefined(now_.o.domain))
        return undefined_energy(now_.o.domain, t, fmt::format("s = {:.4g}", now_.o.domain.place));
    if (outcome_ == TimeIntegrator::Outcome::failed && may_be_undefined(now_.pressure_domain))
        return undefined_pressure(now_.pressure_domain, t);
    if (outcome_ == TimeIntegrator::Outcome::failed)
        return StopReport{Stop::solver_failed, t, "the time integrator gave up: " + integrator_->failure(),
                          holds_all() ? (setup_.space->is_patch() ? too_far_for_area : too_far) : another_resolution};
    if (outcome_ == TimeIntegrator::Outcome::guard) observed_at_ = std::numeric_limits<double>::quiet_NaN();
    return find_rise(observe(t, integrator_->x(), integrator_->v()));
}

std::optional<StopReport> CurveSimulation::update_error() {
    const double t = integrator_->time();
    least_symbol = std::min(least_symbol, now_.o.symbol);
    add_to_trace(t);
    if (coarser_) coarser_->lead_to(t);
    compare(t, now_);
    return std::nullopt;
}

StopReport CurveSimulation::failure(const SolveError& what) {
    return {Stop::solver_failed, integrator_->time(), what.what(), another_resolution};
}

void CurveSimulation::summarise() {
    counters().describe(summary, setup_.settings.tolerance);
}

// The error is a share of the difference from the coarser run, or a part of the energy that is unaccounted for, as the
// runs of a pair may have errors of their steps in common. That part is often too large: it alone never asks for a
// finer run.
void CurveSimulation::compare(double t, const Snapshot& s) {
    if (!coarser_) return;
    const bool given = setup_.c.profile_resolution_given();
    const double asked = setup_.c.accuracy.energy * summary.reference_energy,
                 unbalanced = t > 0 ? error_per_imbalance * std::abs(imbalance(t, s)) : 0;
    const double least = given ? unbalanced : std::clamp(unbalanced, least_error * asked, asked);
    error_now_ = std::max(coarser_->error_of(trace, setup_.settings, t, s.free_energy).value_or(error_now_), least);
    error = std::max(error, error_now_);
}

// No law of motion lets the total energy, less the work done, rise: a rise is an error. Where it
// exceeds the tolerance and the known error, or the shape is not that of a membrane, the run returns to the last good
// step.
std::optional<StopReport> CurveSimulation::find_rise(const Snapshot& s) {
    const bool asked = !setup_.settings.is_coarser && !setup_.c.profile_resolution_given();
    const double bound = s.total() - work(integrator_->time()), rise = bound - past_.least,
                 hopeless = hopeless_rise * summary.reference_energy,
                 wanted = setup_.c.accuracy.energy * summary.reference_energy,
                 allowed = asked ? std::max(wanted, std::min(error, hopeless)) : hopeless;
    if (!is_admissible(s) || !(rise <= allowed)) {
        restart_integrator();
        return energy_rises(rise / summary.reference_energy, past_.time);
    }
    error = std::max(error, rise);
    past_.least = std::min(past_.least, bound);
    return std::nullopt;
}

void CurveSimulation::keep_good() {
    const int n = setup_.motion->layout().size;
    past_.y = Eigen::Map<const Eigen::VectorXd>(integrator_->x(), n);
    past_.rate = Eigen::Map<const Eigen::VectorXd>(integrator_->v(), n);
    past_.time = integrator_->time();
}

// IDA sees only guards that change their sign later.
std::optional<StopReport> CurveSimulation::check_start() {
    return initial_stop_ ? initial_stop_ : find_guard(now_, integrator_->time());
}

std::optional<StopReport> CurveSimulation::find_guard(const Snapshot& s, double t) const {
    for (const CurveGuard& guard : curve_guards())
        if (!(guard.value(s, setup_.c.accuracy.r_min) > 0)) return guard.report(s, t);
    return std::nullopt;
}

Loop loop_of(CurveSimulation& run, const Problem& c, RunObserver& watch, const RunClock& clock) {
    Loop out(run, c, watch, clock, run.is_reported());
    out.add(std::make_unique<Stall>(
        most_stalled, tiny_step * c.time.end, c.accuracy.energy,
        "try another accuracy.energy, discretisation.elements or discretisation.parametrisation"));
    return out;
}

}  // namespace tubule::axisym
