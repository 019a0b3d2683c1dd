#include "axisym/graph/graph_error.hpp"

namespace tubule::axisym {
namespace {

// Measured choices: docs/decisions/graphs.md. The error is transported after this number of steps, or when the
// logarithm of the dissipation has changed by this.
constexpr int error_steps = 8;
constexpr double error_change = 0.25;

}  // namespace

bool GraphError::due(const Observation& o, bool rosenbrock) {
    const double change = std::abs(std::log(o.dissipation / dissipation_last_));
    return ++steps_since_ >= error_steps || rosenbrock || !(change < error_change);
}

void GraphError::transport(GraphMesh& stage, const Observation& o) {
    if (steps_since_ > 0) stage.transport.advance();
    latest = stage.transport.energy_error(o.free_energy);
    begin(o);
    largest = std::max(largest, now());
}

bool GraphError::is_curable(const GraphSettings& s, double allowed) const {
    const double of_time = std::abs(latest.total - latest.spatial);
    return now() > allowed &&
           ((s.free_mesh && std::abs(latest.spatial) > 0.4 * allowed) || (s.free_time && of_time > 0.4 * allowed));
}

}  // namespace tubule::axisym
