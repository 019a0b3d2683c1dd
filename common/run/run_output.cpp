#include "common/run/run_output.hpp"

#include <algorithm>

namespace tubule {

void RunOutput::row(double time, std::span<const double> values) {
    if (!wants_row(time)) return;
    watch_.row(values);
    last_row_ = time;
}

void RunOutput::frame(double time, const std::function<Record()>& make) {
    if (!reported_ || time == last_frame_) return;
    watch_.frame(make);
    last_frame_ = time;
}

void RunOutput::checkpoint_if_due(const std::function<Record()>& make) {
    if (!reported_) return;
    // A little before the result would be written without it (FileWriter::due), and at most 3 % of the time.
    const double now = seconds();
    if (now <= last_checkpoint_ + std::max(1.5, 35 * checkpoint_cost_)) return;
    watch_.checkpoint(make());
    last_checkpoint_ = seconds();
    checkpoint_cost_ = last_checkpoint_ - now;
}

void RunOutput::end(const StopReport& stop, double time, const std::function<Record()>& make) {
    if (!can_go_on(stop.reason))
        frame(time, make);
    else if (reported_)
        watch_.checkpoint(make());
}

}  // namespace tubule
