// The series of a run in motion, a row each step.
#pragma once

#include "common/series/table.hpp"
#include "surface3d/motion/motion_measures.hpp"

namespace tubule::surface3d {

// Values of a row that are not measured on the surface.
struct MotionRow {
    const MotionState& state;
    const MotionMeasures& measures;
    double work, volume_drift, identity_defect, correction_energy, energy_error;
    int elements;
    double wall_seconds;
};

SeriesTable<MotionRow> motion_series(const Bending& energy);

}  // namespace tubule::surface3d
