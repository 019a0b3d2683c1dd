// What one run writes.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "common/run/run.hpp"
#include "common/run/run_clock.hpp"

namespace tubule {

// Hands rows and frames to the observer, at no time twice. A run that is not reported, but compared with another,
// writes nothing: its owner saves it.
class RunOutput {
public:
    RunOutput(RunObserver& watch, const RunClock& clock, bool reported)
        : watch_(watch), clock_(clock), reported_(reported) {}

    bool reported() const { return reported_; }
    double seconds() const { return clock_.seconds(); }
    std::size_t mesh(const SurfaceCells& cells) { return watch_.mesh(cells); }
    void progress(double time, double energy, double step) { watch_.progress(time, energy, step); }
    void note(const std::string& words) {
        if (reported_ && !words.empty()) watch_.note(words);
    }
    // Output at this time has already been written by the interrupted run.
    void go_on_from(double time) { last_row_ = last_frame_ = time; }

    bool wants_row(double time) const { return reported_ && time != last_row_; }
    void row(double time, std::span<const double> values);
    void frame(double time, const std::function<Record()>& make);
    // A checkpoint, if the last one is some time ago.
    void checkpoint_if_due(const std::function<Record()>& make);
    // The state at the end: a checkpoint where the run can be resumed, else a frame.
    void end(const StopReport& stop, double time, const std::function<Record()>& make);

private:
    RunObserver& watch_;
    const RunClock& clock_;
    bool reported_;
    double last_row_ = -1, last_frame_ = -1, last_checkpoint_ = 0, checkpoint_cost_ = 0;
};

}  // namespace tubule
