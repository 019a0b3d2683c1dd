// When a run writes its state.
#pragma once

#include <algorithm>
#include <vector>

#include "common/case/case.hpp"

namespace tubule {

// time.output and time.end, in order, as far as they are later than the begin; those not yet written are ahead.
class OutputTimes {
public:
    explicit OutputTimes(const Case& c, double begin = 0) : times_(c.time.output) {
        times_.push_back(c.time.end);
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
