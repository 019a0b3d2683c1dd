#include "axisym/graph/graph_simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "axisym/graph/graph_derivatives.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "common/run/energy_checks.hpp"
#include "common/run/stops.hpp"

namespace tubule::axisym {
namespace {

// Measured choices: docs/decisions/graphs.md, "Ask for accuracy".
constexpr double first_remesh_margin = 1.0 / 10;  // mesh loss after a remesh / that before
constexpr int few_steps = 10;                     // between two remeshes of a shape that keeps sharpening
constexpr int most_failures = 3;                  // of the integrator at one state
constexpr double path_error = 0.01;               // of states within a step, at most, relative to what was asked
constexpr double least_share = 0.01;              // of the tolerance of a step, that an error is at least
constexpr double hopeless_error = 0.1;            // of E_ref: explicit settings that lose the shape

}  // namespace

double GraphSimulation::Now::lost() const {
    return std::accumulate(mesh_loss.begin(), mesh_loss.end(), 0.0);
}

const Observation& GraphSimulation::observe(double t, const double* x, const double* v) {
    if (t != now_.time) {
        now_.o = mesh_->look(x, v, &now_.mesh_loss);
        now_.time = t;
    }
    return now_.o;
}

void GraphSimulation::use_mesh(std::unique_ptr<GraphMesh> mesh) {
    mesh_ = std::move(mesh);
    summary.elements = mesh_->space.elements() * mesh_->space.cell().images();
}

ImplicitSystem GraphSimulation::system() {
    const Forms& forms = mesh_->forms;
    ImplicitSystem system;
    system.residual = [&forms](double, const double* at, const double* rate, double* out) {
        return forms.residual(at, rate, out);
    };
    system.jacobian = [this, &forms](double, const double* at, const double* rate, double cj, double* values) {
        if (const double* known = cj == 0 ? mesh_->transport.stiffness_at(at) : nullptr)
            std::copy_n(known, forms.pattern().nonZeros(), values);
        else
            forms.jacobian(at, rate, cj, values);
    };
    system.pattern = &forms.pattern();
    system.banded = mesh_->space.cell().mirror;
    system.mass = [&forms](const double* at, double* values) { forms.mass(at, values); };
    system.dissipation = [this, &forms](double when, const double* at, const double* rate) {
        if (when != now_.time && is_rosenbrock()) return forms.observe(at, rate).dissipation;  // within a step
        return observe(when, at, rate).dissipation;
    };
    system.guards = [this](double when, const double* at, const double* rate) {
        const Observation& o = observe(when, at, rate);
        if (is_rosenbrock() && seen_.size() < path_points.size()) seen_.emplace_back(when, o);
        Guards values;
        for (const GraphGuard& guard : graph_guards()) values.push_back(guard.value(o, limits()));
        return values;
    };
    system.n_guards = graph_guards().size();
    return system;
}

void GraphSimulation::make_integrator(const Eigen::VectorXd& x, const Eigen::VectorXd& v, double t, double first_step) {
    if (integrator_) {
        past_.dissipated = dissipated(integrator_->time());
        past_.counters += integrator_->counters();
    }
    TimeControl control;
    control.relative = settings_.time_tolerance;
    control.absolute =
        1e-3 * settings_.time_tolerance * std::min(std::get<Tube>(case_.shape).radius, 1e3 * case_.accuracy.r_min);
    control.max_order = case_.time.max_order;
    control.first_step = first_step;
    now_.time = std::numeric_limits<double>::quiet_NaN();
    integrator_ = (is_rosenbrock() ? make_rosenbrock : make_ida)(system(), x, v, t, control);
    mesh_->transport.begin(integrator_->x(), integrator_->v());
    error_.begin(observe(t, integrator_->x(), integrator_->v()));
    dissipated_.begin(t, now_.o.dissipation);
    if (!least_symbol_) least_symbol_ = least_symbol_of(case_.energy, now_.o);
    good_.x = x;
    good_.time = t;
    good_.balance = now_.o.free_energy + dissipated(t);
}

GraphSimulation::GraphSimulation(const Problem& c, const RunClock& clock, const GraphSettings& settings)
    : case_(c), clock_(clock), series_(graph_series(c)), settings_(settings), remesh_margin_(first_remesh_margin) {
    const Tube& tube = std::get<Tube>(case_.shape);
    const Cell cell = cell_of(tube, case_.discretisation.symmetry);
    const auto shape = [&](double z) { return radius_at(tube, z); };
    use_mesh(std::make_unique<GraphMesh>(cell, initial_breaks(case_, settings_, cell, shape), case_));
    const Eigen::VectorXd x = mesh_->space.project(shape);
    const Forms& forms = mesh_->forms;
    summary.reference_energy = reference_energy(case_, forms.free_energy(x), forms.reference_energy(x));
    allowed_loss_ = settings_.mesh_loss * summary.reference_energy;
    ErrorTransport& transport = mesh_->transport;
    transport.total = transport.space().project(shape) - transport.space().prolong(mesh_->space, x);
    make_integrator(x, mesh_->forms.rate(x), 0, 0);
    error_.transport(mesh_->transport, now_.o);  // so far that of the first mesh
    past_.energy_start = now_.o.free_energy;
}

GraphSimulation::GraphSimulation(const Problem& c, const RunClock& clock, const GraphSettings& settings,
                                 const Record& restart)
    : case_(c), clock_(clock), series_(graph_series(c)), settings_(settings), remesh_margin_(first_remesh_margin) {
    const GraphRestart state = graph_restart(restart);
    use_mesh(std::make_unique<GraphMesh>(state.cell, state.breaks, case_));
    mesh_->transport.set(state.error_total, state.error_spatial);
    summary.reference_energy = state.reference_energy;
    settings_.time_tolerance = state.time_tolerance;
    allowed_loss_ = state.mesh_loss;
    past_.energy_start = state.energy_start;
    past_.dissipated = state.dissipated;
    error_.largest = state.error_max;
    least_symbol_ = state.least_symbol;
    make_integrator(state.coefficients, mesh_->forms.rate(state.coefficients), restart.time, 0);
}

Energetics GraphSimulation::energetics() const {
    const Observation& o = now_.o;
    return {.bending = o.energy,
            .free_energy = o.free_energy,
            .total = o.free_energy,
            .total_start = past_.energy_start,
            .total_least = good_.least_energy,
            .dissipation = o.dissipation,
            .area = o.area};
}

GraphLimits GraphSimulation::limits() const {
    return {case_.accuracy.r_min, least_symbol_.value_or(0)};
}

// Where the error exceeds the tolerance and finer settings would help, a finer run replaces this one, and the report is
// not shown.
std::optional<StopReport> GraphSimulation::find_curable_error() {
    const double allowed = case_.accuracy.energy * summary.reference_energy / stated_over_computed;
    gave_up = settings_.may_give_up && error_.is_curable(allowed, settings_.free_mesh, settings_.free_time);
    if (!gave_up) return std::nullopt;
    return StopReport{Stop::resolution_lost, integrator_->time(), "the error exceeds the requested accuracy", ""};
}

// How far the last step has raised the energy, and how far the tolerance and the known error allow it: in gradient flow
// it cannot rise. The path of a long step counts where it leaves the membrane between its ends.
std::pair<double, double> GraphSimulation::rise(const Observation& o) {
    const double asked = case_.accuracy.energy * summary.reference_energy, rise = o.free_energy - good_.least_energy;
    double on_path = rise;
    for (const auto& [t, seen] : seen_) on_path = std::fmax(on_path, seen.free_energy - good_.least_energy);
    if (rise > std::max(asked, stated_over_computed * error_.largest)) error_.transport(mesh_->transport, o);
    const double known = std::max(asked, stated_over_computed * error_.now());
    return {on_path > std::max(known, hopeless_error * summary.reference_energy) ? on_path : rise, known};
}

// Back to the last good state.
StopReport GraphSimulation::undo_rise(double rise) {
    error_.latest = {rise, 0};
    gave_up = settings_.may_give_up && settings_.free_time;
    return_to_good();
    return energy_rises(rise / summary.reference_energy, good_.time);
}

std::optional<StopReport> GraphSimulation::check_error() {
    if (error_.now() <= hopeless_error * summary.reference_energy) return std::nullopt;
    const bool asked = !settings_.free_mesh || !settings_.free_time;
    return StopReport{
        Stop::resolution_lost, integrator_->time(),
        fmt::format("the error of the energy reached {:.2g} of E_ref{}", error_.now() / summary.reference_energy,
                    asked ? " with the given discretisation" : ""),
        asked ? "omit discretisation.elements and discretisation.time_tolerance, or refine them"
              : "use a tighter accuracy.energy: errors grow during the run from this initial shape"};
}

std::optional<StopReport> GraphSimulation::find_event(bool) {
    const Observation& o = now_.o;
    const double t = integrator_->time();
    if (outcome_ == TimeIntegrator::Outcome::guard)
        return graph_guards()[integrator_->tripped()].report(o, *mesh_, integrator_->x(), t);
    if (o.symbol_3d <= 0 && summary.warnings.empty())
        summary.warnings.push_back(
            fmt::format("from t = {:.6g} on, the flow of the full surface is ill-posed in directions that axisymmetric "
                        "motion does not excite",
                        t));
    return std::nullopt;
}

// A shape that keeps sharpening gets more room each time, as every remesh restarts the integrator.
std::optional<StopReport> GraphSimulation::remesh() {
    const bool soon = integrator_->counters().steps < few_steps && meshes_ > 1;
    remesh_margin_ = soon ? std::max(remesh_margin_ / 8, 1e-3) : first_remesh_margin;
    const double t = integrator_->time();
    const Observation o = now_.o;
    auto breaks = refined_breaks(mesh_->space, now_.mesh_loss, allowed_loss_ * remesh_margin_, most_graph_elements);
    if (static_cast<int>(breaks.size()) > most_graph_elements + 1) {
        if (is_about_to_overhang(o)) return overhang(o, *mesh_, integrator_->x(), integrator_->time());
        return StopReport{Stop::resolution_lost, t,
                          fmt::format("the profile needs more than {} elements per cell near z = {:.6g}",
                                      most_graph_elements, mesh_->place(o.z_steep)),
                          "use a looser accuracy.energy"};
    }
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(integrator_->x(), mesh_->space.size());
    auto next = std::make_unique<GraphMesh>(mesh_->space.cell(), std::move(breaks), case_);
    const Eigen::VectorXd projected = next->space.prolongation(mesh_->space) * x;  // all knots of before are here
    next->transport.inherit(mesh_->transport, x, projected);
    const double step = integrator_->step_size();
    use_mesh(std::move(next));  // from here on nothing pauses: mesh and integrator belong together
    make_integrator(projected, mesh_->forms.rate(projected), t, is_rosenbrock() ? step : 0);
    ++meshes_;
    return std::nullopt;
}

// Names the terms whose derivatives are wrong at the last good state, if any.
std::string GraphSimulation::suspects() const {
    std::string keys;
    for (const TermCheck& term : check_terms(mesh_->forms, good_.x))
        if (!term.check.pass()) keys += (keys.empty() ? "" : ", ") + term.key;
    return keys.empty() ? "the derivatives of all terms are right" : "wrong derivatives: " + keys;
}

StopReport GraphSimulation::failure(const std::string& what) const {
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(good_.x.size());
    const Observation o = mesh_->look(good_.x.data(), rest.data(), nullptr);
    if (is_about_to_overhang(o)) return overhang(o, *mesh_, integrator_->x(), integrator_->time());
    if (may_be_undefined(o.domain))
        return undefined_energy(o.domain, good_.time, fmt::format("z = {:.6g}", mesh_->place(o.domain.place)));
    return {Stop::solver_failed, good_.time, fmt::format("{} ({})", what, suspects()),
            "use a tighter accuracy.energy, or lower time.max_order"};
}

std::optional<StopReport> GraphSimulation::recover() {
    const std::string said = integrator_->failure();
    if (auto pause = clock_.find_pause(good_.time)) return pause;
    if (++good_.failures > most_failures) return failure("the time integrator gave up: " + said);
    return_to_good();
    return std::nullopt;
}

void GraphSimulation::return_to_good() {
    const Eigen::VectorXd x = good_.x;
    make_integrator(x, mesh_->forms.rate(x), good_.time, 0);
}

// A start beyond a limit stops at once: the integrator only sees limits being crossed.
std::optional<StopReport> GraphSimulation::check_start() {
    for (const GraphGuard& guard : graph_guards())
        if (guard.value(now_.o, limits()) <= 0)
            return guard.report(now_.o, *mesh_, integrator_->x(), integrator_->time());
    return std::nullopt;
}

std::optional<StopReport> GraphSimulation::advance(double until) {
    const double before = integrator_->time();
    error_before_ = error_.now();
    do {
        seen_.clear();
        outcome_ = integrator_->advance(until);
        if (outcome_ != TimeIntegrator::Outcome::failed) break;
        if (auto stop = recover()) return stop;
    } while (true);
    const double t = integrator_->time();
    if (outcome_ == TimeIntegrator::Outcome::guard) now_.time = std::numeric_limits<double>::quiet_NaN();
    const Observation& o = observe();
    if (t > before) {
        mesh_->transport.add_step(*integrator_, before, is_rosenbrock());
        dissipated_.add(t, o.dissipation);
    }
    const auto [rise, allowed] = this->rise(o);
    if (!(rise <= allowed)) return undo_rise(rise);
    error_.largest = std::max(error_.largest, rise / stated_over_computed);
    good_.least_energy = std::min(good_.least_energy, o.free_energy);
    return std::nullopt;
}

std::optional<StopReport> GraphSimulation::update_error() {
    const bool due = error_.due(now_.o, is_rosenbrock());
    if (!due && outcome_ == TimeIntegrator::Outcome::step) return std::nullopt;
    error_.transport(mesh_->transport, now_.o);
    return find_curable_error();
}

void GraphSimulation::accept() {
    good_.x = Eigen::Map<const Eigen::VectorXd>(integrator_->x(), mesh_->space.size());
    good_.time = integrator_->time();
    good_.balance = now_.o.free_energy + dissipated(good_.time);
    good_.failures = 0;
}

std::optional<StopReport> GraphSimulation::adapt_mesh() {
    if (!settings_.free_mesh || now_.lost() <= allowed_loss_) return std::nullopt;
    error_.transport(mesh_->transport, now_.o);
    if (auto stop = find_curable_error()) return stop;
    return remesh();
}

// Few long steps may miss their own error: what is stated is not far below the tolerance of a step, unless the energy
// has hardly changed.
double GraphSimulation::least_error() const {
    if (!is_rosenbrock()) return 0;
    return least_share * std::min(settings_.time_tolerance * summary.reference_energy,
                                  std::abs(now_.o.free_energy - past_.energy_start));
}

void GraphSimulation::summarise() {
    summary.estimated_error = std::max(stated_over_computed * error_.largest, least_error()) / summary.reference_energy;
    IntegratorCounters counters = past_.counters;
    counters += integrator_->counters();
    counters.describe(summary, settings_.time_tolerance, is_rosenbrock() ? "rosenbrock" : "ida", meshes_);
}

// A state at the end of the last step or within it.
struct GraphSimulation::View : StateView {
    const GraphSimulation& run;
    double t, error;
    Eigen::VectorXd x, v;
    Observation o;
    bool on_path = false;  // within a step, where a shorter one failed

