// Closed-form thresholds drawn over a map: functions of a case that vanish on a line.
#pragma once

#include <string>
#include <vector>

#include "tools/scan/description.hpp"

namespace tubule {

// A threshold on a grid finer than that of the points: rows along the first axis, columns along the second.
struct ThresholdMap {
    std::string name, label;            // of its group in the file; in pictures
    std::vector<double> first, second;  // values of the axes
    std::vector<double> values;         // row by row, exact beside the line; NaN where it does not apply
};

// For a grid with two axes of numbers, besides one of initial shapes: those that change their sign on it.
std::vector<ThresholdMap> threshold_maps(const Scan& scan);

}  // namespace tubule
