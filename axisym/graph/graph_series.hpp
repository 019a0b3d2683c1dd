// The series of a run of a graph, a row each step.
#pragma once

#include "axisym/graph/graph_mesh.hpp"
#include "axisym/integration/time_integrator.hpp"
#include "common/series/table.hpp"

namespace tubule::axisym {

// Input of a row.
struct GraphRow {
    double time;
    const Observation& o;
    const double* x;
    const GraphMesh& stage;
    const TimeIntegrator& flow;
    long newton_iterations;
    double identity_defect, energy_error;
    int elements;
    double wall_seconds;
};

SeriesTable<GraphRow> graph_series(const Problem& c);

}  // namespace tubule::axisym
