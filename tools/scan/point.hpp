// One point of a scan: a run in memory, and what is kept of it.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "common/case/problem.hpp"
#include "tools/scan/outcome.hpp"

namespace tubule {

// At the last state, but for energy_error, which is that of the whole run. What a run does not tell is not a number.
// height to limit_energy are those of an equilibrium: growth is the largest rate of all m, with equilibrium.modes,
// limit_energy that of the lowest vesiculated limit (common/theory). Searches that failed have the energy of their last
// state where it has the area and the volume that are held.
enum class Measure {
    energy,
    time,
    energy_error,
    E_ref,
    r_min,
    r_max,
    area,
    volume,
    height,
    tension,
    pressure,
    force,
    growth,
    free_energy,
    limit_energy,
    steps,
    elements,
    wall_seconds,
    cpu_seconds
};
inline constexpr std::array measure_names{"energy",   "time",     "energy_error", "E_ref",       "r_min",
                                          "r_max",    "area",     "volume",       "height",      "tension",
                                          "pressure", "force",    "growth",       "free_energy", "limit_energy",
                                          "steps",    "elements", "wall_seconds", "cpu_seconds"};
inline constexpr std::size_t n_measures = measure_names.size();

struct PointResult {
    std::size_t point = 0;
    Outcome outcome = Outcome::not_run;
    int stop = 0;                                             // of stop_words()
    double value = std::numeric_limits<double>::quiet_NaN();  // between points of the grid: of the axis' key
    std::array<double, n_measures> measures;
    std::string message;

    PointResult() { measures.fill(std::numeric_limits<double>::quiet_NaN()); }
    double& operator[](Measure m) { return measures[static_cast<std::size_t>(m)]; }
    double operator[](Measure m) const { return measures[static_cast<std::size_t>(m)]; }
};

// Names of the stop reasons; then "decided", for runs that were ended as soon as their outcome was known; then
// "refused", for points that are not a valid case.
const std::vector<std::string>& stop_words();
int stop_word(Stop reason);

// Runs a case. `to_the_end`: even where the outcome is known before. A run that interrupted() ends has
// Stop::interrupted and no result; other failures are outcomes, never thrown.
PointResult run_point(const Problem& c, bool to_the_end);

// A point that was not run.
PointResult unknown_point(std::size_t point);
std::vector<PointResult> unknown_points(std::size_t count);  // of a grid, in order

// The result of a point whose keys are not a valid case.
PointResult refused_point(const std::string& message);

}  // namespace tubule
