// How fine a run in motion is, and the coarser run that tells its error.
#pragma once

#include "common/case/case.hpp"
#include "surface3d/run/start.hpp"

namespace tubule::surface3d {

constexpr int least_triangles = 80;  // fewer are too inaccurate to estimate an error

// What a run is for: its own sake, or for another to be compared with, on fewer triangles or with elements of another
// order.
enum class Role { reported, fewer_triangles, other_order };

struct MotionSettings {
    int elements = 0;
    double tolerance = 0;   // of the positions in a step, relative to the root of the area
    double difference = 0;  // of the energies, absolute, by a pair on this mesh with a looser tolerance
    int pair = 1;           // its number
    Role role = Role::reported;
    double coarser_by = 1;  // of a coarser run: so many times fewer triangles
};

// The case's, or the default of its model and accuracy.
Scheme time_scheme(const Case& c);

// What the case gives, or what its accuracy asks for: as many triangles as the energy of the start takes.
MotionSettings first_settings(const Case& c, const Start& start);
bool settings_given(const Case& c);

// About how many triangles the coarser run is to have.
int fewer_triangles(int triangles);
constexpr int steps_at_once = 3;  // of the run, that the coarser one goes over
// The coarser run, which has so many times fewer triangles (elements of another order: 1).
MotionSettings coarser(const MotionSettings& s, Role role, double coarser_by);

// The error of a run over its difference from the coarser one, by the least orders that errors can be relied on to
// have where H is so smooth (MotionMeasures).
double error_by_difference(const Case& c, const MotionSettings& coarser, double smoothness);

// Of the next pair, after one whose error and defect of the balance are so large, where less is asked; all absolute.
MotionSettings finer(const MotionSettings& s, double asked, double error, double defect);

// Whether more triangles are worth a try.
bool can_be_finer(const MotionSettings& s);

}  // namespace tubule::surface3d
