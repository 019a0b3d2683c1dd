#include "axisym/graph/graph_settings.hpp"

#include <algorithm>
#include <cmath>

namespace tubule::axisym {
namespace {

// Measured choices: docs/decisions/graphs.md, "Ask for accuracy".
constexpr double tolerance_per_accuracy = 0.35;   // time tolerance / asked accuracy
constexpr double defect_per_accuracy = 1.0 / 12;  // defect at which to remesh / (asked accuracy * E_ref)

}  // namespace

GraphSettings first_graph_settings(const Case& c) {
    const double asked = c.accuracy.energy;
    return {c.discretisation.time_tolerance.value_or(std::max(tolerance_per_accuracy * asked, 1e-13)),
            defect_per_accuracy * asked, !c.discretisation.time_tolerance, !c.discretisation.elements};
}

// The error was caught when it passed what is allowed, not at its largest: the more often that happened, the bolder the
// next try.
GraphSettings tightened(GraphSettings s, const ErrorTransport::EnergyError& error, double allowed, int attempt,
                        bool space_is_stuck) {
    const double boldness = attempt == 1 ? 1 : 0.3;
    const auto shrink = [&](double goal, double part) {
        return std::clamp(boldness * goal * allowed / part, 0.01, 0.6);
    };
    const double of_space = std::abs(error.spatial),
                 of_time = std::abs(error.total - error.spatial) + (space_is_stuck ? of_space : 0);
    if (s.free_time && of_time > 0.3 * allowed)
        s.time_tolerance = std::max(s.time_tolerance * shrink(0.35, of_time), 1e-14);
    if (s.free_mesh && of_space > 0.3 * allowed) s.defect *= shrink(0.15, of_space);
    return s;
}

}  // namespace tubule::axisym
