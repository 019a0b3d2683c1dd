// A case of tier "surface3d": the motion of its shape, or its geometry, curvature and energies.
#pragma once

#include <string>
#include <vector>

#include "common/case/problem.hpp"
#include "common/run/run_observer.hpp"
#include "surface3d/run/motion_run.hpp"

namespace tubule::surface3d {

// Names of the series a run of this case writes, "time" first.
std::vector<std::string> series_names(const Problem& c);

// A motion: motion_run.hpp. Else a single surface, from its beginning: single_surface.hpp. `start` is that of the case.
// What the geometry does (elements that fold, curvatures of no surface) is reported in the summary.
RunSummary run_surface(const Problem& c, const Start& start, RunObserver& observer, const Restart* restart = nullptr);

// As above, with Start(c). Throws as Start.
RunSummary run_surface(const Problem& c, RunObserver& observer, const Restart* restart = nullptr);

}  // namespace tubule::surface3d
