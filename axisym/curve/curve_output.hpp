// What a run of a curve writes: its rows, a row each step, and the curve as a record of the result file, and back.
#pragma once

#include "axisym/curve/curve_settings.hpp"
#include "axisym/curve/curve_snapshot.hpp"
#include "axisym/integration/time_integrator.hpp"
#include "common/case/problem.hpp"
#include "common/result/result.hpp"
#include "common/run/energy_trace.hpp"
#include "common/series/table.hpp"

namespace tubule::axisym {

// Input of a row.
struct CurveRow {
    double time;
    const Snapshot& now;
    const double* y;
    const CurveMotion& motion;
    const TimeIntegrator& integrator;
    long newton_iterations;
    double imbalance, work, energy_error;
    int elements;
    double wall_seconds;
};

SeriesTable<CurveRow> curve_series(const Problem& c);

// What a run of a curve needs to resume.
struct CurveRestart {
    std::vector<double> breaks;
    Eigen::VectorXd y, rate;
    CurveSettings settings;
    double total_start = 0, dissipated = 0, error = 0, reference_energy = 0, least_symbol = 0;
    double work = 0;  // of loads that have changed
    MeshNeed mesh_need;
    EnergyTrace trace;
};

// Numbers energy, length (of a period, or 0), velocities without the part (L_t/L) z e_z of a period L that is free;
// sampled from pole to pole or over a period, in order along the profile: r, z, H, K, u_n (normal velocity), and of a
// flow u_t (along the profile, in the order of the points), p (pressure), u_theta (if it swirls), H0 (if it varies);
// the restart state under names that begin with restart_.
Record curve_record(double time, const CurveMotion& motion, const CurveRestart& state, double energy);

// The restart state alone.
Record state_record(double time, const CurveRestart& state);

// Throws as RecordReader.
CurveRestart curve_restart(const Record& record);

}  // namespace tubule::axisym
