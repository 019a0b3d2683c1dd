// A case of tier "axisym", from its start to its stop.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "axisym/flow.hpp"
#include "common/case/case.hpp"
#include "common/result/result.hpp"
#include "common/solve/stop.hpp"

namespace tubule::axisym {

// Who watches a run. Rows hold one value for each of series_names(); a frame is made when asked for.
struct RunObserver {
    virtual ~RunObserver() = default;
    virtual void row(std::span<const double>) {}
    virtual void frame(const std::function<Record()>& /*make*/) {}
    virtual void checkpoint(const Record&) {}
    virtual void discard() {}  // the run begins again with finer settings: forget all rows and frames
    virtual void progress(double /*time*/, double /*energy*/, double /*step*/) {}
    virtual bool interrupted() { return false; }
};

struct RunSummary {
    StopReport stop;
    double energy = 0;            // at the stop
    double reference_energy = 0;  // E_ref (design): asked and estimated errors are relative to it
    double estimated_error = 0;   // of the energy, largest over the run, relative to E_ref
    bool as_accurate_as_asked = true;
    int attempts = 1;  // how often the run began again with finer settings, plus one
    int meshes = 1;    // of the last attempt
    int elements = 0;  // over one period, at the stop
    double time_tolerance = 0;
    FlowCounters counters;  // of the last attempt
    std::vector<std::string> warnings;
};

// Names of the series a run of this case writes, "time" first.
std::vector<std::string> series_names(const Case& c);

// Runs the case, from `restart` (a frame or checkpoint of the same case) if given. What the physics or the
// numerics do is reported in the summary, never thrown; a start that cannot be set up throws std::runtime_error.
RunSummary run(const Case& c, RunObserver& observer, const Record* restart = nullptr);

}  // namespace tubule::axisym
