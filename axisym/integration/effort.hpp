// What a run of a graph or a curve has taken.
#pragma once

#include <string>

#include "axisym/integration/time_integrator.hpp"
#include "common/run/run.hpp"

namespace tubule::axisym {

struct Effort {
    std::string integrator = "ida";  // as time.integrator names it
    int meshes = 1;                  // of the last attempt, like the counters
    double time_tolerance = 0;
    IntegratorCounters counters;
};

// Sets `effort` and `details`.
void describe(const Effort& effort, RunSummary& summary);

}  // namespace tubule::axisym
