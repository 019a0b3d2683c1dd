// What runs of graphs and curves say of themselves in the end.
#pragma once

#include "axisym/integration/flow.hpp"
#include "common/run/run.hpp"

namespace tubule::axisym {

struct RunSummary : tubule::RunSummary {
    int attempts = 1;  // how often the run began again with finer settings, plus one
    int meshes = 1;    // of the last attempt
    double time_tolerance = 0;
    std::string integrator = "ida";  // as time.integrator names it
    FlowCounters counters;  // of the last attempt
};

// Sets `effort` and `details`.
void describe_effort(RunSummary& summary);

}  // namespace tubule::axisym
