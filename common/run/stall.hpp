// Ends a run whose steps make no progress.
#pragma once

#include <limits>
#include <string>

#include "common/run/simulation.hpp"

namespace tubule {

// Many steps, all shorter than `tiny` at last, in which neither time advances by a thousandth nor the least energy
// falls by a tenth of the accuracy asked. A run that follows a singularity by shorter and shorter steps does not count
// as stalled, as its energy falls.
class Stall : public Callback {
public:
    Stall(int most_steps, double tiny, double accuracy, std::string advice)
        : most_steps_(most_steps), tiny_(tiny), accuracy_(accuracy), advice_(std::move(advice)) {}

    std::optional<StopReport> after_step(const Simulation& run) override;
    // `least`: the least energy so far, relative to E_ref.
    std::optional<StopReport> look(double time, double step, double least);
    void save(Record& record) const override;
    void restore(const Record& record) override;

private:
    int most_steps_;
    double tiny_, accuracy_;
    std::string advice_;
    int steps_ = 0;  // since the last progress
    double time_ = 0, energy_ = std::numeric_limits<double>::max();
};

}  // namespace tubule
