// A case of tier "surface3d": the geometry, curvature and energies of its shape.
#pragma once

#include <string>
#include <vector>

#include "common/case/case.hpp"
#include "common/result/run.hpp"

namespace tubule::surface3d {

// Names of the series a run of this case writes, "time" first.
std::vector<std::string> series_names(const Case& c);

// Throws CaseError where the shape of the case cannot be meshed, for then nothing should be written.
void check_start(const Case& c);

// One row and one frame. The triangles are those of the case; where it leaves their number open, they become more until
// the energy is as accurate as asked. What the geometry does (elements that fold, curvatures of no surface) is reported
// in the summary; throws as check_start.
RunSummary run(const Case& c, RunObserver& observer);

}  // namespace tubule::surface3d
