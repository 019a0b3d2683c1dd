// What is best chosen for a case in motion, and why: docs/choosing.md.
#pragma once

#include <optional>
#include <string>

#include "common/case/problem.hpp"
#include "tools/run/forecast.hpp"

namespace tubule {

struct Advice {
    std::string tier, model;        // as in case files
    std::optional<int> elements;    // discretisation.elements; none: none need to be given
    double accuracy = 0;            // that the case requests
    std::optional<double> seconds;  // at this accuracy; none: unknown
    std::string reason;             // in words
};

// Takes a few seconds at most: the run itself, in tier axisym, and those of simpler models. `expected` is the
// forecast for the case as it is. None where nothing moves. Throws as an engine and its run; Paused where a PauseWatch
// in this thread ends one of them.
std::optional<Advice> advice(const Problem& c, const Forecast& expected);

// "tier axisym, model overdamped, accuracy 1e-06: some 0.1 s; ...", "tier surface3d, model stokes, 80 elements, ..."
std::string words(const Advice& a);

}  // namespace tubule
