// Which points of a scan are worth a run in three dimensions.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "tools/scan/outcome.hpp"

namespace tubule::confirm {

enum class Why { boundary, extreme, random };
std::string_view name(Why why);

struct Pick {
    std::size_t point = 0;
    Why why = Why::random;
};

// At most `count` points that were run and did not fail, of a grid of this shape: half of them both sides of lines
// between outcomes (pairs of outcomes that are not there yet first, then far from those that are), a quarter corners of
// the grid, the rest at random. If one kind has too few, the next gets more. The same seed picks the same points.
std::vector<Pick> pick_points(const std::vector<std::size_t>& shape, const std::vector<Outcome>& outcomes,
                              std::optional<Outcome> around, std::size_t count, unsigned seed);

}  // namespace tubule::confirm
