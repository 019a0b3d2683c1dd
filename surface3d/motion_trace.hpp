// The energy along a run, for another run to be compared with.
#pragma once

#include <array>
#include <vector>

#include "common/result/result.hpp"

namespace tubule::surface3d {

class MotionTrace {
public:
    MotionTrace() = default;
    // What array() put into a record; empty where it has none.
    explicit MotionTrace(const Record& record);

    void add(double t, double energy) { points_.push_back({t, energy}); }
    bool empty() const { return points_.empty(); }
    double end() const { return points_.back()[0]; }
    // Between two points, the polynomial through them and their neighbours that are not too near to them.
    double operator()(double t) const;
    Array array() const;

private:
    std::vector<std::array<double, 2>> points_;
};

}  // namespace tubule::surface3d
