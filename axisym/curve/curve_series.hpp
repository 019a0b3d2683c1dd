// The series of a run of a curve, a row each step.
#pragma once

#include "axisym/curve/curve_snapshot.hpp"
#include "axisym/integration/time_integrator.hpp"
#include "common/case/problem.hpp"
#include "common/series/table.hpp"

namespace tubule::axisym {

// Input of a row.
struct CurveRow {
    double time;
    const Snapshot& now;
    const double* y;
    const CurveMotion& motion;
    const TimeIntegrator& flow;
    long newton_iterations;
    double identity_defect, work, energy_error;
    int elements;
    double wall_seconds;
};

SeriesTable<CurveRow> curve_series(const Problem& c);

}  // namespace tubule::axisym
