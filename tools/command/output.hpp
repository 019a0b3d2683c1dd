// What commands print: text put together piece by piece, JSON, and the standard streams.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iterator>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "common/case/read.hpp"
#include "common/result/result.hpp"

namespace tubule {

using Text = fmt::memory_buffer;

// As people read it: -0 is 0.
inline double plain(double x) {
    return x + 0.0;
}
template <class T>
const T& plain(const T& x) {
    return x;
}

// Appends a formatted piece to a Text or a string, numbers as above.
template <class Out, class... Args>
void add(Out& out, fmt::format_string<Args...> format, Args&&... args) {
    fmt::vformat_to(std::back_inserter(out), format, fmt::make_format_args(plain(args)...));
}

// A field of CSV.
inline std::string quoted(const std::string& text) {
    std::string out = "\"";
    for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
    return out + '"';
}

// The words of an error, for people: those of the standard library are none.
inline std::string explanation(const std::exception& error) {
    if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&error))
        return fmt::format("{}: {}", file->path1().string(), file->code().message());
    if (dynamic_cast<const std::bad_alloc*>(&error)) return "out of memory";
    return error.what();
}

// What `f` returns; what it throws, as bad input: a file that cannot be read or written is.
template <class F>
auto as_bad_input(const F& f) {
    try {
        return f();
    } catch (const std::runtime_error& error) {
        throw CaseError(explanation(error));
    }
}

// What is wrong with a number of the command line: nothing, unless it is infinite or none.
inline std::string refuse_infinite(const std::string& number) {
    return std::isfinite(std::strtod(number.c_str(), nullptr)) ? "" : number + " is not a finite number";
}

inline std::string text_of(const Value& value) {
    return std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
}

// ---- JSON

// Its names are in the order in which they are given. Numbers that are not finite become null.
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

// These members of each row as a table, numbers in full precision; empty where there is null or nothing.
std::string csv_of(const std::vector<std::string>& columns, const Json& rows);

// A line of text. Names of files can hold any bytes: those that are not UTF-8 are replaced. -0 becomes 0.
std::string line_of(Json json);

// ---- streams

// To be called before anything else. Opens /dev/null where a standard stream is closed, since a file opened later would
// take its place and receive our messages. Ignores the signals by which a pipe without a reader and the limit on file
// sizes would end the process: the write that meets them fails instead.
void secure_streams();

// What a command was asked for could not be written: exit status 2.
struct OutputError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// What is wrong with a file, to stderr, with its name unless the words have it. Exit status 2.
int refuse_file(const std::string& file, const std::string& words);

// What a command was asked for, to stdout. Throws OutputError.
void print_answer(std::string_view text);

}  // namespace tubule
