// What a case may have that makes no sense or surprises: an energy that does not resist short waves, so that there is
// no flow to compute; physics, not mistakes, in valid cases and in results of runs that went well.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/case/problem.hpp"
#include "common/case/read.hpp"
#include "common/run/run_observer.hpp"

namespace tubule {

// Why a run ends as ill-posed at once, with the place of the modulus to blame, where that is certain: by the
// curvatures of the shape itself, not of a mesh. Or where the formula of the energy has no value on the initial shape.
// Empty for all other cases, among them surfaces of given triangles, frames of results and an H0 that varies: their
// runs find out.
std::optional<CaseError> ill_posed_start(const Problem& c);

// In words, what to do about it.
CaseError ill_posed_complaint(const Problem& c, const std::string& outcome, const std::string& why);

// What surprises people in cases that are valid: each with its place, for `check`, and for `run` before anything is
// computed.
std::vector<std::string> physics_notes(const Problem& c);

// What a large residual of the energy balance means, the largest of the run; else empty.
std::string balance_warning(const Problem& c, const RunSummary& summary, double identity_defect);

}  // namespace tubule
