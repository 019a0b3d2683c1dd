// What surprises people in cases that are valid, and in results of runs that went well: physics, not mistakes.
#pragma once

#include <string>
#include <vector>

#include "common/case/problem.hpp"
#include "common/run/run.hpp"

namespace tubule {

// Each with its place, for `check`, and for `run` before anything is computed.
std::vector<std::string> physics_notes(const Problem& c);

// What a large residual of the energy balance means, the largest of the run; else empty.
std::string balance_warning(const Problem& c, const RunSummary& summary, double identity_defect);

}  // namespace tubule
