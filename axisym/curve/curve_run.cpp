#include "axisym/curve/curve_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <set>
#include <span>

#include "axisym/curve/curve_frame.hpp"
#include "axisym/curve/curve_measures.hpp"
#include "axisym/curve/curve_motion.hpp"
#include "axisym/curve/curve_start.hpp"
#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/solve/sparse.hpp"

namespace tubule::axisym {
namespace {

// Measured choices: docs/decisions.md, "Curves in motion".
constexpr int first_elements = 12;  // of one cell
constexpr double finer_mesh = 1.5;  // elements of a pair of runs
constexpr double finer_time = 0.1;  // tolerances of a pair of runs
// Of the first run; the waves of a fluid, weakly damped, cost steps.
constexpr double tolerance_per_accuracy = 0.5, tolerance_of_waves = 3;
constexpr int most_pairs = 8, most_elements = 2000;
// Elements at a seam, where the curvature jumps: no more than this part of those elsewhere, and, for the energy that a
// smooth spline loses there, no more than so much of the asked accuracy; of the length of the profile.
constexpr double seam_size = 0.15, seam_per_accuracy = 5;
constexpr double steepest = 3;      // curvature times length of an element: beyond that nothing is resolved
constexpr double stretched = 1e-3;  // least over largest |X_s|
constexpr int steps_between_looks = 10;
constexpr double newton_error = 2e-9;  // of the iteration, relative to the curve: area and volume are kept to that
constexpr int most_crawling = 2000;    // steps by which the time has not grown by a thousandth
// 1 - (INT H)^2/(A INT H^2): below these, area and volume are (nearly) the same condition; see CurveLaw.
constexpr double same_everywhere = 1e-12, nearly_same = 1e-3;

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

CurveLaw law_of(const Case& c) {
    CurveLaw law = motion_law(c.model);
    law.lagrangian = law.inextensible && c.discretisation.parametrisation != Parametrisation::even;
    law.swirls = c.velocity.rotates;
    return law;
}

// 1 - (INT H dS)^2/(A INT H^2 dS): zero where H is the same everywhere.
double variation_of_H(const CurveSpace& space, const Eigen::VectorXd& x) {
    const auto squares = [&](double H0) {
        Bending bending{{}, H0};
        bending.k[term_number("k20")] = 1;
        return CurveForms(space, bending).observe(x);
    };
    const CurveObservation o = squares(0);
    const double sum = (o.energy + o.area - squares(1).energy) / 2;
    return 1 - sum * sum / (o.area * o.energy);
}

// The energy along a run, for another to be compared with.
class Trace {
public:
    void add(double t, double energy, double slope) { points_.push_back({t, energy, slope}); }
    double end() const { return points_.back()[0]; }
    // Cubic between the steps.
    double operator()(double t) const {
        const auto after =
            std::lower_bound(points_.begin(), points_.end(), t, [](const auto& p, double x) { return p[0] < x; });
        if (after == points_.begin()) return (*after)[1];
        if (after == points_.end()) return points_.back()[1];
        const auto &a = *(after - 1), &b = *after;
        const double h = b[0] - a[0], x = (t - a[0]) / h;
        return a[1] + x * x * (3 - 2 * x) * (b[1] - a[1]) + h * x * (1 - x) * ((1 - x) * a[2] - x * b[2]);
    }

private:
    std::vector<std::array<double, 3>> points_;
};

// How strongly the parameter is kept even: in the scale of the rows that it is added to (curve_motion.hpp).
double gauge_of(const Case& c, double energy, double area) {
    const MotionLaw law = motion_law(c.model);
    if (law.inertia != 0) return std::sqrt(energy * area);
    return law.viscosity != 0 ? energy * c.model.Re : energy;
}

std::vector<int> tracked_modes(const Case& c) {
    std::set<int> waves;
    if (const Tube* tube = std::get_if<Tube>(&c.shape))
        for (const TubeMode& mode : tube->modes)
            if (mode.n > 0) waves.insert(mode.n);
    return {waves.begin(), waves.end()};
}

// What a run begins with.
struct Beginning {
    Meridian meridian;
    double area = 0, volume = 0;
};

Beginning beginning_of(const Case& c) {
    Meridian whole = start_meridian(c);
    if (c.discretisation.symmetry && (whole.topology == Topology::cell || whole.topology == Topology::tube)) {
        try {
            whole = half(whole);
        } catch (const std::invalid_argument&) {  // it does not mirror itself
        }
    }
    const auto [area, volume] = area_and_volume(whole);
    return {std::move(whole), area, volume};
}

// What a run is computed with.
struct Settings {
    int elements = first_elements;
    double tolerance = 1e-4;
};

// `excess` is how many times more than asked the two runs before differed; 1 to begin with. The error of the mesh falls
// at least with the sixth power of its width, unless the shape is not smooth.
Settings finer(const Settings& s, double excess) {
    const double mesh = std::clamp(finer_mesh * std::pow(excess, 1.0 / 6), finer_mesh, 2.5);
    return {static_cast<int>(std::ceil(mesh * s.elements)), std::max(finer_time * s.tolerance, 1e-13)};
}

struct CurveState {
    double time = 0;
    Eigen::VectorXd y, rate;
};

class CurveAttempt {
public:
    // Nothing is written unless `recorded`.
    CurveAttempt(const Case& c, RunObserver& watch, bool recorded, const Beginning& start, const Settings& settings,
                 const Trace* coarser, std::chrono::steady_clock::time_point started);

