#pragma once

#include <cmath>
#include <stdexcept>
#include <string>

#include "tools/compare/surface.hpp"

namespace tubule::compare {

// Throws std::invalid_argument unless both are closed, or tubes of one period.
inline void require_same_kind(const Surface& a, const Surface& b) {
    const auto words = [](const Surface& s) {
        return s.period() > 0 ? "a tube of period " + std::to_string(s.period()) : std::string("a closed surface");
    };
    if (std::abs(a.period() - b.period()) > 1e-9 * a.period())
        throw std::invalid_argument("one is " + words(a) + ", the other is " + words(b));
}

}  // namespace tubule::compare
