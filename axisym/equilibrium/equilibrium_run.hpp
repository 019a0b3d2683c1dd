// A case with [equilibrium]: a stationary shape, or a branch of them, as rows and frames of a result.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axisym/equilibrium/mode_stability.hpp"
#include "common/case/problem.hpp"
#include "common/run/run_observer.hpp"
#include "common/theory/vesiculation.hpp"

namespace tubule::axisym {

// What a row of an equilibrium or a branch holds, "time" first.
std::vector<std::string> equilibrium_series_names(const Problem& c);

// Throws CaseError for an initial shape that cannot be set up, and for constraints that cannot be met.
void check_equilibrium(const Problem& c);

// One row and one frame for each shape, numbered from 0 instead of by time: a single shape, or those of the
// branch at its steps, its folds and its bifurcations, in order. Throws as check_equilibrium().
RunSummary run_equilibrium(const Problem& c, RunObserver& observer);

// The shape of a case without a branch, with the growth rates of its modes, and nothing written.
struct CaseShape {
    Equilibrium shape;
    std::vector<ModeRates> modes;             // of a shape that was found, if asked for
    std::optional<theory::LimitShape> limit;  // of a cell whose area and volume are held
    std::optional<double> force;              // as the series of that name, where there is one
    bool meets_constraints;                   // area and volume to a percent, of a last state, too
};
CaseShape find_shape(const Problem& c, RunObserver& observer);

}  // namespace tubule::axisym
