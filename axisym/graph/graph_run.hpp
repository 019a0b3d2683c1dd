// A case of tier "axisym" whose profile is a graph r(z): the gradient flow of tubes, at its quickest.
#pragma once

#include <string>
#include <vector>

#include "axisym/run.hpp"

namespace tubule::axisym {

std::vector<std::string> graph_series_names(const Case& c);

// As run(); stops with `overhang` where the profile gets a vertical tangent.
RunSummary run_graph(const Case& c, RunObserver& observer, const Record* restart = nullptr);

}  // namespace tubule::axisym
