// A case with [equilibrium]: a stationary shape, or a branch of them, as rows and frames of a result.
#pragma once

#include <string>
#include <vector>

#include "common/case/case.hpp"
#include "common/result/run.hpp"

namespace tubule::axisym {

std::vector<std::string> equilibrium_series_names(const Case& c);

// One row and one frame for each shape, numbered from 0 in place of a time: the one shape asked for; or those of the
// branch at its steps, its folds and its bifurcations, in order. A start that cannot be set up throws CaseError.
RunSummary run_equilibrium(const Case& c, RunObserver& observer);

}  // namespace tubule::axisym
