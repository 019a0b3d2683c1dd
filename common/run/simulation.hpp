// One run of a discretised problem, as the loop (loop.hpp) sees a graph, a curve or a surface.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "common/result/record.hpp"
#include "common/run/run_observer.hpp"
#include "common/run/run_output.hpp"
#include "common/solve/sparse.hpp"

namespace tubule {

// Energies and rates at the end of the last step. total = F + kinetic energy - work of changing loads; it never rises.
// total_start, total_least: its first and least value.
struct Energetics {
    double bending = 0, free_energy = 0, total = 0, total_start = 0, total_least = 0;
    double kinetic = 0, dissipation = 0;
    double acceleration = 0;  // at least the kinetic energy gained from rest, per time squared
    double area = 0;
};

// The state at one time, as the result shows it.
class StateView {
public:
    virtual ~StateView() = default;
    virtual std::vector<double> row(double wall_seconds) const = 0;  // of the series
    virtual Record record() const = 0;                               // a frame, from which a run can resume
};

class Simulation {
public:
    virtual ~Simulation() = default;

    RunSummary summary;
    // False if the initial shape cannot be represented: check_start() says why, and nothing else may be called.
    virtual bool has_state() const { return true; }
    virtual double begin_time() const { return 0; }
    virtual double time() const = 0;       // of the last step's end
    virtual double step_size() const = 0;  // of the last step
    virtual Energetics energetics() const = 0;
    // At the end of the last step, within it, or at the begin time before the first step.
    virtual std::unique_ptr<StateView> at(double t) = 0;

    // Why the run stops at its initial shape, or where it resumes.
    virtual std::optional<StopReport> check_start() = 0;

    // One step, not beyond `until`: refused and repeated as often as its method does. The reason if no step leads on,
    // or if all raise the energy: the state is then the last good one.
    virtual std::optional<StopReport> advance(double until) = 0;
    virtual bool lands_on_outputs() const { return false; }  // or its steps pass over them, and at() interpolates
    // Brings the estimated error to the time of the step; may run companions up to this time. The reason if finer
    // settings should replace this run.
    virtual std::optional<StopReport> update_error() = 0;
    // Rows at times within the last step, for methods of long steps.
    virtual void write_path(double /*from*/, double /*until*/, RunOutput&) {}
    // Rows and frames are written: failures from now on return to this state.
    virtual void accept() {}
    // Whether the state has left the range of the model or of the discretisation.
    virtual std::optional<StopReport> find_event(bool at_output) = 0;
    // Whether the error is too large for the rest of the run to mean anything.
    virtual std::optional<StopReport> check_error() { return std::nullopt; }
    // A new mesh where the state needs one; the reason if there is none.
    virtual std::optional<StopReport> adapt_mesh() { return std::nullopt; }

    virtual StopReport failure(const SolveError& error) = 0;
    // Fills in the summary, except for the stop and the energy.
    virtual void summarise() = 0;
};

// Looks at a run after each step and may end it; keeps what it needs to resume in restart records.
class Callback {
public:
    virtual ~Callback() = default;
    virtual std::optional<StopReport> after_step(const Simulation& run) = 0;
    virtual void save(Record&) const {}
    virtual void restore(const Record&) {}
};

}  // namespace tubule
