// The resolution of a run of a curve, and the pairs of runs that estimate its error.
#pragma once

#include "axisym/curve/element_density.hpp"
#include "common/case/problem.hpp"

namespace tubule::axisym {

constexpr int first_curve_elements = 12;  // of one cell

struct CurveSettings {
    int elements = 0;             // requested, of one cell; there are more at seams
    double tolerance = 0;         // of the time integrator
    int pair = 1;                 // its number
    bool is_coarser = false;      // of its pair; else it is the run that is reported
    ElementDensity density = {};  // where the pair before needed more
    double excess = 1e300;        // error of the pair before, of what was asked; large where it is not known
};

// The finer run of the first pair: what the case gives, or what its accuracy asks for. The case's elements are those of
// all `images` of the cell.
CurveSettings first_settings(const Problem& c, int images);

// The first step relative to what the initial state requires, and the largest ratio of a step to the last. A short run
// takes all steps as fast as they may grow. With equal growth both runs of a pair would have the same error and differ
// by nothing: the coarser one begins with a step four times as long, and grows by 8 instead of 2.
double first_step_factor(const CurveSettings& s);
double step_growth_of(const CurveSettings& s);

// Settings of the other run of a pair.
CurveSettings coarser(const CurveSettings& s);

// Factor of the elements after a pair whose error was `excess` times what was asked; or, where the loss to the mesh is
// known, `excess_of_mesh` times what is allowed. Unless error_falls, smaller steps did not help: then at least 1.5.
double mesh_growth(double excess);
double mesh_growth(double excess_of_mesh, bool error_falls);
// The next pair: a tenth of the tolerance, and `mesh` times as many elements.
CurveSettings finer(const CurveSettings& s, double mesh);

// Whether another pair is worth a try.
bool can_be_finer(const CurveSettings& s);

}  // namespace tubule::axisym
