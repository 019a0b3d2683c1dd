// One run of a graph with settings as given: steps, meshes, its error, events.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "axisym/graph/carried_error.hpp"
#include "axisym/graph/graph_guards.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "axisym/graph/graph_output.hpp"
#include "axisym/integration/step_integral.hpp"
#include "axisym/integration/time_integrator.hpp"
#include "common/run/simulation.hpp"

namespace tubule::axisym {

// Many fields: the settings, the state and its limits; the error and the mesh have classes of their own.
class GraphSimulation : public Simulation {
public:
    // All references must outlive it. From the initial shape, or resumed from a frame or checkpoint.
    GraphSimulation(const Problem& c, const RunClock& clock, const GraphSettings& settings);
    GraphSimulation(const Problem& c, const RunClock& clock, const GraphSettings& settings, const Record& restart);

    double time() const override { return integrator_->time(); }
    double step_size() const override { return integrator_->step_size(); }
    Energetics energetics() const override;
    std::unique_ptr<StateView> at(double t) override;
    std::optional<StopReport> check_start() override;
    std::optional<StopReport> advance(double until) override;
    std::optional<StopReport> update_error() override;
    void write_path(double from, double until, RunOutput& out) override;
    void accept() override;
    std::optional<StopReport> find_event(bool at_output) override;
    std::optional<StopReport> check_error() override;
    std::optional<StopReport> adapt_mesh() override;
    StopReport failure(const SolveError& error) override { return failure(std::string(error.what())); }
    void summarise() override;

    bool gave_up = false;  // its error exceeds the accuracy asked, and finer settings would help
    const ErrorTransport::EnergyError& latest_error() const { return error_.latest; }

private:
    struct State;
    struct View;
    // Before the present integrator began.
    struct Past {
        double energy_start = 0, dissipated = 0;
        IntegratorCounters counters;
    };
    // The last good state.
    struct Good {
        Eigen::VectorXd x;
        double time = 0;
        double balance = 0;                                             // free energy and what is dissipated so far
        double least_energy = std::numeric_limits<double>::infinity();  // so far
        int failures = 0;                                               // of the integrator since
    };
    // The end of the last step.
    struct Now {
        double time = std::numeric_limits<double>::quiet_NaN();
        Observation o;
        std::vector<double> mesh_loss;
        double lost() const;
    };

    const Observation& observe(double t, const double* x, const double* v);
    const Observation& observe() { return observe(integrator_->time(), integrator_->x(), integrator_->v()); }
    void use_mesh(std::unique_ptr<GraphMesh> mesh);
    ImplicitSystem system();
    bool is_rosenbrock() const { return settings_.rosenbrock; }
    void make_integrator(const Eigen::VectorXd& x, const Eigen::VectorXd& v, double t, double first_step);
    void return_to_good();

    std::optional<StopReport> recover();
    std::pair<double, double> rise(const Observation& o);
    StopReport undo_rise(double rise);
    std::optional<StopReport> find_curable_error();
    GraphLimits limits() const;
    std::optional<StopReport> remesh();
    StopReport failure(const std::string& what) const;
    std::string suspects() const;

    double least_error() const;
    std::vector<double> row(double t, double error, const Observation& o, const double* x, double wall_seconds) const;
    // IDA integrates less exactly than it steps.
    double dissipated(double t) const {
        return past_.dissipated + (is_rosenbrock() ? integrator_->dissipated(t) : dissipated_.at(t));
    }

    const Problem& case_;
    const RunClock& clock_;
    const SeriesTable<GraphRow> series_;
    GraphSettings settings_;
    std::unique_ptr<GraphMesh> mesh_;
    std::unique_ptr<TimeIntegrator> integrator_;
    TimeIntegrator::Outcome outcome_ = TimeIntegrator::Outcome::step;  // of the last step
    Now now_;
    std::vector<std::pair<double, Observation>> seen_;  // on the way of the last step, by time
    StepIntegral dissipated_;                           // since the present integrator began
    GraphError error_;
    double error_before_ = 0;  // at the begin of the last step
    Past past_;
    Good good_;
    int meshes_ = 1;
    double allowed_loss_ = 0;  // to the mesh, absolute
    double remesh_margin_;
    std::optional<double> least_symbol_;  // of a flow that is well-posed
};

}  // namespace tubule::axisym
