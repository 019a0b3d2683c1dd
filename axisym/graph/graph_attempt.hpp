// One run of a graph with settings as given: steps, remeshing, its error, and the reason why it ends.
#pragma once

#include <limits>
#include <memory>
#include <optional>

#include "axisym/graph/graph_error.hpp"
#include "axisym/graph/graph_frame.hpp"
#include "axisym/graph/graph_guards.hpp"
#include "axisym/graph/graph_series.hpp"
#include "axisym/graph/graph_stage.hpp"
#include "axisym/integration/flow.hpp"
#include "axisym/integration/run_summary.hpp"
#include "axisym/integration/step_integral.hpp"
#include "common/run/output_times.hpp"
#include "common/run/run_output.hpp"
#include "common/run/settling.hpp"

namespace tubule::axisym {

// Many fields: what the run is given, its state and its guards; the error, the mesh and the output have classes of
// their own.
class GraphAttempt {
public:
    // All references must outlive the attempt.
    GraphAttempt(const Case& c, RunObserver& watch, const RunClock& clock, const GraphSettings& settings);

    // One of the first two, then go().
    void begin();
    void resume(const Record& restart);
    void go();

    RunSummary summary;
    bool gave_up = false;  // its error exceeds the accuracy asked, and finer settings would help
    const ErrorTransport::EnergyError& latest_error() const { return error_.latest; }

private:
    // Before the present flow began.
    struct Past {
        double energy_start = 0, dissipated = 0;
        FlowCounters counters;
        Settling settling;
    };
    // The last good state.
    struct Good {
        Eigen::VectorXd x;
        double time = 0;
        double balance = 0;                                             // free energy and what is dissipated so far
        double least_energy = std::numeric_limits<double>::infinity();  // so far
        int failures = 0;                                               // of the integrator since
    };
    // What is known of the end of the last step.
    struct Now {
        double time = std::numeric_limits<double>::quiet_NaN();
        Observation o;
        std::vector<double> defect;
        double lost() const;
    };

    const Observation& observe(double t, const double* x, const double* v);
    void use_stage(std::unique_ptr<GraphStage> stage);
    FlowSystem system();
    bool is_one_step() const { return settings_.one_step; }
    void make_flow(const Eigen::VectorXd& x, const Eigen::VectorXd& v, double t, double first_step);

    std::optional<StopReport> step();
    bool must_give_up(const Observation& o);
    std::optional<StopReport> find_rise(const Observation& o);
    std::optional<StopReport> check(Flow::Outcome outcome, const Observation& o);
    std::optional<StopReport> find_lost_accuracy(double t) const;
    std::optional<StopReport> check_start() const;
    GraphLimits limits() const;

    std::optional<StopReport> remesh();
    std::optional<StopReport> recover();
    StopReport failure(const std::string& what) const;
    std::string suspects() const;

    double least_error() const;
    void end_with(const StopReport& stop);
    void write_outputs(double from, double error, const Observation& o);
    void write_path(double from, double until, double error);
    void write(double t, double error, const Observation& o, const double* x, const double* v);
    void write_row(double t, double error, const Observation& o, const double* x);
    Record record(double t, const Observation& o, const double* x, const double* v) const;
    // IDA integrates less exactly than it steps.
    double dissipated(double t) const {
        return past_.dissipated + (is_one_step() ? flow_->dissipated(t) : dissipated_.at(t));
    }

    const Case& case_;
    const RunClock& clock_;
    const SeriesTable<GraphRow> series_;
    GraphSettings settings_;
    RunOutput out_;
    OutputTimes outputs_;
    std::unique_ptr<GraphStage> stage_;
    std::unique_ptr<Flow> flow_;
    Now now_;
    std::vector<std::pair<double, Observation>> seen_;  // on the way of the last step, by time
    StepIntegral dissipated_;                           // since the present flow began
    GraphError error_;
    Past past_;
    Good good_;
    double remesh_margin_;
    std::optional<double> least_symbol_;  // of a flow that is well-posed
};

}  // namespace tubule::axisym
