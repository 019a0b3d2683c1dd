// One run of a curve with settings as given, and the reason why it ends.
#pragma once

#include <limits>
#include <memory>
#include <optional>

#include "axisym/curve/curve_frame.hpp"
#include "axisym/curve/curve_guards.hpp"
#include "axisym/curve/curve_setup.hpp"
#include "axisym/integration/run_summary.hpp"
#include "common/run/output_times.hpp"
#include "common/run/run_output.hpp"
#include "common/run/run_pairs.hpp"
#include "common/run/settling.hpp"

namespace tubule::axisym {

// Many fields: the setup of a run, its state, and what has been seen of it.
class CurveAttempt {
public:
    // All references must outlive the attempt.
    CurveAttempt(const Case& c, RunObserver& watch, const RunClock& clock, const Beginning& start,
                 const CurveSettings& settings, const EndedRun* coarser);

    // One of the first two, then go().
    void begin();
    void resume(const Record& restart);
    void go();

    RunSummary summary;
    EnergyTrace trace;
    double error = 0;  // largest over the run, absolute: see compare() and find_rise()
    double least_symbol = std::numeric_limits<double>::max();  // over the run: theory.md (2.14)
    MeshNeed mesh_need;  // of all states that were looked at, the first one among them

private:
    struct Past {
        double total_start = 0, dissipated = 0, work = 0;  // before this flow began
        double least = 0;                                  // over all steps, of what never rises: total less work
        FlowCounters counters;
        Loads rates;              // of change, of the loads of this flow
        Eigen::VectorXd y, rate;  // of the last good step
        double time = 0;
        Settling settling;
    };

    const Snapshot& observe(double t, const double* y, const double* rate);
    void make_flow(const Eigen::VectorXd& y, const Eigen::VectorXd& rate, double time, double first_step);
    void restart_flow(const Eigen::VectorXd& y, const Eigen::VectorXd& rate, double time);
    std::optional<StopReport> check_start();
    std::optional<StopReport> find_event(const Snapshot& s, double t) const;
    std::optional<StopReport> step();
    std::optional<StopReport> find_rise(const Snapshot& s);
    std::optional<StopReport> check(double t);
    void look_at_mesh();
    void compare(double t, const Snapshot& s);
    double share(double t) const;
    double defect(double t, const Snapshot& s) const { return s.total() - past_.total_start + dissipated(t) - work(t); }
    void keep_good();
    double what_may_change(double t) const;
    void add_to_trace(double t);

    void write_outputs(double until);
    void write_row(double t, const Snapshot& s, const double* y);
    void write_frame(double t, const Snapshot& s, const double* y, const double* rate);
    Record record(double t, const Snapshot& s, const double* y, const double* rate) const;
    Record record() const { return record(flow_->time(), now_, flow_->x(), flow_->v()); }
    double dissipated(double t) const { return past_.dissipated + flow_->dissipated(t); }
    double work(double t) const { return past_.work + flow_->work(t); }
    FlowCounters counters() const;

    CurveSetup setup_;
    const RunClock& clock_;
    const EndedRun* coarser_;
    RunOutput out_;
    OutputTimes outputs_;
    std::unique_ptr<Flow> flow_;
    double observed_at_ = std::numeric_limits<double>::quiet_NaN();
    Snapshot now_;
    CurveStall stall_;
    Past past_;
    double error_now_ = 0;
    std::optional<StopReport> stop_;  // at the start
};

}  // namespace tubule::axisym
