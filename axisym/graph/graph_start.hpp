// From a case to the profile to solve for: the cell, the first mesh.
#pragma once

#include <vector>

#include "axisym/graph/graph_forms.hpp"
#include "axisym/splines/spline_space.hpp"
#include "common/case/problem.hpp"

namespace tubule::axisym {

// The smallest part of the tube that determines it: a period divided by the common waves of its modes,
// halved if the modes are even about a plane. The flow keeps both symmetries exactly, and so does the
// reduced problem. With `symmetry` off: the whole period.
Cell cell_of(const Tube& tube, bool symmetry);

// Elements such that the energy lost to the spline (the defect of Forms::observe) is about `target`, judging by the
// present mesh: sizes follow the local need and grow by at most a fixed ratio. At least `fewest`, and with the same
// grading at most `most`.
std::vector<double> adapted_breaks(const SplineSpace& space, const std::vector<double>& defect, double target,
                                   int fewest, int most);

// The same by division of the present elements: the new space contains the old one. Ends early, before the end of the
// cell, where there would be more than `most`.
std::vector<double> refined_breaks(const SplineSpace& space, const std::vector<double>& defect, double target,
                                   int most);

// The defect of each element that the flow from x will soon develop: the largest over x itself and single
// linearly implicit Euler steps from it, whose sizes span six decades up to `span`. A start is often smooth and
// grows its sharpest features within its first instants.
std::vector<double> foreseen_defect(const Forms& forms, const Eigen::VectorXd& x, double span);

// Breaks of n equal elements.
std::vector<double> uniform_breaks(const Cell& cell, int n);

}  // namespace tubule::axisym