    void begin();
    void resume(const CurveRestart& restart, double time);
    StopReport go();

    RunSummary summary;
    Trace trace;
    double error = 0;  // largest difference of the energy from the coarser run's, absolute

private:
    struct Look {
        CurveObservation o;
        CurveMotion::Balance balance;
        Neck neck;
    };
    Look look(const double* y, const double* rate) const;
    const Look& observe(double t, const double* y, const double* rate);
    void make_flow(const CurveState& state, double first_step);
    // Each is positive while all is well; what to report of the present state once it is not.
    struct Guard {
        double (*value)(const CurveAttempt& run, const Look& l);
        StopReport (*report)(const CurveAttempt& run);
    };
    static std::span<const Guard> guards();
    Guards guard_values(const Look& l) const;
    std::optional<StopReport> step();
    std::optional<StopReport> check(double t);
    double what_may_change(double t) const;
    bool is_stuck(double t);
    void write_outputs(double until);
    void write_row(double t, const Look& l, const double* y, double dissipated);
    void write_frame(double t, const Look& l, const double* y, const double* rate, double dissipated);
    double dissipated(double t) const { return dissipated_before_ + flow_->dissipated(t); }

    const Case& case_;
    RunObserver& watch_;
    bool recorded_;
    const Beginning& start_;
    Settings settings_;
    const Trace* coarser_;
    std::chrono::steady_clock::time_point started_;
    std::unique_ptr<CurveSpace> space_;
    std::unique_ptr<CurveMotion> motion_;
    std::unique_ptr<Flow> flow_;
    std::vector<double> outputs_;
    std::vector<int> modes_;
    std::size_t next_output_ = 0;
    double total_start_ = 0, dissipated_before_ = 0, error_now_ = 0;
    FlowCounters counters_before_;
    double observed_at_ = std::numeric_limits<double>::quiet_NaN();
    Look now_;
    double last_row_ = -1, last_frame_ = -1;
    double crawl_begun_ = 0;
    int crawl_steps_ = 0;
    std::vector<double> row_;
};

CurveAttempt::CurveAttempt(const Case& c, RunObserver& watch, bool recorded, const Beginning& start,
                           const Settings& settings, const Trace* coarser,
                           std::chrono::steady_clock::time_point started)
    : case_(c),
      watch_(watch),
      recorded_(recorded),
      start_(start),
      settings_(settings),
      coarser_(coarser),
      started_(started) {
    const ArcLength arc(start.meridian);
    const double size = 1.0 / settings.elements;
    const std::vector<double> seams = arc.seams();
    const double shrunk = std::pow(first_elements * size, 2);  // faster than the rest, of lower order
    const double at_seam = std::min(seam_size * size, seam_per_accuracy * c.accuracy.energy * shrunk);
    const int degree = c.discretisation.order;
    space_ = std::make_unique<CurveSpace>(
        start.meridian.topology, seams.empty() ? equal_breaks(settings.elements) : graded_breaks(seams, size, at_seam),
        degree, c.discretisation.smoothness.value_or(degree - 1), start.meridian.length);
    const CurveForms forms(*space_, c.energy);
    const Eigen::VectorXd x = fit(*space_, arc);
    summary.reference_energy = forms.reference_energy(x);
    summary.elements = space_->splines().elements() * space_->images();
    summary.time_tolerance = settings.tolerance;
    CurveLaw law = law_of(c);
    const double variation = variation_of_H(*space_, x);
    law.holds_area = variation > same_everywhere && (variation > nearly_same || !law.keeps_volume);
    if (law.inextensible && variation <= same_everywhere) law.keeps_volume = false;
    motion_ = std::make_unique<CurveMotion>(*space_, c.energy, law, gauge_of(c, summary.reference_energy, start.area),
                                            start.area, start.volume);
    outputs_ = c.time.output;
    outputs_.push_back(c.time.end);
    std::sort(outputs_.begin(), outputs_.end());
    outputs_.erase(std::unique(outputs_.begin(), outputs_.end()), outputs_.end());
    outputs_.erase(outputs_.begin(), std::upper_bound(outputs_.begin(), outputs_.end(), 0.0));
    modes_ = tracked_modes(c);
}

// The narrowest place that is no pole: a minimum of r between two higher places, over the ends of elements and their
// middles. Radius infinity where there is none.
Neck narrowest(const CurveSpace& space, const double* y) {
    const std::vector<double>& breaks = space.splines().breaks();
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(y, space.size());
    std::vector<double> r, z;
    for (std::size_t i = 0; i < 2 * breaks.size() - 1; ++i) {
        const double s = i % 2 ? (breaks[i / 2] + breaks[i / 2 + 1]) / 2 : breaks[i / 2];
        const CurvePoint p = space.evaluate(x, s);
        r.push_back(p.r), z.push_back(p.z);
    }
    const int n = static_cast<int>(r.size());
    const bool closed = space.closed();
    Neck neck{0, std::numeric_limits<double>::infinity()};
    for (int i = closed ? 1 : 0; i < n; ++i) {
        if (space.topology() == Topology::cell && i == n - 1) continue;
        const double before = i > 0 ? r[i - 1] : r[1], after = i + 1 < n ? r[i + 1] : r[n - 2];
        if (r[i] <= before && r[i] <= after && r[i] < neck.radius) neck = {z[i], r[i]};
    }
    return neck;
}

CurveAttempt::Look CurveAttempt::look(const double* y, const double* rate) const {
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(y, space_->size());
    Look l{motion_->forms().observe(x), motion_->balance(y, rate), narrowest(*space_, y)};
    l.o.r_max = measures(*space_, x).r_max;
    return l;
}

const CurveAttempt::Look& CurveAttempt::observe(double t, const double* y, const double* rate) {
    if (t != observed_at_) {
        now_ = look(y, rate);
        observed_at_ = t;
    }
    return now_;
}

void CurveAttempt::begin() {
    const MotionLayout& at = motion_->layout();
    Eigen::VectorXd y = Eigen::VectorXd::Zero(at.size);
    y.head(space_->size()) = fit(*space_, ArcLength(start_.meridian));
    if (at.swirl >= 0) y.segment(at.swirl, space_->r().size()) = case_.velocity.omega * y.head(space_->r().size());
    const Eigen::VectorXd start = y;
    std::optional<CurveMotion::Start> consistent;
    // As short as the linear algebra bears, for a start that is not smooth may be far from where it was soon.
    double h = 1e-10 * std::min(case_.time.end, 1.0);
    for (int tries = 0; !consistent; ++tries) try {
            consistent = motion_->consistent(y, h);
        } catch (const SolveError&) {
            if (tries == 4) throw;
            h *= 10;
        }
    make_flow({0, consistent->y, consistent->rate}, h);
    Eigen::VectorXd shown = consistent->y;
    shown.head(space_->size()) = start.head(space_->size());
    const Look l = look(shown.data(), consistent->rate.data());
    total_start_ = l.o.energy + l.balance.kinetic;
    trace.add(0, l.o.energy, 0);
    write_row(0, l, shown.data(), 0);
    write_frame(0, l, shown.data(), consistent->rate.data(), 0);
}

void CurveAttempt::resume(const CurveRestart& restart, double time) {
    total_start_ = restart.total_start, dissipated_before_ = restart.dissipated, error = restart.error;
    summary.reference_energy = restart.reference_energy;
    next_output_ = std::upper_bound(outputs_.begin(), outputs_.end(), time) - outputs_.begin();
    last_row_ = last_frame_ = time;
    make_flow({time, restart.y, restart.rate}, 0);
    trace.add(time, now_.o.energy, 0);
}

void CurveAttempt::make_flow(const CurveState& state, double first_step) {
    const CurveMotion& motion = *motion_;
    const MotionLayout& at = motion.layout();
    FlowSystem system;
    system.residual = [&motion](const double* y, const double* v, double* F) { return motion.residual(y, v, F); };
    system.jacobian = [&motion](const double* y, const double* v, double cj, double* J) {
        motion.jacobian(y, v, cj, J);
    };
    system.pattern = &motion.pattern();
    system.differential = motion.differential();
    // Velocities without inertia, pressures and numbers follow from the curve; their own errors do not count. Over
    // a very short step rounding alone moves them more than the curve: they have no say in when the iteration ends
    // either.
    const double length = std::sqrt(start_.area);
    system.scale = Eigen::VectorXd::Constant(at.size, 1e12 * length / settings_.tolerance);
    system.scale.head(space_->size()).setConstant(length);
    if (motion.law().inertia != 0)
        for (int i = space_->size(); i < at.p; ++i) system.scale[i] = std::sqrt(summary.reference_energy / start_.area);
    system.dissipation = [this](double t, const double* y, const double* v) {
        return observe(t, y, v).balance.dissipation;
    };
    system.guards = [this](double t, const double* y, const double* v) { return guard_values(observe(t, y, v)); };
    system.n_guards = guards().size();
    TimeControl control;
    control.relative = settings_.tolerance;
    control.absolute = 0.1 * settings_.tolerance;
    control.max_order = case_.discretisation.time_order;
    control.first_step = first_step;
    control.newton = std::clamp(newton_error / settings_.tolerance, 1e-5, 0.01);
    control.two_iterations = true;
    if (flow_) dissipated_before_ += flow_->dissipated(flow_->time()), counters_before_ += flow_->counters();
    observed_at_ = std::numeric_limits<double>::quiet_NaN();
    flow_ = std::make_unique<Flow>(std::move(system), state.y, state.rate, state.time, control);
    observe(state.time, flow_->x(), flow_->v());
}

std::span<const CurveAttempt::Guard> CurveAttempt::guards() {
    using Run = const CurveAttempt&;
    static const Guard list[]{
        {[](Run run, const Look& l) {
             return std::isfinite(l.neck.radius) ? l.neck.radius - run.case_.accuracy.r_min : 1;
         },
         [](Run run) {
             const auto& neck = run.now_.neck;
             return StopReport{Stop::pinch_off, run.flow_->time(),
                               fmt::format("the neck radius fell to {:.6g} at z = {:.6g}", neck.radius, neck.z),
                               "lower accuracy.r_min to follow the neck further"};
         }},
        {[](Run, const Look& l) { return l.o.symbol; },
         [](Run run) {
             return StopReport{Stop::ill_posed, run.flow_->time(),
                               fmt::format("the principal symbol f_HH + 2 f_HK x + f_KK x^2 reached zero at s = {:.4g}",
                                           run.now_.o.s_symbol),
                               "no resolution helps: the energy does not resist short waves there"};
         }},
        {[](Run, const Look& l) { return l.o.g_min / l.o.g_max - stretched; },
         [](Run run) {
             return StopReport{Stop::mesh_lost, run.flow_->time(),
                               fmt::format("the parametrisation speed varies by a factor {:.3g} along the profile",
                                           run.now_.o.g_max / run.now_.o.g_min),
                               "set discretisation.parametrisation = \"even\""};
         }}};
    return list;
}

Guards CurveAttempt::guard_values(const Look& l) const {
    Guards values;
    for (const Guard& guard : guards()) values.push_back(guard.value(*this, l));
    return values;
}

// By how much the energy could change until the end, by what dissipates, moves and is accelerated now.
double CurveAttempt::what_may_change(double t) const {
    const double left = case_.time.end - t;
    return std::max({now_.balance.dissipation * left, now_.balance.kinetic, now_.balance.acceleration * left * left});
}

std::optional<StopReport> CurveAttempt::check(double t) {
    const Look& l = now_;
    if (seconds_since(started_) > case_.time.limit.value_or(std::numeric_limits<double>::infinity()))
        return StopReport{Stop::time_limit, t, fmt::format("used the {} s of time.limit", *case_.time.limit),
                          "go on with --resume"};
    if (watch_.interrupted()) return StopReport{Stop::interrupted, t, "interrupted by a signal", "go on with --resume"};
    if (case_.time.stationary && what_may_change(t) < *case_.time.stationary * summary.reference_energy)
        return StopReport{Stop::stationary, t, "the energy changes no more, as asked by time.stationary", ""};
    if (flow_->counters().steps % steps_between_looks != 0) return std::nullopt;
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(flow_->x(), space_->size());
    if (const auto crossing = self_intersection(*space_, x)) {
        const CurvePoint p = space_->evaluate(x, (*crossing)[0]);
        return StopReport{Stop::self_intersection, t,
                          fmt::format("the profile meets itself or the axis at r = {:.4g}, z = {:.4g}", p.r, p.z),
                          "contact is not modelled: later results are invalid"};
    }
    const std::vector<double>& breaks = space_->splines().breaks();
    const int e = space_->splines().element_at(l.o.s_curvature);
    const double turn = l.o.curvature * l.o.g_max * (breaks[e + 1] - breaks[e]);
    if (turn > steepest)
        return StopReport{Stop::resolution_lost, t,
                          fmt::format("an element turns by {:.2g} radians near s = {:.4g}", turn, l.o.s_curvature),
                          "ask for more accuracy, or set discretisation.elements"};
    return std::nullopt;
}

// Steps that lead nowhere: IDA may go on with them for ever.
bool CurveAttempt::is_stuck(double t) {
    if (t > 1.001 * crawl_begun_) crawl_begun_ = t, crawl_steps_ = 0;
    return ++crawl_steps_ > most_crawling && flow_->step_size() < 1e-9 * case_.time.end;
}

std::optional<StopReport> CurveAttempt::step() {
    const Flow::Outcome outcome = flow_->advance(case_.time.end);
    const double t = flow_->time();
    if (is_stuck(t))
        return StopReport{Stop::solver_failed, t,
                          fmt::format("the time integrator is stuck with steps of {:.2g}", flow_->step_size()),
                          "try another accuracy, discretisation.elements or parametrisation"};
    if (outcome == Flow::Outcome::failed)
        return StopReport{Stop::solver_failed, t, "the time integrator gave up: " + flow_->failure(),
                          "try another accuracy, discretisation.elements or parametrisation"};
    if (outcome == Flow::Outcome::guard) observed_at_ = std::numeric_limits<double>::quiet_NaN();
    const Look l = observe(t, flow_->x(), flow_->v());
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(flow_->x(), space_->size());
    trace.add(
        t, l.o.energy,
        motion_->forms().gradient({.energy = 1}, x).dot(Eigen::Map<const Eigen::VectorXd>(flow_->v(), space_->size())));
    if (coarser_ && t <= coarser_->end()) error = std::max(error, error_now_ = std::abs(l.o.energy - (*coarser_)(t)));
    write_outputs(t);
    if (last_row_ < t) write_row(t, l, flow_->x(), dissipated(t));
    if (recorded_) watch_.progress(t, l.o.energy, flow_->step_size());
    if (outcome == Flow::Outcome::guard) return guards()[flow_->tripped()].report(*this);
    if (outcome == Flow::Outcome::end) return StopReport{Stop::finished, t, "reached time.end", ""};
    return check(t);
}

StopReport CurveAttempt::go() {
    std::optional<StopReport> stop;
    for (const Guard& guard : guards())  // IDA sees only those that change their sign later
        if (!stop && !(guard.value(*this, now_) > 0)) stop = guard.report(*this);
    while (!stop) stop = step();
    const double t = flow_->time();
    summary.stop = *stop;
    summary.energy = now_.o.energy;
    summary.counters = counters_before_;
    summary.counters += flow_->counters();
    write_frame(t, now_, flow_->x(), flow_->v(), dissipated(t));
    return *stop;
}

void CurveAttempt::write_outputs(double until) {
    for (; next_output_ < outputs_.size() && outputs_[next_output_] <= until; ++next_output_) {
        const double t = outputs_[next_output_];
        if (t == until) {
            write_row(t, now_, flow_->x(), dissipated(t));
            write_frame(t, now_, flow_->x(), flow_->v(), dissipated(t));
            continue;
        }
        if (!recorded_) continue;
        Eigen::VectorXd y(motion_->layout().size), rate(y.size());
        flow_->interpolate(t, y.data(), rate.data());
        const Look between = look(y.data(), rate.data());
        write_row(t, between, y.data(), dissipated(t));
        write_frame(t, between, y.data(), rate.data(), dissipated(t));
    }
}

// Amplitude of the wave of number n in r(z), also where that has several values.
double mode_amplitude(const CurveSpace& space, const double* y, int n) {
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(y, space.size());
    const ProfileSpace& splines = space.splines();
    double re = 0, im = 0;
    for (int e = 0; e < splines.elements(); ++e)
        for (int g = 0; g < splines.groups(); ++g)
            for (int q = 0; q < ProfileSpace::lanes; ++q) {
                const auto& basis = splines.basis(e, g);
                const CurvePoint p = space.evaluate(x, basis.z[q]);
                const double angle = 2 * pi * n * p.z / space.length(), part = basis.weight[q] * p.r * p.z1;
                re += part * std::cos(angle), im += part * std::sin(angle);
            }
    const bool whole = space.images() == 1;
    return 2 / space.length() * (whole ? std::hypot(re, im) : 2 * std::abs(re));
}

void CurveAttempt::write_row(double t, const Look& l, const double* y, double dissipated) {
    last_row_ = t;
    if (!recorded_) return;
    row_.clear();
    const auto put = [&](double value) { row_.push_back(value); };
    const FlowCounters counters = flow_->counters();
    const MotionLayout& at = motion_->layout();
    put(t);
    put(flow_->step_size());
    put(flow_->order());
    put(static_cast<double>(counters.newton_iterations + counters_before_.newton_iterations));
    put(l.o.energy);
    for (double term : l.o.energy_term) put(term);
    put(l.balance.dissipation);
    put(l.o.energy + l.balance.kinetic - total_start_ + dissipated);
    put(l.o.area);
    put(l.o.volume);
    put(std::isfinite(l.neck.radius) ? l.neck.radius : 0);
    put(l.o.r_max);
    for (const int n : modes_) put(mode_amplitude(*space_, y, n));
    if (motion_->law().inextensible)
        for (const double value : {l.balance.kinetic, l.balance.speed, l.balance.momentum_z, l.balance.angular_z,
                                   at.lambda < 0 ? 0 : y[at.lambda]})
            put(value);
    put(error_now_);
    put(summary.elements);
    put(seconds_since(started_));
    watch_.row(row_);
}

void CurveAttempt::write_frame(double t, const Look& l, const double* y, const double* rate, double dissipated) {
    if (!recorded_ || t == last_frame_) return;
    last_frame_ = t;
    const int n = motion_->layout().size;
    const CurveRestart state{space_->splines().breaks(),
                             Eigen::Map<const Eigen::VectorXd>(y, n),
                             Eigen::Map<const Eigen::VectorXd>(rate, n),
                             settings_.elements,
                             settings_.tolerance,
                             total_start_,
                             dissipated,
                             error,
                             summary.reference_energy};
    watch_.frame([&] { return curve_record(t, *motion_, state, l.o.energy); });
}

// The settings of the run that those of a case, or of a restart, are compared with.
Settings coarser(const Settings& s) {
    return {std::max(2, static_cast<int>(std::floor(s.elements / finer_mesh))), s.tolerance / finer_time};
}

// The finer run of the first pair: as given by the case, else by the asked accuracy.
Settings first_settings(const Case& c, const Beginning& start) {
    const int images =
        start.meridian.topology == Topology::half_cell || start.meridian.topology == Topology::half_tube ? 2 : 1;
    const bool waves = motion_law(c.model).inertia != 0;
    Settings s = finer({first_elements, (waves ? tolerance_of_waves : tolerance_per_accuracy) * c.accuracy.energy}, 1);
    if (c.discretisation.elements) s.elements = (*c.discretisation.elements + images - 1) / images;
    if (c.discretisation.time_tolerance) s.tolerance = *c.discretisation.time_tolerance;
    return s;
}

}  // namespace

std::vector<std::string> curve_series_names(const Case& c) {
    std::vector<std::string> names{"time", "step_size", "order", "newton_iterations", "energy"};
    for_each_bending_term([&](std::size_t, const auto& term) { names.push_back(std::string("energy_") + term.name); });
    for (const char* name : {"dissipation", "identity_defect", "area", "volume", "r_min", "r_max"})
        names.push_back(name);
    for (const int n : tracked_modes(c)) names.push_back(fmt::format("mode_{}", n));
    if (motion_law(c.model).inextensible)
        for (const char* name : {"kinetic_energy", "speed", "momentum_z", "angular_momentum_z", "lambda"})
            names.push_back(name);
    for (const char* name : {"energy_error", "elements", "wall_seconds"}) names.push_back(name);
    return names;
}

namespace {

void describe(RunSummary& s, const Case& c, double error, int pairs) {
    s.attempts = pairs;
    s.estimated_error = error / s.reference_energy;
    s.as_accurate_as_asked = s.estimated_error <= c.accuracy.energy;
    describe_effort(s);
}

// A run that is less accurate than asked although nothing is left to refine.
void accept(RunSummary& s, const Case& c) {
    if (s.as_accurate_as_asked || s.stop.reason == Stop::interrupted || s.stop.reason == Stop::time_limit) return;
    s.warnings.push_back(fmt::format("the energy is off by {:.2g} of E_ref (estimated), {:.2g} was asked for",
                                     s.estimated_error, c.accuracy.energy));
    const bool chosen = c.discretisation.elements || c.discretisation.time_tolerance;
    if (!chosen && s.stop.reason == Stop::finished) {
        s.stop.reason = Stop::resolution_lost;
        s.stop.message = s.warnings.back();
        s.stop.advice = "ask for less accuracy";
        s.warnings.pop_back();
    }
}

// Whether two runs of a pair tell the same story as far as they can be compared.
bool comparable(const StopReport& coarse, const StopReport& fine) {
    return coarse.reason == fine.reason || fine.reason == Stop::interrupted || fine.reason == Stop::time_limit;
}

}  // namespace

RunSummary run_curve(const Case& c, RunObserver& observer, const Record* restart) {
    const auto started = std::chrono::steady_clock::now();
    const Beginning start = beginning_of(c);
    Settings settings = first_settings(c, start);
    std::optional<CurveRestart> state;
    if (restart) {
        state = curve_restart(*restart);
        settings = {state->elements, state->tolerance};
    }
    const auto run_one = [&](bool recorded, const Settings& with, const Trace* coarser) {
        auto attempt = std::make_unique<CurveAttempt>(c, observer, recorded, start, with, coarser, started);
        if (recorded && state)
            attempt->resume(*state, restart->time);
        else
            attempt->begin();
        attempt->go();
        return attempt;
    };
    auto coarse = run_one(false, coarser(settings), nullptr);
    for (int pair = 1;; ++pair) {
        if (Stop early = coarse->summary.stop.reason; early == Stop::interrupted || early == Stop::time_limit) {
            describe(coarse->summary, c, coarse->summary.reference_energy, pair);  // nothing is known of the error yet
            return coarse->summary;
        }
        auto fine = run_one(true, settings, &coarse->trace);
        const bool coarser_mesh = coarse->summary.elements < fine->summary.elements;
        const bool known = coarser_mesh && comparable(coarse->summary.stop, fine->summary.stop);
        describe(fine->summary, c, known ? fine->error : fine->summary.reference_energy, pair);
        const bool agrees = fine->summary.as_accurate_as_asked;
        const bool given = c.discretisation.elements || c.discretisation.time_tolerance;
        const Stop reason = fine->summary.stop.reason;
        if (agrees || given || pair == most_pairs || settings.elements > most_elements || reason == Stop::interrupted ||
            reason == Stop::time_limit) {
            if (!coarser_mesh)
                fine->summary.warnings.push_back(
                    "so few elements leave no coarser run to compare with: the error is not known");
            else if (!known)
                fine->summary.warnings.push_back(
                    fmt::format("the coarser run of the pair ended at t = {:.6g} with {}: the error is not known",
                                coarse->summary.stop.time, name(coarse->summary.stop.reason)));
            accept(fine->summary, c);
            return fine->summary;
        }
        settings = finer(settings, fine->summary.estimated_error / c.accuracy.energy);
        observer.discard();
        state.reset();
        coarse = std::move(fine);
    }
}

}  // namespace tubule::axisym
