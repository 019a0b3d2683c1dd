// What a run is expected to take, found by a pilot run that is cheaper or ends early.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "common/case/case.hpp"
#include "common/run/run.hpp"

namespace tubule {

struct Forecast {
    std::string resolution;                // in words
    std::optional<double> steps, seconds;  // of wall time, of moving surfaces on a quiet machine; none: it is not known
    double bytes = 0;
    std::string ill_posed;    // why the run stops at its start, or empty
    bool finer_runs = false;  // may follow, which are not counted
};

// Counts the steps of a run.
class Pilot : public RunObserver {
public:
    void next_run(int number, int of) override { *this = Pilot(number, of); }
    void progress(double time, double, double step) override {
        ++steps_, time_ = time;
        growth_ = step_ > 0 ? step / step_ : 1, step_ = step;
    }

    int steps() const { return steps_; }       // of the last run that began
    bool last_run() const { return last_; }    // as far as is known
    bool moved() const { return steps_ > 0; }  // or it has not come to its first step

    // Whether the steps have become too short, by now, to predict a longer run.
    bool has_collapsed() const { return steps_ * step_ < 0.1 * time_; }

    // All steps until `end` over those done, if they stay as long as the last one or, where they still grow, mostly
    // continue to grow.
    double all_by_done(double end) const {
        double left = std::max(end - time_, 0.0) / step_;
        if (growth_ > 1.1) left = std::min(left, 1.5 * std::log1p(left * (growth_ - 1)) / std::log(growth_));
        return (steps_ + left) / steps_;
    }

    Pilot() = default;

private:
    Pilot(int number, int of) : last_(number == of) {}

    int steps_ = 0;
    double time_ = 0, step_ = 0, growth_ = 1;
    bool last_ = true;
};

}  // namespace tubule
