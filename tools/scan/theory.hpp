// Closed-form thresholds drawn over a map: functions of a case that vanish on a line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/case/problem.hpp"
#include "tools/scan/description.hpp"

namespace tubule {

struct Threshold {
    std::string name;                                  // of its group in the file
    std::string label;                                 // in pictures
    std::optional<double> (*value)(const Problem& c);  // empty where it does not apply to the case
};

// All that are known: to add one, see theory.cpp.
const std::vector<Threshold>& thresholds();

// A threshold on a grid finer than that of the points: rows along the first axis, columns along the second.
struct ThresholdMap {
    std::string name, label;
    std::vector<double> first, second;  // values of the axes
    std::vector<double> values;         // row by row, exact beside the line; NaN where it does not apply
};

// For a grid with two axes of numbers, besides one of initial shapes: those that change their sign on it.
std::vector<ThresholdMap> threshold_maps(const Scan& scan);

}  // namespace tubule
