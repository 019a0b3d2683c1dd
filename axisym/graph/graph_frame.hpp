// A profile as a record of the result file: what readers need, and what a run needs to resume.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "axisym/splines/spline_space.hpp"
#include "common/result/result.hpp"

namespace tubule::axisym {

// Everything a run carries from one step to the next, except the integrator's history.
struct GraphRestart {
    Cell cell;
    std::vector<double> breaks;
    Eigen::VectorXd coefficients, error_total, error_spatial;
    double reference_energy = 0, energy_start = 0, dissipated = 0, error_max = 0;
    double time_tolerance = 0, defect = 0, least_symbol = 0;  // the defect absolute
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
