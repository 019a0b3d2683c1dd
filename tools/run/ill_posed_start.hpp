// Cases whose energy does not resist short waves at the start: there is no flow to compute.
#pragma once

#include <optional>
#include <string>

#include "common/case/problem.hpp"
#include "common/case/read.hpp"

namespace tubule {

// Why a run ends as ill-posed at once, with the place of the modulus to blame, where that is certain: by the
// curvatures of the shape itself, not of a mesh. Or where the formula of the energy has no value on the initial shape.
// Empty for all other cases, among them surfaces of given triangles, frames of results and an H0 that varies: their
// runs find out.
std::optional<CaseError> ill_posed_start(const Problem& c);

// In words, what to do about it.
CaseError ill_posed_complaint(const Problem& c, const std::string& outcome, const std::string& why);

}  // namespace tubule
