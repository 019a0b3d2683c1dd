// How fine a run of a graph is.
#pragma once

#include "axisym/graph/graph_error_transport.hpp"
#include "common/case/problem.hpp"

namespace tubule::axisym {

constexpr double stated_over_computed = 1.8;  // error stated / error computed by the transport

// The asked accuracy sets it, a failed attempt tightens it.
struct GraphSettings {
    double time_tolerance = 0;
    double defect = 0;  // remesh when the defect exceeds this: of E_ref, absolute once that is known
    bool free_time = true, free_mesh = true;
    bool may_give_up = true;  // where the error exceeds the accuracy asked, and finer settings would help
    bool rosenbrock = false;  // Rosenbrock's method of long steps instead of IDA
};

GraphSettings first_graph_settings(const Problem& c, bool rosenbrock);

// After attempt number `attempt`, whose error (absolute) was beyond what is allowed.
GraphSettings tightened(GraphSettings s, const ErrorTransport::EnergyError& error, double allowed, int attempt);

}  // namespace tubule::axisym
