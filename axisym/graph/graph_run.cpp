#include "axisym/graph/graph_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <set>
#include <span>

#include "axisym/graph/graph_derivatives.hpp"
#include "axisym/graph/graph_error_transport.hpp"
#include "axisym/graph/graph_frame.hpp"
#include "axisym/graph/graph_start.hpp"
#include "common/solve/sparse.hpp"

namespace tubule::axisym {
namespace {

// Measured choices: docs/decisions.md, "Ask for accuracy".
constexpr double stated_over_computed = 1.8;      // error stated / error computed by the transport
constexpr double tolerance_per_accuracy = 0.35;   // time tolerance / asked accuracy
constexpr double defect_per_accuracy = 1.0 / 12;  // defect at which to remesh / (asked accuracy * E_ref)
constexpr double remesh_margin = 1.0 / 10;        // defect after a remesh / defect before
constexpr double start_margin = 1.0 / 4;          // defect of the start / defect at which to remesh
constexpr int error_steps = 8;                    // the error is carried on after so many steps, or when
constexpr double error_change = 0.25;             // the logarithm of the dissipation changed so much
constexpr int most_attempts = 6;
constexpr int most_elements = 4000;  // of one cell
constexpr int fewest_elements = 3;
constexpr double overhang_steepness = 30;  // see Observation::steepness
constexpr double hopeless_error = 0.1;     // of E_ref: explicit settings that lose the shape
constexpr double symbol_lost = 1e-3;       // of that at the start; on the way to 0 the solution loses its smoothness

// What a run is computed with. The asked accuracy sets it, a failed attempt tightens it.
struct Settings {
    double time_tolerance = 0;
    double defect = 0;  // remesh when the defect exceeds this
    bool free_time = true, free_mesh = true;
};

ProfileSpace space_of(const Cell& cell, std::vector<double> breaks, const Case& c) {
    const int order = c.discretisation.order;
    return ProfileSpace(cell, std::move(breaks), order, c.discretisation.smoothness.value_or(order - 1));
}

// Everything that belongs to one mesh.
struct Stage {
    ProfileSpace space;
    Forms forms;
    ErrorTransport transport;
    Stage(const Cell& cell, std::vector<double> breaks, const Case& c)
        : space(space_of(cell, std::move(breaks), c)), forms(space, c.energy), transport(forms) {}
};

std::vector<int> tracked_modes(const Case& c) {
    std::set<int> waves;
    for (const TubeMode& mode : std::get<Tube>(c.shape).modes)
        if (mode.n > 0) waves.insert(mode.n);
    return {waves.begin(), waves.end()};
}

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

class Attempt {
public:
    Attempt(const Case& c, RunObserver& out, const Settings& settings, std::chrono::steady_clock::time_point started,
            bool may_give_up)
        : case_(c),
          out_(out),
          settings_(settings),
          started_(started),
          may_give_up_(may_give_up),
          modes_(tracked_modes(c)) {
        outputs_ = c.time.output;
        outputs_.push_back(c.time.end);
        std::sort(outputs_.begin(), outputs_.end());
        outputs_.erase(std::unique(outputs_.begin(), outputs_.end()), outputs_.end());
        outputs_.erase(outputs_.begin(), std::upper_bound(outputs_.begin(), outputs_.end(), 0.0));
    }

    void begin();
    void resume(const Record& restart);
    // Until the end or a stop; nothing if the asked accuracy was exceeded and `settings` can be tightened.
    std::optional<StopReport> go();

    RunSummary summary;
    // The computed error of the energy when go() gave nothing.
    ErrorTransport::EnergyError excess;

private:
    std::vector<double> first_breaks(const Cell& cell, const std::function<double(double)>& start);
    const Observation& observe(double t, const double* x, const double* v);
    Observation look(const double* x, const double* v);
    void make_flow(const Eigen::VectorXd& x, const Eigen::VectorXd& v, double t, double first_step);
    void use_stage(std::unique_ptr<Stage> stage);
    std::optional<StopReport> remesh(double target);
    double first_step_after(const Eigen::VectorXd& x) const;
    std::optional<StopReport> recover();
    std::optional<StopReport> step();
    StopReport give_up(const std::string& what);
    std::string suspects() const;
    StopReport end_with(const StopReport& stop);
    bool estimate_error(const Observation& o);
    std::optional<StopReport> check(Flow::Outcome outcome, const Observation& o);
    // Each is positive while all is well; what to report once it is not.
    struct Guard {
        double (*value)(const Attempt& run, const Observation& o);
        StopReport (*report)(const Attempt& run, const Observation& o);
    };
    static std::span<const Guard> guards();
    Guards guard_values(const Observation& o) const;
    StopReport overhang(const Observation& o) const;
    void write_outputs(double until, const Observation& o);
    void write_row(double t, const Observation& o, const double* x, double dissipated);
    void write_frame(double t, const Observation& o, const double* x, const double* v, double dissipated);
    Record record(double t, const Observation& o, const double* x, const double* v, double dissipated) const;
    double place(double z) const;  // in [0, length)

