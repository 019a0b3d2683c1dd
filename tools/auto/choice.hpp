// Tier "auto": which tier a start needs, and what the run of it in each tier is.
#pragma once

#include <string>
#include <vector>

#include "common/case/case.hpp"

namespace tubule {

struct Choice {
    bool axisymmetric = true;
    std::string reason;  // in words
};

// By the start alone: all models are axisymmetric, and so are all velocities to start with. Throws CaseError where a
// result that the case starts from cannot be read.
Choice choice_for(const Case& c);

// The case in tier axisym until `end`, with these output times.
Case axisym_case(const Case& c, double end, std::vector<double> output);
// The case in tier surface3d.
Case surface_case(const Case& c);

}  // namespace tubule
