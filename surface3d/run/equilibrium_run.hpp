// A case with [equilibrium] of tier "surface3d": a stationary surface as rows and frames of a result.
#pragma once

#include <string>
#include <vector>

#include "common/run/run_observer.hpp"
#include "surface3d/run/start.hpp"

namespace tubule::surface3d {

// What a row holds, "time" first.
std::vector<std::string> equilibrium_series_names(const Problem& c);

// Throws CaseError for constraints that the initial shape contradicts or that no shape meets.
void check_equilibrium(const Problem& c, const Start& start);

// One row and one frame, numbered instead of by time. Throws as check_equilibrium().
RunSummary run_equilibrium(const Problem& c, const Start& start, RunObserver& observer);

}  // namespace tubule::surface3d
