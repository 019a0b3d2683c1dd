// What a run of a graph writes: a row of series each step, and frames: a profile as a record of the result file, with
// what readers need, and what a run needs to resume.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "axisym/graph/graph_mesh.hpp"
#include "axisym/integration/time_integrator.hpp"
#include "axisym/splines/spline_space.hpp"
#include "common/result/result.hpp"
#include "common/series/table.hpp"

namespace tubule::axisym {

// Input of a row.
struct GraphRow {
    double time;
    const Observation& o;
    const double* x;
    const GraphMesh& mesh;
    const TimeIntegrator& integrator;
    long newton_iterations;
    double imbalance, energy_error;
    int elements;
    double wall_seconds;
};

SeriesTable<GraphRow> graph_series(const Problem& c);

// Everything a run carries from one step to the next, except the integrator's history.
struct GraphRestart {
    Cell cell;
    std::vector<double> breaks;
    Eigen::VectorXd coefficients, error_total, error_spatial;
    double reference_energy = 0, energy_start = 0, dissipated = 0, error_max = 0;
    double time_tolerance = 0, mesh_loss = 0, least_symbol = 0;  // the mesh loss absolute
    bool rosenbrock = false;
    int attempts = 1;
};

// Numbers degree, length, energy; arrays knots, coefficients (the spline over the period [0, length]), sampled
// z, r, H, K, u_n (normal velocity); and the restart state under names that begin with restart_.
Record graph_record(double time, const SplineSpace& space, const GraphRestart& state, const Eigen::VectorXd& rate,
                    double energy);

// Throws as RecordReader.
GraphRestart graph_restart(const Record& record);

}  // namespace tubule::axisym
