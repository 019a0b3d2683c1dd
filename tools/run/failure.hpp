// What is reported of a run that cannot go on for want of numbers: an exception, in the words of the case.
#pragma once

#include <exception>
#include <optional>

#include "common/case/problem.hpp"
#include "common/run/run.hpp"

namespace tubule {

// `reached`: the time of the last row; nothing if the run failed before its first.
StopReport failure_of(const Problem& c, const std::exception& error, std::optional<double> reached);
// The summary of a run that ended by it.
RunSummary failed_run(const Problem& c, const std::exception& error, std::optional<double> reached);

// Replaces the message of a run that failed where numbers of the case are so large or small that their powers and
// products need not be finite.
void blame_extreme_numbers(const Problem& c, StopReport& stop);

}  // namespace tubule
