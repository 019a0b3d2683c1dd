// A single surface that does not move: its geometry, curvature and energies.
#pragma once

#include <string>
#include <vector>

#include "common/case/problem.hpp"
#include "common/run/run_observer.hpp"
#include "surface3d/run/start.hpp"

namespace tubule::surface3d {

std::vector<std::string> single_series_names(const Problem& c);

// One row and one frame. The triangles are those of the case; where it leaves their number open, they become more until
// the energy is as accurate as asked.
RunSummary run_single(const Problem& c, const Start& start, RunObserver& observer);

}  // namespace tubule::surface3d
