// The error of the energy along a run of a graph, as the error transport computes it at intervals.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "axisym/graph/graph_mesh.hpp"
#include "axisym/graph/graph_settings.hpp"

namespace tubule::axisym {

class GraphError {
public:
    // The transport begins anew with this observation.
    void begin(const Observation& o) { dissipation_last_ = o.dissipation, steps_since_ = 0; }
    // Whether to transport the error after a step: after each long step of a one-step method, or when some short ones
    // of backward differences have changed the shape.
    bool due(const Observation& o, bool rosenbrock);
    void transport(GraphMesh& stage, const Observation& o);
    // Whether it exceeds what is allowed, for a reason that finer settings remedy.
    bool is_curable(const GraphSettings& settings, double allowed) const;

    double now() const { return std::abs(latest.total); }

    ErrorTransport::EnergyError latest;
    double largest = 0;

private:
    double dissipation_last_ = 0;
    int steps_since_ = 0;
};

}  // namespace tubule::axisym
