// A run that shows what a case takes or does, and ends early: for forecasts, advice and the choice of a model.
#pragma once

#include <ctime>
#include <limits>
#include <span>
#include <string>

#include "common/case/problem.hpp"
#include "common/run/energy_trace.hpp"
#include "common/run/forecast.hpp"

namespace tubule {

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
    TrialRun(const Problem& c, const TrialLimits& limits);

    void row(std::span<const double> values) override;
    void discard() override { energies = {}; }
    bool interrupted() override {
        return (limits_.axisymmetric && switched) || rows_ > limits_.rows || since_begin() > limits_.seconds;
    }
    void note(const std::string&) override { switched = switched || !energies.empty(); }

    RunSummary summary;
    double seconds = 0;     // of the processors, or of the clock if that is less: of a busy machine the former, else,
                            // where threads share the work, the latter
    bool switched = false;  // it was to go on in three dimensions
    EnergyTrace energies;   // by rows
    double area = 0, r_max = 0;  // at the start

private:
    double since_begin() const { return static_cast<double>(std::clock() - begin_) / CLOCKS_PER_SEC; }

    TrialLimits limits_;
    std::vector<std::string> series_;
    std::clock_t begin_ = 0;
    int rows_ = 0;
};

}  // namespace tubule
