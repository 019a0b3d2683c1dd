// The energy along a run, for another run to be compared with.
#pragma once

#include <array>
#include <vector>

#include "common/result/result.hpp"

namespace tubule::surface3d {

// Names of traces in a record that a run goes on from: its own, and that of the run that it is compared with.
constexpr const char *own_trace = "restart_trace", *coarser_trace = "restart_coarser_run";

class MotionTrace {
public:
    MotionTrace() = default;
    // What array() put into a record under this name; empty where it has none.
    MotionTrace(const Record& record, const char* name);

    // Later than all before; else it is left out.
    void add(double t, double energy) {
        if (empty() || t > end()) points_.push_back({t, energy});
    }
    bool empty() const { return points_.empty(); }
    double end() const { return points_.back()[0]; }
    // Between two points, the polynomial through them and their neighbours that are not too near to them.
    double operator()(double t) const;
    Array array(const char* name) const;

private:
    std::vector<std::array<double, 2>> points_;
};

}  // namespace tubule::surface3d
