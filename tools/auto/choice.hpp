// Tier "auto": which tier a start needs, and what the run of it in each tier is.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/case/case.hpp"
#include "surface3d/run/start.hpp"

namespace tubule {

struct Choice {
    bool axisymmetric = true;
    std::string reason;                     // in words
    std::optional<surface3d::Start> start;  // of a run in three dimensions
};

// By the start alone: all models are axisymmetric, and so are all velocities to start with. Throws CaseError where a
// result that the case starts from cannot be read, or a start in three dimensions cannot be meshed.
Choice choice_for(const Case& c);

// Whether 80 triangles are enough, fewer than runs begin with: a smooth start, little accuracy, and no mesh of its own or
// by the case.
bool few_triangles_do(const Case& c, const surface3d::Start& start);

// The case in tier axisym until `end`, with these output times.
Case axisym_case(const Case& c, double end, std::vector<double> output);
// The case in tier surface3d.
Case surface_case(const Case& c);

}  // namespace tubule
