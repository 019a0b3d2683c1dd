// A case of tier "axisym", from its start to its stop.
#pragma once

#include <string>
#include <vector>

#include "common/case/problem.hpp"
#include "common/result/record.hpp"
#include "common/run/run_observer.hpp"

namespace tubule::axisym {

// Names of the series a run of this case writes, "time" first.
std::vector<std::string> series_names(const Problem& c);

// Throws std::runtime_error if a run cannot resume from the record.
void check_restart(const Record& record);

// Tubes in gradient flow are computed as graphs r(z), from the beginning as curves if one overhangs; all else as
// curves. Runs the case, from `restart` (a frame or checkpoint of the same case) if given. What the physics or the
// numerics do is reported in the summary, never thrown; an unusable initial shape throws std::runtime_error.
RunSummary run_profile(const Problem& c, RunObserver& observer, const Restart* restart = nullptr);

}  // namespace tubule::axisym
