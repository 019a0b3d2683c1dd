// A run that shows what a case takes or does, and ends early: for forecasts, advice and the choice of a model.
#pragma once

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <span>
#include <string>

#include "common/run/energy_trace.hpp"
#include "tools/run/engine.hpp"

namespace tubule {

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

// What may end it, beside the case's own end. Rows, of all its runs, are the same each time, seconds of a processor are
// not; `axisymmetric`: it ends where tier "auto" goes on in three dimensions.
struct TrialLimits {
    int rows = std::numeric_limits<int>::max();
    double seconds = std::numeric_limits<double>::infinity();
    bool axisymmetric = false;
};

class TrialRun : public Pilot {
public:
    // Runs the case. Throws as an engine and its run; Paused where a PauseWatch of this thread ends it.
    TrialRun(const Engine& engine, const TrialLimits& limits = {});
    TrialRun(const Problem& c, const TrialLimits& limits = {}) : TrialRun(Engine(c), limits) {}

    void row(std::span<const double> values) override;
    void discard() override { energies = {}; }
    bool interrupted() override {
        return (limits_.axisymmetric && switched) || rows_ > limits_.rows || since(begin_) > limits_.seconds;
    }
    void note(const std::string&) override { switched = switched || !energies.empty(); }

    bool is_ill_posed() const { return summary.stop.reason == Stop::ill_posed && !moved(); }  // from the start

    RunSummary summary;
    double seconds = 0;       // of the processors, or of the clock if that is less: of a busy machine the former, else,
                              // where threads share the work, the latter
    double cpu_of_steps = 0;  // of the processors, without the start
    bool switched = false;    // it was to go on in three dimensions
    EnergyTrace energies;     // by rows
    double area = 0, r_max = 0;  // at the start

private:
    static double since(std::clock_t t) { return static_cast<double>(std::clock() - t) / CLOCKS_PER_SEC; }

    TrialLimits limits_;
    std::vector<std::string> series_;
    std::clock_t begin_ = 0, first_row_ = 0;
    int rows_ = 0;
};

}  // namespace tubule
