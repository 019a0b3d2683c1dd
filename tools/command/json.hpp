// JSON, its names in the order in which they are given. Numbers that are not finite become null.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/result/result.hpp"

namespace tubule {

using Json = nlohmann::ordered_json;

template <class T>
Json or_null(const std::optional<T>& value) {
    return value ? Json(*value) : Json();
}
inline Json or_null(const std::string& text) {
    return text.empty() ? Json() : Json(text);
}

inline Json json_value(const Value& value) {
    return std::visit([](const auto& v) { return Json(v); }, value);
}
template <class T>
Json json_value(const T& value) {
    return value;
}
template <class T>
Json json_object(const std::vector<std::pair<std::string, T>>& entries) {
    Json out = Json::object();
    for (const auto& [name, value] : entries) out[name] = json_value(value);
    return out;
}

template <class T, class Make>
Json json_list(const std::vector<T>& items, const Make& json_of_item) {
    Json out = Json::array();
    for (const T& item : items) out.push_back(json_of_item(item));
    return out;
}

// A line of text. Names of files can hold any bytes: those that are not UTF-8 are replaced.
// -0 becomes 0.
std::string line_of(Json json);

}  // namespace tubule
