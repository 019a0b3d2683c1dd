#include "common/run/run_clock.hpp"

#include <fmt/format.h>

namespace tubule {

double RunClock::seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
}

std::optional<StopReport> RunClock::find_pause(double time) const {
    if (limit_ && seconds() > *limit_)
        return StopReport{Stop::time_limit, time, fmt::format("reached the time limit of {} s (time.limit)", *limit_),
                          "continue with --resume"};
    if (interrupted()) return StopReport{Stop::interrupted, time, "interrupted by a signal", "continue with --resume"};
    return std::nullopt;
}

}  // namespace tubule
