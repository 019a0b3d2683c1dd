#include "common/run/run_clock.hpp"

#include <fmt/format.h>

namespace tubule {

StopReport pause_report(const Paused& pause, double time) {
    const std::string message = pause.reason == Stop::time_limit
                                    ? fmt::format("reached the time limit of {} s (time.limit)", pause.limit.value())
                                    : "a signal ended the run";
    return {pause.reason, time, message, "continue with --resume"};
}

RunSummary paused_at_start(const Paused& pause) {
    RunSummary out;
    out.stop = pause_report(pause, 0);
    out.stop.message += " before the first state was computed";
    out.stop.advice = pause.reason == Stop::time_limit ? "raise time.limit, or make the initial state cheaper to "
                                                         "compute: use fewer elements or a looser accuracy.energy"
                                                       : "run the case again";
    out.estimated_error = 1;  // nothing is known
    out.as_accurate_as_asked = false;
    out.effort = "no state";
    return out;
}

std::optional<StopReport> RunClock::find_pause(double time) const {
    if (const auto pause = watch_.due()) return pause_report(*pause, time);
    return std::nullopt;
}

}  // namespace tubule
