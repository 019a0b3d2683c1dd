// A case of tier "axisym" whose profile is a graph r(z): the gradient flow of tubes, in its fastest form.
#pragma once

#include "axisym/graph/graph_output.hpp"
#include "common/run/run_observer.hpp"

namespace tubule::axisym {

// As run_profile(); stops with `overhang` where the profile gets a vertical tangent. The run carries its error along
// (carried_error.hpp); where that exceeds the accuracy asked, it starts again with finer settings.
RunSummary run_graph(const Problem& c, RunObserver& observer, const Record* restart = nullptr);

}  // namespace tubule::axisym
