// The loop of all runs in time: step, error estimate, rows and frames, events, restart records, meshes.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "common/case/problem.hpp"
#include "common/run/run_clock.hpp"
#include "common/run/run_output.hpp"
#include "common/run/simulation.hpp"

namespace tubule {

class Loop {
public:
    // All references must outlive the loop. A run that is not `reported`, but compared with another, writes
    // nothing: its owner saves it.
    Loop(Simulation& run, const Problem& c, RunObserver& watch, const RunClock& clock, bool reported = true);

    void add(std::unique_ptr<Callback> callback) { callbacks_.push_back(std::move(callback)); }

    // begin() or resume(), after the same call of the simulation; then go() to the end, or step() by an owner that
    // leads the run.
    void begin(const std::string& note = "");
    void resume(const Record& restart);
    void go();
    void go_from(const Record* restart, const std::string& note = "");  // begin() or resume(), and go()
    void step(double until = HUGE_VAL);
    void end(const StopReport& stop) { stop_ = stop; }  // there are no more steps

    const std::optional<StopReport>& stop() const { return stop_; }
    void save_callbacks(Record& record) const;

private:
    bool write_step(double from);
    void write_row(const StateView& state, double t);
    std::optional<StopReport> check_progress();
    Record record(const StateView& state) const;
    Record restart_record();
    void finish();

    Simulation& run_;
    const Problem& case_;
    const RunClock& clock_;
    RunOutput out_;
    OutputTimes outputs_;
    std::vector<std::unique_ptr<Callback>> callbacks_;
    std::optional<StopReport> stop_;
};

}  // namespace tubule
