// The wall time of a run with all attempts, and whether it is to pause: be saved now and resumed later.
#pragma once

#include <chrono>
#include <optional>

#include "common/case/case.hpp"
#include "common/run/run.hpp"

namespace tubule {

class RunClock {
public:
    RunClock(const Case& c, RunObserver& watch) : limit_(c.time.limit), watch_(watch) {}

    double seconds() const;  // since it was made
    bool interrupted() const { return watch_.interrupted(); }
    // The time limit is used up, or the observer interrupts the run, which has come to `time`.
    std::optional<StopReport> find_pause(double time) const;

private:
    std::optional<double> limit_;
    RunObserver& watch_;
    std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
};

}  // namespace tubule