    const Case& case_;
    RunObserver& out_;
    Settings settings_;
    std::chrono::steady_clock::time_point started_;
    bool may_give_up_, gave_up_ = false;  // if too inaccurate, for another attempt
    std::vector<int> modes_;
    std::vector<std::array<Eigen::VectorXd, 2>> mode_functionals_;
    std::vector<double> outputs_;
    std::size_t next_output_ = 0;

    std::unique_ptr<Stage> stage_;
    std::unique_ptr<Flow> flow_;
    Observation now_;
    double observed_at_ = std::numeric_limits<double>::quiet_NaN();
    std::vector<double> defect_;
    double energy_start_ = 0, dissipated_before_ = 0;  // before this flow began
    FlowCounters counters_before_;
    // Error of the energy: latest and largest, and when it was computed last.
    double error_now_ = 0, error_max_ = 0, dissipation_last_ = 0;
    int steps_since_error_ = 0, failures_ = 0;
    Eigen::VectorXd good_x_;
    double good_t_ = 0;
    double margin_ = remesh_margin;
    std::optional<double> least_symbol_;  // of a flow that is well-posed
    double last_row_ = -1, last_frame_ = -1;
    std::vector<double> row_;
};

double Attempt::place(double z) const {
    const double length = stage_->space.cell().period();
    return z - std::floor(z / length) * length;
}

Observation Attempt::look(const double* x, const double* v) {
    const ProfileSpace& space = stage_->space;
    Observation o = stage_->forms.observe(x, v, &defect_);
    for (auto [z, r] : {std::pair{&o.z_min, &o.r_min}, std::pair{&o.z_max, &o.r_max}}) {
        *z = space.extremum_near(x, *z);
        *r = space.evaluate(x, space.element_at(*z), *z)[0];
    }
    return o;
}

const Observation& Attempt::observe(double t, const double* x, const double* v) {
    if (t != observed_at_) {
        now_ = look(x, v);
        observed_at_ = t;
    }
    return now_;
}

void Attempt::use_stage(std::unique_ptr<Stage> stage) {
    stage_ = std::move(stage);
    mode_functionals_.clear();
    for (int n : modes_) mode_functionals_.push_back(stage_->forms.mode(n));
    summary.elements = stage_->space.elements() * stage_->space.cell().images();
}

void Attempt::make_flow(const Eigen::VectorXd& x, const Eigen::VectorXd& v, double t, double first_step) {
    if (flow_) {
        dissipated_before_ += flow_->dissipated(flow_->time());
        counters_before_ += flow_->counters();
    }
    TimeControl control;
    control.relative = settings_.time_tolerance;
    control.absolute =
        1e-3 * settings_.time_tolerance * std::min(std::get<Tube>(case_.shape).radius, 1e3 * case_.accuracy.r_min);
    control.max_order = case_.discretisation.time_order;
    control.first_step = first_step;
    observed_at_ = std::numeric_limits<double>::quiet_NaN();
    const Forms& forms = stage_->forms;
    FlowSystem system;
    system.residual = [&forms](const double* at, const double* rate, double* F) { return forms.residual(at, rate, F); };
    system.jacobian = [&forms](const double* at, const double* rate, double cj, double* values) {
        forms.jacobian(at, rate, cj, values);
    };
    system.pattern = &forms.pattern();
    system.banded = stage_->space.cell().mirror;
    system.dissipation = [this](double when, const double* at, const double* rate) {
        return observe(when, at, rate).dissipation;
    };
    system.guards = [this](double when, const double* at, const double* rate) {
        return guard_values(observe(when, at, rate));
    };
    system.n_guards = guards().size();
    flow_ = std::make_unique<Flow>(std::move(system), x, v, t, control);
    stage_->transport.begin(flow_->x(), flow_->v());
    dissipation_last_ = observe(t, flow_->x(), flow_->v()).dissipation;
    const auto negative = [](double k) { return k < 0; };
    if (!least_symbol_)  // a symbol that cannot change its sign may come as close to 0 as it likes
        least_symbol_ = std::ranges::any_of(case_.energy.k, negative) ? symbol_lost * now_.symbol : 0;
    steps_since_error_ = 0;
    good_x_ = x;
    good_t_ = t;
}

// Breaks that will do for the start and, as far as that can be foreseen, for what the flow makes of it. Sets
// E_ref, and with it the defect that is tolerated.
std::vector<double> Attempt::first_breaks(const Cell& cell, const std::function<double(double)>& start) {
    const Discretisation& d = case_.discretisation;
    int most_waves = 0;
    for (const TubeMode& mode : std::get<Tube>(case_.shape).modes) most_waves = std::max(most_waves, mode.n);
    const int first = d.elements ? std::max(2, (*d.elements + cell.images() - 1) / cell.images())
                                 : std::max(fewest_elements, 8 * most_waves / cell.images());
    const double share = settings_.defect;
    auto breaks = uniform_breaks(cell, first);
    for (int pass = 0;; ++pass) {
        const ProfileSpace space = space_of(cell, breaks, case_);
        const Forms forms(space, case_.energy);
        const Eigen::VectorXd x = space.project(start);
        summary.reference_energy = forms.reference_energy(x);
        settings_.defect = share * summary.reference_energy;
        if (!settings_.free_mesh || pass == 8 || space.elements() >= most_elements) return breaks;
        defect_ = foreseen_defect(forms, x, case_.time.end);
        const double lost = std::accumulate(defect_.begin(), defect_.end(), 0.0);
        if (lost < settings_.defect * start_margin) return breaks;
        breaks = adapted_breaks(space, defect_, settings_.defect * start_margin / 2, fewest_elements);
    }
}

void Attempt::begin() {
    const Tube& tube = std::get<Tube>(case_.shape);
    const Cell cell = cell_of(tube, case_.discretisation.symmetry);
    const auto start = [&](double z) { return radius_at(tube, z); };
    auto breaks = first_breaks(cell, start);
    use_stage(std::make_unique<Stage>(cell, std::move(breaks), case_));
    const Eigen::VectorXd x = stage_->space.project(start);
    ErrorTransport& transport = stage_->transport;
    transport.total = transport.spatial =
        transport.space().project(start) - transport.space().prolong(stage_->space, x);
    make_flow(x, stage_->forms.rate(x), 0, 0);
    energy_start_ = now_.energy;
    write_row(0, now_, flow_->x(), 0);
    write_frame(0, now_, flow_->x(), flow_->v(), 0);
}

void Attempt::resume(const Record& restart) {
    const RestartState state = restart_state(restart);
    use_stage(std::make_unique<Stage>(state.cell, state.breaks, case_));
    stage_->transport.total = state.error_total;
    stage_->transport.spatial = state.error_spatial;
    summary.reference_energy = state.reference_energy;
    settings_.time_tolerance = state.time_tolerance;
    settings_.defect = state.defect;
    energy_start_ = state.energy_start;
    dissipated_before_ = state.dissipated;
    error_max_ = state.error_max;
    least_symbol_ = state.least_symbol;
    next_output_ = std::upper_bound(outputs_.begin(), outputs_.end(), restart.time) - outputs_.begin();
    last_row_ = last_frame_ = restart.time;
    make_flow(state.coefficients, stage_->forms.rate(state.coefficients), restart.time, 0);
}

void Attempt::write_row(double t, const Observation& o, const double* x, double dissipated) {
    row_.clear();
    const auto put = [&](double value) { row_.push_back(value); };
    const FlowCounters counters = flow_->counters();
    put(t);
    put(flow_->step_size());
    put(flow_->order());
    put(static_cast<double>(counters.newton_iterations + counters_before_.newton_iterations));
    put(o.energy);
    for (double term : o.energy_term) put(term);
    put(o.dissipation);
    put(o.energy - energy_start_ + dissipated);
    put(o.area);
    put(o.volume);
    put(o.r_min);
    put(o.r_max);
    const Eigen::Map<const Eigen::VectorXd> c(x, stage_->space.size());
    for (const auto& f : mode_functionals_) put(std::hypot(f[0].dot(c), f[1].dot(c)));
    put(stated_over_computed * error_now_);
    put(summary.elements);
    put(seconds_since(started_));
    out_.row(row_);
    last_row_ = t;
}

Record Attempt::record(double t, const Observation& o, const double* x, const double* v, double dissipated) const {
    RestartState state;
    state.cell = stage_->space.cell();
    state.breaks = stage_->space.breaks();
    state.coefficients = Eigen::Map<const Eigen::VectorXd>(x, stage_->space.size());
    state.error_total = stage_->transport.total;
    state.error_spatial = stage_->transport.spatial;
    state.reference_energy = summary.reference_energy;
    state.time_tolerance = settings_.time_tolerance;
    state.defect = settings_.defect;
    state.energy_start = energy_start_;
    state.dissipated = dissipated;
    state.error_max = error_max_;
    state.least_symbol = least_symbol_.value_or(0);
    return frame_record(t, stage_->space, state, Eigen::Map<const Eigen::VectorXd>(v, stage_->space.size()), o.energy);
}

void Attempt::write_frame(double t, const Observation& o, const double* x, const double* v, double dissipated) {
    if (t == last_frame_) return;
    out_.frame([&] { return record(t, o, x, v, dissipated); });
    last_frame_ = t;
}

// Frames and rows at the output times up to the end of the last step.
void Attempt::write_outputs(double until, const Observation& o) {
    for (; next_output_ < outputs_.size() && outputs_[next_output_] <= until; ++next_output_) {
        const double t = outputs_[next_output_];
        if (t == until) {
            const double dissipated = dissipated_before_ + flow_->dissipated(until);
            write_row(t, o, flow_->x(), dissipated);
            write_frame(t, o, flow_->x(), flow_->v(), dissipated);
        } else {
            Eigen::VectorXd x(stage_->space.size()), v(stage_->space.size());
            flow_->interpolate(t, x.data(), v.data());
            const std::vector<double> defect = defect_;  // belongs to the end of the step
            const Observation between = look(x.data(), v.data());
            defect_ = defect;
            const double dissipated = dissipated_before_ + flow_->dissipated(t);
            write_row(t, between, x.data(), dissipated);
            write_frame(t, between, x.data(), v.data(), dissipated);
        }
    }
}

// True, and the attempt is given up, if the error is beyond what was asked and something can be done about it.
bool Attempt::estimate_error(const Observation& o) {
    if (steps_since_error_ > 0) stage_->transport.advance();
    excess = stage_->transport.energy_error(o.energy);
    dissipation_last_ = o.dissipation;
    steps_since_error_ = 0;
    error_now_ = std::abs(excess.total);
    error_max_ = std::max(error_max_, error_now_);
    const double allowed = case_.accuracy.energy * summary.reference_energy / stated_over_computed;
    if (error_now_ <= allowed || !may_give_up_) return false;
    const double of_time = std::abs(excess.total - excess.spatial);
    gave_up_ = (settings_.free_mesh && std::abs(excess.spatial) > 0.4 * allowed) ||
               (settings_.free_time && of_time > 0.4 * allowed);
    return gave_up_;
}

std::span<const Attempt::Guard> Attempt::guards() {
    using Run = const Attempt&;
    using State = const Observation&;
    static const Guard list[]{
        {[](Run run, State o) { return o.r_min - run.case_.accuracy.r_min; },
         [](Run run, State o) {
             return StopReport{Stop::pinch_off, run.flow_->time(),
                               fmt::format("the neck radius fell to {:.6g} at z = {:.6g}", o.r_min, run.place(o.z_min)),
                               "lower accuracy.r_min to follow the neck further"};
         }},
        {[](Run, State o) { return overhang_steepness - o.steepness; },
         [](Run run, State o) { return run.overhang(o); }},
        {[](Run run, State o) { return o.symbol - run.least_symbol_.value_or(0); },
         [](Run run, State o) {
             return StopReport{
                 Stop::ill_posed, run.flow_->time(),
                 fmt::format("the flow lost its well-posedness at z = {:.6g}: f_HH + 2 f_HK x + f_KK x^2 fell to "
                             "{:.3g} at x = kappa_theta",
                             run.place(o.z_symbol), o.symbol),
                 "no refinement helps; k40 or k42 is too negative for the curvatures of this shape"};
         }}};
    return list;
}

Guards Attempt::guard_values(const Observation& o) const {
    Guards values;
    for (const Guard& guard : guards()) values.push_back(guard.value(*this, o));
    return values;
}

StopReport Attempt::overhang(const Observation& o) const {
    const double steepness =
        std::abs(stage_->space.evaluate(flow_->x(), stage_->space.element_at(o.z_steep), o.z_steep)[1]);
    return {Stop::overhang, flow_->time(),
            fmt::format("the profile r(z) turned vertical at z = {:.6g} (|r'| = {:.3g} away from a neck)",
                        place(o.z_steep), steepness),
            "the shape is about to overhang, which a graph r(z) cannot follow; the results until here are valid"};
}

std::optional<StopReport> Attempt::check(Flow::Outcome outcome, const Observation& o) {
    const double t = flow_->time();
    if (outcome == Flow::Outcome::guard) return guards()[flow_->tripped()].report(*this, o);
    if (outcome == Flow::Outcome::end) return StopReport{Stop::finished, t, "reached time.end", ""};
    if (case_.time.stationary &&
        o.dissipation * (case_.time.end - t) < *case_.time.stationary * summary.reference_energy)
        return StopReport{Stop::stationary, t, fmt::format("the energy dissipates at {:.3g} only", o.dissipation), ""};
    if (case_.time.limit && seconds_since(started_) > *case_.time.limit)
        return StopReport{Stop::time_limit, t, fmt::format("time.limit = {} s is used up", *case_.time.limit),
                          "go on with --resume"};
    if (out_.interrupted()) return StopReport{Stop::interrupted, t, "interrupted by a signal", "go on with --resume"};
    const double hopeless = hopeless_error * summary.reference_energy;
    if (error_now_ > hopeless) {
        const bool asked = !settings_.free_mesh || !settings_.free_time;
        return StopReport{
            Stop::resolution_lost, t,
            fmt::format("the error of the energy reached {:.2g} of E_ref{}", error_now_ / summary.reference_energy,
                        asked ? " with the discretisation asked for" : ""),
            asked ? "leave discretisation.elements and discretisation.time_tolerance to the program, or refine them"
                  : "ask for more accuracy: errors of this start are amplified on the way"};
    }
    if (o.symbol_3d <= 0 && summary.warnings.empty())
        summary.warnings.push_back(
            fmt::format("from t = {:.6g} on, the flow of the full surface is ill-posed in directions that axisymmetric "
                        "motion does not excite",
                        t));
    return std::nullopt;
}

std::optional<StopReport> Attempt::remesh(double target) {
    const double t = flow_->time();
    const Observation o = now_;
    auto breaks = refined_breaks(stage_->space, defect_, target);
    if (static_cast<int>(breaks.size()) > most_elements + 1) {
        if (o.steepness > overhang_steepness / 4) return overhang(o);
        return StopReport{Stop::resolution_lost, t,
                          fmt::format("the profile needs more than {} elements per cell near z = {:.6g}", most_elements,
                                      place(o.z_steep)),
                          "ask for less accuracy"};
    }
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(flow_->x(), stage_->space.size());
    auto next = std::make_unique<Stage>(stage_->space.cell(), std::move(breaks), case_);
    const Eigen::VectorXd projected = next->space.prolong(stage_->space, x);
    next->transport.inherit(stage_->transport, x, projected);
    const double dt = first_step_after(x);
    const Eigen::VectorXd rate =
        next->space.prolong(stage_->space, Eigen::Map<const Eigen::VectorXd>(flow_->v(), stage_->space.size()));
    use_stage(std::move(next));
    // The profile is the same, but on the new mesh its knots want to move, little and fast. Linearly implicit Euler
    // damps that, where the integrator would chase it with steps of next to nothing.
    const Forms& forms = stage_->forms;
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(projected.size());
    Eigen::SparseMatrix<double> matrix = forms.pattern();
    SparseLu lu;
    Eigen::VectorXd damped = projected, slope;
    for (int k = 0; k < 3; ++k) {
        forms.jacobian(damped.data(), rest.data(), 1 / dt, matrix.valuePtr());
        lu.factor(matrix);
        slope = -lu.solve(forms.gradient(damped)) / dt;
        damped += dt * slope;
    }
    make_flow(damped, slope, t + 3 * dt, dt);
    dissipated_before_ += 3 * dt * o.dissipation;
    stage_->transport.begin(projected.data(), rate.data());
    stage_->transport.add_step(3 * dt, damped.data(), slope.data());
    steps_since_error_ = 1;
    ++summary.meshes;
    return std::nullopt;
}

// Such that backward Euler, with which the integration begins again, has the asked local error from x on, and does
// not pass an output.
double Attempt::first_step_after(const Eigen::VectorXd& x) const {
    const Eigen::VectorXd acceleration = flow_->acceleration();
    double norm = 0;
    for (int i = 0; i < x.size(); ++i)
        norm += std::pow(acceleration[i] / (settings_.time_tolerance * std::abs(x[i])), 2);
    const double step = std::min(0.3 * std::sqrt(2 / std::sqrt(norm / x.size())), flow_->step_size());
    // Not beyond the next output, and not so small that the time would not notice.
    return std::max(std::min(step, 0.3 * (outputs_[next_output_] - flow_->time())), 1e-12 * flow_->time());
}

// Names the terms whose derivatives are wrong at the last good state, if any.
std::string Attempt::suspects() const {
    std::string keys;
    for (const TermCheck& term : check_terms(stage_->forms, good_x_))
        if (!term.check.pass()) keys += (keys.empty() ? "" : ", ") + term.key;
    return keys.empty() ? "the derivatives of all terms are right" : "wrong derivatives: " + keys;
}

StopReport Attempt::give_up(const std::string& what) {
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(good_x_.size());
    const Observation o = look(good_x_.data(), rest.data());
    if (o.steepness > overhang_steepness / 4) return overhang(o);
    return {Stop::solver_failed, good_t_, fmt::format("{} ({})", what, suspects()),
            "ask for more accuracy, or lower discretisation.time_order"};
}

std::optional<StopReport> Attempt::recover() {
    const std::string said = flow_->failure();
    if (++failures_ > 3) return give_up("the time integrator gave up: " + said);
    make_flow(good_x_, stage_->forms.rate(good_x_), good_t_, 0);
    return std::nullopt;
}

std::optional<StopReport> Attempt::go() {
    // A start beyond a limit stops at once: the integrator only sees limits being crossed.
    for (const Guard& guard : guards())
        if (guard.value(*this, now_) <= 0) return end_with(guard.report(*this, now_));

    std::optional<StopReport> stop;
    try {
        while (!stop && !gave_up_) stop = step();
    } catch (const SolveError& error) {
        stop = give_up(error.what());
    }
    if (gave_up_) return std::nullopt;
    return end_with(*stop);
}

// One step of the integrator, and all that is due after it.
std::optional<StopReport> Attempt::step() {
    const double before = flow_->time();
    const Flow::Outcome outcome = flow_->advance(case_.time.end);
    if (outcome == Flow::Outcome::failed) return recover();
    const double t = flow_->time();
    if (outcome == Flow::Outcome::guard) observed_at_ = std::numeric_limits<double>::quiet_NaN();
    const Observation o = observe(t, flow_->x(), flow_->v());
    stage_->transport.add_step(t - before, flow_->x(), flow_->v());
    const double change = std::abs(std::log(o.dissipation / dissipation_last_));
    if (++steps_since_error_ >= error_steps || !(change < error_change) || outcome != Flow::Outcome::step)
        if (estimate_error(o)) return std::nullopt;
    write_outputs(t, o);
    if (last_row_ < t) write_row(t, o, flow_->x(), dissipated_before_ + flow_->dissipated(t));
    out_.progress(t, o.energy, flow_->step_size());
    good_x_ = Eigen::Map<const Eigen::VectorXd>(flow_->x(), stage_->space.size());
    good_t_ = t;
    failures_ = 0;
    if (const auto stop = check(outcome, o)) return stop;
    const bool output_is_near = outputs_[next_output_] - t < 1e-9 * t;
    if (settings_.free_mesh && !output_is_near &&
        std::accumulate(defect_.begin(), defect_.end(), 0.0) > settings_.defect) {
        if (estimate_error(o)) return std::nullopt;
        // A shape that keeps sharpening gets more room each time: every remesh restarts the integrator.
        const bool soon = flow_->counters().steps < 50;
        margin_ = soon && summary.meshes > 1 ? std::max(margin_ / 8, 1e-3) : remesh_margin;
        return remesh(settings_.defect * margin_);
    }
    return std::nullopt;
}

// Saves the state of a run that ended before its time, and sums up.
StopReport Attempt::end_with(const StopReport& stop) {
    const double t = flow_->time(), dissipated = dissipated_before_ + flow_->dissipated(t);
    if (stop.reason == Stop::time_limit || stop.reason == Stop::interrupted)
        out_.checkpoint(record(t, now_, flow_->x(), flow_->v(), dissipated));
    else
        write_frame(t, now_, flow_->x(), flow_->v(), dissipated);
    summary.stop = stop;
    summary.energy = now_.energy;
    summary.estimated_error = stated_over_computed * error_max_ / summary.reference_energy;
    summary.time_tolerance = settings_.time_tolerance;
    summary.counters = counters_before_;
    summary.counters += flow_->counters();
    return stop;
}

}  // namespace

std::vector<std::string> graph_series_names(const Case& c) {
    std::vector<std::string> names{"time", "step_size", "order", "newton_iterations", "energy"};
    for_each_bending_term([&](std::size_t, const auto& term) { names.push_back(std::string("energy_") + term.name); });
    for (const char* n : {"dissipation", "identity_defect", "area", "volume", "r_min", "r_max"}) names.push_back(n);
    for (int n : tracked_modes(c)) names.push_back(fmt::format("mode_{}", n));
    for (const char* n : {"energy_error", "elements", "wall_seconds"}) names.push_back(n);
    return names;
}

// A run that reached its end, but not with the accuracy asked for.
void accuracy_missed(const Case& c, RunSummary& summary) {
    const std::string message = fmt::format("the energy is off by {:.2g} of E_ref (estimated), {:.2g} was asked for",
                                            summary.estimated_error, c.accuracy.energy);
    if (c.discretisation.elements || c.discretisation.time_tolerance) {
        summary.warnings.push_back(message + ": discretisation.elements or time_tolerance are explicit");
        return;
    }
    summary.stop.reason = Stop::resolution_lost;
    summary.stop.message = message;
    summary.stop.advice = "ask for less accuracy: this start amplifies errors beyond what rounding allows";
}

// After a run that was not accurate enough: what to compute with instead.
// The error was caught when it passed what is
// allowed, not at its largest: the more often that happened, the bolder the next try.
Settings tightened(Settings s, const ErrorTransport::EnergyError& error, double allowed, int attempt) {
    const double boldness = attempt == 1 ? 1 : 0.3;
    const auto shrink = [&](double goal, double part) {
        return std::clamp(boldness * goal * allowed / part, 0.01, 0.6);
    };
    const double of_time = std::abs(error.total - error.spatial), of_space = std::abs(error.spatial);
    if (s.free_time && of_time > 0.3 * allowed)
        s.time_tolerance = std::max(s.time_tolerance * shrink(0.35, of_time), 1e-14);
    if (s.free_mesh && of_space > 0.3 * allowed) s.defect *= shrink(0.15, of_space);
    return s;
}

RunSummary run_graph(const Case& c, RunObserver& observer, const Record* restart) {
    const auto started = std::chrono::steady_clock::now();
    const double asked = c.accuracy.energy;
    Settings settings;
    settings.time_tolerance = c.discretisation.time_tolerance.value_or(std::max(tolerance_per_accuracy * asked, 1e-13));
    settings.defect = defect_per_accuracy * asked;
    settings.free_time = !c.discretisation.time_tolerance;
    settings.free_mesh = !c.discretisation.elements;
    for (int count = 1;; ++count) {
        Attempt attempt(c, observer, settings, started, count < most_attempts);
        if (restart && count == 1)
            attempt.resume(*restart);
        else
            attempt.begin();
        if (attempt.go()) {
            RunSummary& summary = attempt.summary;
            summary.attempts = count;
            summary.as_accurate_as_asked = summary.estimated_error <= asked;
            if (!summary.as_accurate_as_asked && summary.stop.reason == Stop::finished) accuracy_missed(c, summary);
            describe_effort(summary);
            return summary;
        }
        settings =
            tightened(settings, attempt.excess, asked * attempt.summary.reference_energy / stated_over_computed, count);
        observer.discard();
    }
}

}  // namespace tubule::axisym
