// Values as JSON text.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "common/result/result.hpp"

namespace tubule {

std::string json(const std::string& text);
std::string json(double value);  // the shortest that reads back the same; null unless finite
std::string json(std::int64_t value);
std::string json(int value);
std::string json(std::size_t value);
std::string json(const Value& value);

template <class T>
std::string json(const std::vector<T>& values) {
    std::string list = "[";
    for (const T& value : values) list += (list.size() > 1 ? ", " : "") + json(value);
    return list + "]";
}
template <class T>
std::string json(const std::vector<std::pair<std::string, T>>& entries) {
    std::string object = "{";
    for (const auto& [name, value] : entries)
        object += fmt::format("{}{}: {}", object.size() > 1 ? ", " : "", json(name), json(value));
    return object + "}";
}

}  // namespace tubule
