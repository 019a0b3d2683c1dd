// Small helpers for the words of case files.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tubule {

// A TOML basic string, quotes included, that reads back as `text`.
std::string toml_string(std::string_view text);

// The text with '?' for every byte that is not part of a UTF-8 character: names of files can hold any bytes.
std::string valid_utf8(std::string_view text);

// The text with what no terminal should be given, control characters and bytes that are no UTF-8, as "\\x1b".
std::string printable(std::string_view text);

// What bytes are that are no plain text, in words; else empty.
std::string_view no_plain_text(std::string_view bytes);

// "a.b" gives {"a", "b"}; "" gives {""}.
std::vector<std::string> split(std::string_view text, char separator);

// All of the text as a finite number, if it is one.
std::optional<double> number_of(std::string_view text);

// The n numbers of "lo:hi:n", or of "lo:hi:n:log", which have equal ratios.
struct NumberRange {
    double lo = 0, hi = 1;
    std::size_t n = 2;
    bool logarithmic = false;

    std::vector<double> evenly() const;
};
// Throws std::invalid_argument with what is wrong, such as "not a range".
NumberRange parse_range(const std::string& text, std::size_t most, bool may_be_logarithmic = false);

// The key of an override, "key=value".
inline std::string key_of(const std::string& set) {
    return set.substr(0, set.find('='));
}

// The position in a list that `text` stands for ("0", "1", ...), if it does.
std::optional<std::size_t> list_index(std::string_view text);

// The name that `word` most likely meant: letter case aside, a letter missing, extra, wrong or swapped
// with its neighbour, up to one in every three. Empty when none is near.
std::optional<std::string> near_miss(std::string_view word, const std::vector<std::string>& names);
// "; did you mean 'name'?", or empty.
std::string meant_by(std::string_view word, const std::vector<std::string>& names);

}  // namespace tubule
