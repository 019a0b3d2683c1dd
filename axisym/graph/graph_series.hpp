// The series of a run of a graph, a row each step.
#pragma once

#include <string>
#include <vector>

#include "axisym/graph/graph_stage.hpp"
#include "axisym/integration/flow.hpp"

namespace tubule::axisym {

// What a row has beside what is observed of the profile.
struct GraphRow {
    double time;
    const Observation& o;
    const double* x;
    const Flow& flow;
    long newton_iterations;
    double identity_defect, energy_error;
    int elements;
    double wall_seconds;
};

std::vector<std::string> graph_series_names(const Case& c);
std::vector<double> graph_values(const GraphStage& stage, const GraphRow& row);

}  // namespace tubule::axisym
