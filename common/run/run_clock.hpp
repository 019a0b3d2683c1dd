// The wall time of a run with all attempts, and whether it is to pause: be saved now and resumed later.
#pragma once

#include <optional>

#include "common/case/case.hpp"
#include "common/run/run_observer.hpp"
#include "common/solve/pause.hpp"

namespace tubule {

// The stop of a run that pauses at `time`.
StopReport pause_report(const Paused& pause, double time);
// The summary of a run that pauses before it has a state to resume from.
RunSummary paused_at_start(const Paused& pause);

// Has a watch of its own, since runs are called without the command, too.
class RunClock {
public:
    RunClock(const TimeSpan& time, RunObserver& watch) : watch_(time.limit, [&watch] { return watch.interrupted(); }) {}

    // Since it was made, or since the outermost PauseWatch of this thread was.
    double seconds() const { return watch_.seconds(); }
    // The run, which has come to `time`, is to pause: the time limit is used up, or the observer interrupts it.
    std::optional<StopReport> find_pause(double time) const;
    // What `run` returns; a summary that says so where it pauses with nothing to resume from.
    template <class Run>
    auto pausing(Run&& run) const {
        try {
            return run();
        } catch (const Paused& pause) {
            decltype(run()) out;
            static_cast<RunSummary&>(out) = paused_at_start(pause);
            return out;
        }
    }

private:
    PauseWatch watch_;
};

}  // namespace tubule
