// Runs that hand their result to the caller instead of a file.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "common/case/problem.hpp"
#include "common/result/result.hpp"

namespace tubule {

struct MemoryRunOptions {
    // Called at most ten times a second, from the thread of the run.
    std::function<void(double time, double energy, double step)> progress;
    std::function<bool()> interrupted = [] { return false; };  // called from any thread
    std::function<void(const std::string&)> note;              // what is worth knowing before the run is over
    // Also written there as it goes, as `tubule run` does; the result of another case is kept unless `overwrite`.
    std::optional<std::filesystem::path> output;
    bool overwrite = false;
};

// Runs a case of any tier, or finds its equilibria. Where the numerics fail the result has what was computed until
// then, and the stop says why. Throws CaseError for bad input, Paused at a start that is interrupted or out of time,
// and std::runtime_error where nothing could be computed or the output cannot be written.
Result run_in_memory(const Problem& c, const MemoryRunOptions& options);

}  // namespace tubule
