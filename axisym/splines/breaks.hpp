// Where the elements of a profile meet.
#pragma once

#include <vector>

#include "axisym/splines/spline_space.hpp"

namespace tubule::axisym {

// Breaks of n equal elements of a cell, or of [0, 1].
std::vector<double> equal_breaks(int n, const Cell& cell = {});

// Breaks of n elements that share alike what is counted up to each place, ascending and linear in between; `count`
// begins at 0.
std::vector<double> equal_shares(const std::vector<double>& places, const std::vector<double>& count, int n);

// The same grading with another number of elements.
std::vector<double> regraded(const std::vector<double>& breaks, int elements);

// Breaks of [0, 1] with the seams (fractions, ascending) among them, and elements of size `smallest` at a seam that
// grow by `growth` per distance up to `largest`.
std::vector<double> graded_breaks(const std::vector<double>& seams, double largest, double smallest,
                                  double growth = 0.4);

}  // namespace tubule::axisym
