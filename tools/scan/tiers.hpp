// A case handed to the tier it names.
#pragma once

#include <string>
#include <vector>

#include "common/case/case.hpp"
#include "common/result/run.hpp"
#include "surface3d/run/run.hpp"

namespace tubule {

// Names of the series a run of this case writes, "time" first.
std::vector<std::string> series_names(const Case& c);

// Throws CaseError where the shape of the case cannot be meshed, or the result that it starts from cannot be read.
void check_start(const Case& c);

// Throws std::runtime_error where a run of the case cannot go on from this record, as one of another version.
void check_restart(const Case& c, const Record& record);

// Runs the case, or goes on from `restart`, of the file `unfinished` (which tier "auto" needs). Throws as the tier's
// own run.
RunSummary run_tier(const Case& c, RunObserver& observer, const surface3d::Restart* restart = nullptr,
                    const Result* unfinished = nullptr);

}  // namespace tubule
