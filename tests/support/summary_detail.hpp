// What a summary says of its run under this name. std::out_of_range if it does not.
#pragma once

#include <stdexcept>
#include <string>
#include <variant>

#include "common/run/run_observer.hpp"

namespace tubule {

template <class Type = std::int64_t>
Type detail(const RunSummary& s, const std::string& name) {
    for (const auto& [key, value] : s.details)
        if (key == name) return std::get<Type>(value);
    throw std::out_of_range("no detail " + name);
}

}  // namespace tubule
