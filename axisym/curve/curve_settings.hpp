// The resolution of a run of a curve, and the pairs of runs that estimate its error.
#pragma once

#include "common/case/case.hpp"

namespace tubule::axisym {

constexpr int first_curve_elements = 12;  // of one cell

struct CurveSettings {
    int elements = 0;         // requested, of one cell; there are more at seams
    double tolerance = 0;     // of the time integrator
    int pair = 1;             // its number
    bool is_coarser = false;  // of its pair; else it is the run that is reported
};

// The finer run of the first pair: what the case gives, or what its accuracy asks for. The case's elements are those of
// all `images` of the cell.
CurveSettings first_settings(const Case& c, int images);
bool settings_given(const Case& c);

// The first step of the integrator relative to what the start asks for, and how much longer than the last one a step
// may be. A run of short duration takes all its steps as fast as they may grow, whatever its tolerance: only if they
// grow differently do the runs of a pair have different errors.
double first_step_of(const CurveSettings& s);
double step_growth_of(const CurveSettings& s);

// Of the other run of a pair.
CurveSettings coarser(const CurveSettings& s);

// Of the next pair, after one whose runs differed `excess` times more than asked.
CurveSettings finer(const CurveSettings& s, double excess);

// Whether another pair is worth a try.
bool can_be_finer(const CurveSettings& s);

}  // namespace tubule::axisym
