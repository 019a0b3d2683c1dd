// The series of a run in motion, a row each step.
#pragma once

#include <string>
#include <vector>

#include "surface3d/motion/motion_measures.hpp"

namespace tubule::surface3d {

// What a row has beside what is measured of the surface.
struct MotionRow {
    const MotionState& state;
    const MotionMeasures& measures;
    double identity_defect, correction_energy, energy_error;
    int elements;
    double wall_seconds;
};

std::vector<double> motion_values(const MotionRow& row);
std::vector<std::string> motion_names();  // of the values

}  // namespace tubule::surface3d
