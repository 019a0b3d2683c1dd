// How fine a run in motion is, and the pairs of runs that tell their error.
#pragma once

#include "common/case/case.hpp"

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
};

// The case's, or the default of its model.
Scheme time_scheme(const Case& c);

// What the case gives, or what its accuracy asks for.
MotionSettings first_settings(const Case& c);
bool settings_given(const Case& c);

// Of the other run of a pair.
MotionSettings coarser(const MotionSettings& s, Role role);

// Of the next pair, after one whose energies differ so much and whose balance is off so much, where less is asked; all
// absolute.
MotionSettings finer(const MotionSettings& s, double asked, double difference, double defect);

// Whether more triangles are worth a try.
bool can_be_finer(const MotionSettings& s);

}  // namespace tubule::surface3d
