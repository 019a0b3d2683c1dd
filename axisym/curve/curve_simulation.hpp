// One run of a curve with settings as given: steps, energy balance, events, and how it compares with a coarser run.
#pragma once

#include <limits>
#include <memory>
#include <optional>

#include "axisym/curve/curve_guards.hpp"
#include "axisym/curve/curve_output.hpp"
#include "axisym/curve/curve_setup.hpp"
#include "axisym/integration/time_integrator.hpp"
#include "common/run/energy_trace.hpp"
#include "common/run/loop.hpp"
#include "common/run/simulation.hpp"

namespace tubule::axisym {

class CoarserCurve;

// Many fields: the setup of a run, its state, and what has been seen of it.
class CurveSimulation : public Simulation {
public:
    // All references must outlive it. Then begin() from the initial shape or resume() from a frame or checkpoint.
    // `coarser`: the run to compare with, if any.
    CurveSimulation(const Problem& c, const InitialShape& start, const CurveSettings& settings, CoarserCurve* coarser);
    ~CurveSimulation() override;
    void begin();
    void resume(const Record& restart);

    // What a run resumes from, without what a frame shows.
    Record restart_state();
    void compare_no_more() { coarser_ = nullptr; }

    bool is_reported() const { return !setup_.settings.is_coarser; }
    double time() const override { return initial_stop_ ? 0 : integrator_->time(); }
    double step_size() const override { return integrator_->step_size(); }
    Energetics energetics() const override;
    std::unique_ptr<StateView> at(double t) override;
    std::optional<StopReport> check_start() override;
    std::optional<StopReport> advance(double until) override;
    std::optional<StopReport> update_error() override;
    void accept() override { keep_good(); }
    std::optional<StopReport> find_event(bool at_output) override;
    StopReport failure(const SolveError& error) override;
    void summarise() override;

    EnergyTrace trace;
    double error = 0;  // largest over the run, absolute: see compare() and find_rise()
    double least_symbol = std::numeric_limits<double>::max();  // over the run: theory.md (2.14)
    MeshNeed mesh_need;  // of all states that were looked at, the first one among them

private:
    struct View;
    struct Past {
        double total_start = 0, dissipated = 0, work = 0;  // before this integrator began
        double least = 0;                                  // over all steps, of what never rises: total less work
        IntegratorCounters counters;
        Loads rates;              // of change, of the loads of this integrator
        double extends = 0;       // rate of the distance of beads that is held
        Eigen::VectorXd y, rate;  // of the last good step
        double time = 0;
    };

    std::unique_ptr<View> view(double t);
    const Snapshot& observe(double t, const double* y, const double* rate);
    void make_integrator(const Eigen::VectorXd& y, const Eigen::VectorXd& rate, double time, double first_step);
    void restart_integrator();
    std::optional<StopReport> find_guard(const Snapshot& s, double t) const;
    std::optional<StopReport> find_rise(const Snapshot& s);
    void look_at_mesh();
    void compare(double t, const Snapshot& s);
    double imbalance(double t, const Snapshot& s) const {
        return s.total() - past_.total_start + dissipated(t) - work(t);
    }
    bool holds_all() const;
    double power_supplied(const Snapshot& s) const;
    void keep_good();
    void add_to_trace(double t);

    double dissipated(double t) const { return past_.dissipated + integrator_->dissipated(t); }
    double work(double t) const { return past_.work + integrator_->work(t); }
    IntegratorCounters counters() const;

    CurveSetup setup_;
    CoarserCurve* coarser_;
    std::unique_ptr<TimeIntegrator> integrator_;
    TimeIntegrator::Outcome outcome_ = TimeIntegrator::Outcome::step;  // of the last step
    bool at_kink_ = false;                                             // of the loads, where it ended
    double observed_at_ = std::numeric_limits<double>::quiet_NaN();
    Snapshot now_;
    Past past_;
    double error_now_ = 0;
    std::unique_ptr<View>
        initial_;  // at t = 0, with the exact curve; until the first step, which begins a little later
    std::optional<StopReport> initial_stop_;
};

// The loop of a run of a curve, once that has begun: with the callbacks that curves have. All references must outlive
// it.
Loop loop_of(CurveSimulation& run, const Problem& c, RunObserver& watch, const RunClock& clock);

}  // namespace tubule::axisym
