#include "axisym/graph/graph_settings.hpp"

#include <algorithm>
#include <cmath>

namespace tubule::axisym {
namespace {

// Measured choices: docs/decisions/graphs.md, "Ask for accuracy".
// The error of Rosenbrock's method falls faster than its tolerance.
double time_tolerance_for(double asked, bool rosenbrock) {
    return std::max(!rosenbrock ? 0.35 * asked : 3.5e-5 * std::pow(asked / 1e-4, 0.68), 1e-13);
}
constexpr double defect_per_accuracy = 1.0 / 12;  // defect at which to remesh / (asked accuracy * E_ref)

}  // namespace

GraphSettings first_graph_settings(const Problem& c, bool rosenbrock) {
    const double asked = c.accuracy.energy;
    return {c.discretisation.time_tolerance.value_or(time_tolerance_for(asked, rosenbrock)),
            defect_per_accuracy * asked,
            !c.discretisation.time_tolerance,
            !c.discretisation.elements,
            true,
            rosenbrock};
}

// An attempt ends when its error exceeds what is allowed, before it is largest: after the first attempt, settings aim
// at less.
GraphSettings tightened(GraphSettings s, const ErrorTransport::EnergyError& error, double allowed, int attempt) {
    const double boldness = attempt == 1 ? 1 : 0.3;
    const auto shrink = [&](double goal, double part) {
        return std::clamp(boldness * goal * allowed / part, 0.01, 0.6);
    };
    const double of_space = std::abs(error.spatial), of_time = std::abs(error.total - error.spatial);
    if (s.free_time && of_time > 0.3 * allowed)
        s.time_tolerance = std::max(s.time_tolerance * shrink(0.35, of_time), 1e-14);
    if (s.free_mesh && of_space > 0.3 * allowed) s.defect *= shrink(0.15, of_space);
    return s;
}

}  // namespace tubule::axisym
