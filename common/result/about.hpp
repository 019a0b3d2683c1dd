// What a result says about its run.
#pragma once

#include <algorithm>
#include <string_view>
#include <variant>

#include "common/result/result.hpp"

namespace tubule {

// What /about says by this name; nullptr if it says nothing, or something of another type.
template <class T>
const T* find_value(const About& about, std::string_view name) {
    const auto found = std::ranges::find(about, name, [](const auto& entry) { return std::string_view(entry.first); });
    return found == about.end() ? nullptr : std::get_if<T>(&found->second);
}

// Adds `more`, which replaces what was said by the same names.
inline void update(About& about, const About& more) {
    for (const auto& [name, value] : more) {
        const auto same = std::ranges::find(about, name, [](const auto& entry) { return entry.first; });
        if (same != about.end())
            same->second = value;
        else
            about.emplace_back(name, value);
    }
}

}  // namespace tubule
