#include "common/run/run_output.hpp"

namespace tubule {
namespace {

constexpr double seconds_between_checkpoints = 20;

}  // namespace

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

void RunOutput::safeguard(const std::function<Record()>& make) {
    if (seconds() <= last_checkpoint_ + seconds_between_checkpoints) return;
    last_checkpoint_ = seconds();
    watch_.checkpoint(make());
}

void RunOutput::end(const StopReport& stop, double time, const std::function<Record()>& make) {
    if (can_go_on(stop.reason))
        watch_.checkpoint(make());
    else
        frame(time, make);
}

}  // namespace tubule
