// Which tier a case of tier "auto" begins in, and on how many triangles.
#pragma once

#include <optional>
#include <string>

#include "common/case/problem.hpp"
#include "surface3d/run/start.hpp"

namespace tubule {

struct Choice {
    bool axisymmetric = true;
    std::string reason;                     // in words
    std::optional<surface3d::Start> start;  // of a run in three dimensions
};

// By the start alone: all models are axisymmetric, and so are all velocities to start with. Throws CaseError where a
// result that the case starts from cannot be read, or a start in three dimensions cannot be meshed.
Choice choice_for(const Problem& c);

// Whether 80 triangles are enough, fewer than runs begin with: a smooth start, little accuracy, and no mesh of its own
// or by the case.
bool few_triangles_do(const Problem& c, const surface3d::Start& start);

}  // namespace tubule
