// Text for a terminal or a file, put together piece by piece.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iterator>
#include <new>
#include <string>
#include <utility>
#include <variant>

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

// What is wrong with a number of the command line: nothing, unless it is infinite or none.
inline std::string refuse_infinite(const std::string& number) {
    return std::isfinite(std::strtod(number.c_str(), nullptr)) ? "" : number + " is not a finite number";
}

inline std::string text_of(const Value& value) {
    return std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
}

}  // namespace tubule
