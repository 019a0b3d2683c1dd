// `tubule compare` of results that are at hand.
#pragma once

#include <string>
#include <vector>

#include "common/result/result.hpp"

namespace tubule {

// As the command line has them.
struct CompareOptions {
    std::vector<std::string> results, tolerances, frames, pictures;  // of `results`, the names
    bool align = false, no_shapes = false, csv = false, json = false;
};

// The answer as JSON, docs/schemas/compare.json. Throws std::invalid_argument for what cannot be compared.
std::string comparison_json(const CompareOptions& options, const Result& a, const Result& b);

}  // namespace tubule
