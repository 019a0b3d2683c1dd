// Runs of a moving surface: as accurate as asked in space and time, stopped where the results would be invalid.
#pragma once

#include <string>
#include <vector>

#include "common/case/problem.hpp"
#include "common/result/record.hpp"
#include "common/run/run_observer.hpp"
#include "surface3d/run/start.hpp"

namespace tubule::surface3d {

// Throws std::runtime_error if a run cannot resume from the record.
void check_restart(const Problem& c, const Record& record);

// Companions go along with each run, to estimate its error (CompanionRuns). Runs become finer until the energy is as
// accurate as asked at all times.
RunSummary run_motion(const Problem& c, const Start& start, RunObserver& observer, const Restart* restart);

}  // namespace tubule::surface3d
