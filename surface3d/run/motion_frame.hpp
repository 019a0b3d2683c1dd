// Moving surfaces as frames of the result file and as restarts, and the series of their runs.
#pragma once

#include <cmath>

#include "common/result/result.hpp"
#include "common/series/table.hpp"
#include "surface3d/motion/motion_measures.hpp"
#include "surface3d/run/mesh_record.hpp"
#include "surface3d/run/motion_settings.hpp"

namespace tubule::surface3d {

// What the initial shape determines.
struct MotionScale {
    double area = 0, volume = 0;
    double relaxation = 0;       // the time in which the mesh relaxes
    double least_variation = 0;  // of H, see MotionControl
    double reference_energy = 0;
    double bead_distance = 0;

    double length() const { return std::sqrt(area); }
};

// Balance of the total energy, which can only fall: free and kinetic energy, less the work done.
struct MotionBalance {
    double total_start = 0, lowest_total = 0;  // initially, and least so far
    double work = 0;                           // of the loads: dF at constant area and volume
    double supplied = 0;                       // kinetic energy, by a reservoir
    Extent past;                               // area, volume and length at the step before
    double force_past = 0;                     // and the force that held the distance of beads,
    double source_past = 0;                    // and the power of sources
    double dissipated = 0, corrected = 0;
    double dissipation_past = 0;  // its rate at the step before
    double imbalance = 0;         // largest

    double done() const { return work + supplied; }
    // Defect of the dissipation identity: 0 but for errors.
    double imbalance_at(double total) const { return total - total_start + dissipated; }
};

struct MotionCounters {
    int steps = 0, rejected = 0, mesh_since = 0, meshes = 1;
    int thinned = 0;  // meshes of fewer triangles, on the way
    int rough = 0;    // steps to surfaces that are rough for their mesh
};

// What a run remembers in addition to the state of the surface.
struct MotionMemory {
    MotionSettings settings;
    MotionScale scale;
    MotionBalance balance;
    MotionCounters count;
    double next_step = 0;
    int order = 1;            // of the last step, in time
    int initial_mesh_of = 0;  // the mesh is the initial one of so many triangles; 0: remeshed
    double error = 0;         // largest so far, of the energy, absolute
    double moved = 0;         // largest path of a node since the last check for self-intersection
    Eigen::VectorXd H0;       // at the nodes, where it varies
    LinearWork linear_work;
};

// Data of the nodes: points, normal, u, u_n (normal velocity), p (where there is one), H, K, energy_density, H0 (if it
// varies); the rest of the state under names that begin with restart_.
Record motion_record(const MovingSurface& surface, const MotionState& state, const MotionMeasures& measures,
                     const MotionMemory& memory, std::size_t mesh_number);

// The state alone, without data to be looked at.
Record state_record(const MotionState& state, const MotionMemory& memory);

struct MotionRestart {
    MotionState state;
    MotionMemory memory;
};

// The restart of a run with this scheme. Throws as RecordReader.
MotionRestart motion_restart(const Record& record, Scheme scheme);

// Values of a row of the series that are not measured on the surface.
struct MotionRow {
    const MotionState& state;
    const MotionMeasures& measures;
    double work, volume_drift, imbalance, correction_energy, energy_error;
    int elements;
    double wall_seconds;
};

SeriesTable<MotionRow> motion_series(const Problem& c);

}  // namespace tubule::surface3d
