// The surface that a frame of a result holds.
#pragma once

#include <memory>

#include "common/result/result.hpp"
#include "tools/compare/surface.hpp"

namespace tubule::compare {

// Throws std::invalid_argument if it has none, or a damaged one.
std::unique_ptr<Surface> frame_surface(const Record& frame, const Result& result);

}  // namespace tubule::compare
