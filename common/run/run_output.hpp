// What one run writes, and when.
#pragma once

#include <algorithm>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/case/case.hpp"
#include "common/run/run_clock.hpp"
#include "common/run/run_observer.hpp"

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

// time.output and time.end, in order, as far as they are later than the begin; those not yet written are ahead.
class OutputTimes {
public:
    explicit OutputTimes(const TimeSpan& time, double begin = 0) : times_(time.output) {
        times_.push_back(time.end);
        std::sort(times_.begin(), times_.end());
        times_.erase(std::unique(times_.begin(), times_.end()), times_.end());
        go_on_from(begin);
    }
    void go_on_from(double time) { next_ = std::upper_bound(times_.begin(), times_.end(), time) - times_.begin(); }
    bool done() const { return next_ == times_.size(); }
    double next() const { return times_[next_]; }  // only if not done()
    bool due(double time) const { return !done() && next() <= time; }
    double pass() { return times_[next_++]; }

private:
    std::vector<double> times_;
    std::size_t next_ = 0;
};

}  // namespace tubule
