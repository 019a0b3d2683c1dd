// A command across the processes of an mpirun.
#pragma once

#include <functional>

#include "tools/scan/ranks.hpp"

namespace tubule {

// Runs `root` on rank 0, with the ranks or, if this process runs by itself, without; `serve` on the others. The exit
// status. What `root` throws before it hands out work ends the others; CaseErrors go on to the caller.
int run_ranked(const std::function<int(Ranks*)>& root, const std::function<void(Ranks&)>& serve);

// For `root`, after an interrupt: ends the other ranks, whatever they are doing.
[[noreturn]] void abort_interrupted(Ranks& ranks);

}  // namespace tubule