    View(const GraphSimulation& r, double time) : run(r), t(time), x(r.mesh_->space.size()), v(x.size()) {}
    std::vector<double> row(double wall_seconds) const override { return run.row(t, error, o, x.data(), wall_seconds); }
    Record record() const override;
};

// The error within a step is the larger one of those at its ends, as it may pass through zero at one of them.
std::unique_ptr<StateView> GraphSimulation::at(double t) {
    auto out = std::make_unique<View>(*this, t);
    if (t == integrator_->time()) {
        std::copy_n(integrator_->x(), out->x.size(), out->x.data()),
            std::copy_n(integrator_->v(), out->v.size(), out->v.data());
        out->o = now_.o, out->error = error_.now();
    } else {
        integrator_->state_within_step(t, out->x.data(), out->v.data());
        out->o = mesh_->look(out->x.data(), out->v.data(), nullptr);
        // Where the flow is degenerate a shorter step may fail unseen: then the path, on which the step was accepted.
        if (!(out->o.free_energy <= good_.least_energy + hopeless_error * summary.reference_energy)) {
            integrator_->interpolate(t, out->x.data(), out->v.data());
            out->o = mesh_->look(out->x.data(), out->v.data(), nullptr);
            out->on_path = true;
        }
        out->error = std::max(error_before_, error_.now());
    }
    return out;
}

// Long steps have rows on their path, where guards have been checked. The path is of lower order than the step: the
// balance of energy shows the error of its energy, which counts as an error of the run. Where that is too large, a
// shorter step leads to the middle.
void GraphSimulation::write_path(double from, double until, RunOutput& out) {
    const double asked = case_.accuracy.energy * summary.reference_energy,
                 error = std::max(error_before_, error_.now());
    const double allowed = path_error * std::min(3 * settings_.time_tolerance * summary.reference_energy, asked);
    Eigen::VectorXd x(mesh_->space.size()), v(mesh_->space.size());
    for (const auto& [t, o] : seen_) {
        if (!(t > from && t < until) || !out.wants_row(t)) continue;
        const double lost = std::abs(o.free_energy + dissipated(t) - good_.balance);
        const double both = error + lost / stated_over_computed;
        if (lost > allowed || stated_over_computed * both > asked) {
            if (&seen_[path_points.size() / 2].first != &t) continue;
            if (const auto state = at(t); !static_cast<const View&>(*state).on_path)
                out.row(t, state->row(out.seconds()));
        } else {
            error_.largest = std::max(error_.largest, both);
            integrator_->interpolate(t, x.data(), v.data());
            out.row(t, row(t, both, o, x.data(), out.seconds()));
        }
    }
}

std::vector<double> GraphSimulation::row(double t, double error, const Observation& o, const double* x,
                                         double wall_seconds) const {
    const long iterations = integrator_->counters().newton_iterations + past_.counters.newton_iterations;
    return series_.values({t, o, x, *mesh_, *integrator_, iterations,
                           o.free_energy - past_.energy_start + dissipated(t), stated_over_computed * error,
                           summary.elements, wall_seconds});
}

Record GraphSimulation::View::record() const {
    const GraphMesh& mesh = *run.mesh_;
    GraphRestart state;
    state.cell = mesh.space.cell();
    state.breaks = mesh.space.breaks();
    state.coefficients = x;
    state.error_total = mesh.transport.total;
    state.error_spatial = mesh.transport.spatial();
    state.reference_energy = run.summary.reference_energy;
    state.time_tolerance = run.settings_.time_tolerance;
    state.mesh_loss = run.allowed_loss_;
    state.energy_start = run.past_.energy_start;
    state.dissipated = run.dissipated(t);
    state.error_max = run.error_.largest;
    state.least_symbol = run.least_symbol_.value_or(0);
    state.rosenbrock = run.is_rosenbrock();
    state.attempts = run.summary.attempts;
    return graph_record(t, mesh.space, state, v, o.energy);
}

}  // namespace tubule::axisym
