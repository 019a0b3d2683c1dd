#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "surface3d/import/import_formats.hpp"

namespace tubule::surface3d {

namespace {

// Words as messages show them, shortened if they are long.
std::string shown(std::string_view text) {
    return std::string(text.substr(0, 40)) + (text.size() > 40 ? "..." : "");
}

template <class T>
bool parse(std::string_view text, T& value) {
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
}

bool is_space(char c) {
    return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

}  // namespace

void refuse_at(const std::string& name, const Place& place, const std::string& message) {
    throw MeshError(place.line == 0 ? fmt::format("{}: byte {}: {}", name, place.byte, message)
                                    : fmt::format("{}:{}:{}: {}", name, place.line, place.column, message));
}

TextReader::TextReader(std::string name, std::string_view text, char comment)
    : name_(std::move(name)), text_(text), comment_(comment) {
    if (text_.starts_with("\xEF\xBB\xBF")) position_ = 3;  // a byte order mark
}

bool TextReader::next_line() {
    words_.clear();
    next_ = 0;
    while (words_.empty() && position_ < text_.size()) {
        const std::size_t begin = position_;
        const std::size_t end = std::min(text_.find_first_of("\r\n", begin), text_.size());
        position_ = std::min(end + (text_.substr(end, 2) == "\r\n" ? 2 : 1), text_.size());
        ++line_;
        for (std::size_t i = begin; i < end && !(comment_ && text_[i] == comment_);) {
            if (is_space(text_[i])) {
                ++i;
                continue;
            }
            std::size_t stop = i;
            while (stop < end && !is_space(text_[stop]) && !(comment_ && text_[stop] == comment_)) ++stop;
            words_.push_back({text_.substr(i, stop - i), {line_, i - begin + 1, i}});
            i = stop;
        }
    }
    return !words_.empty();
}

Word TextReader::next_word(const std::string& what) {
    if (next_ == words_.size() && !next_line()) fail_end(what);
    return words_[next_++];
}

double TextReader::number(const Word& word) const {
    double value = 0;
    if (!parse(word.text, value)) {
        std::string dotted(word.text);
        std::ranges::replace(dotted, ',', '.');
        const bool comma = dotted != word.text && parse(dotted, value);
        fail(word, fmt::format("'{}' is not a number{}", shown(word.text),
                               comma ? fmt::format("; decimals have a point: {}", shown(dotted)) : ""));
    }
    if (!std::isfinite(value)) fail(word, fmt::format("'{}' is not a finite number", shown(word.text)));
    return value;
}

std::int64_t TextReader::integer(const Word& word) const {
    std::int64_t value = 0;
    if (!parse(word.text, value)) fail(word, fmt::format("'{}' is not an integer", shown(word.text)));
    return value;
}

Eigen::Vector3d TextReader::point(std::size_t first_word) const {
    if (words_.size() < first_word + 3) fail_line("a point needs three coordinates");
    return {number(words_[first_word]), number(words_[first_word + 1]), number(words_[first_word + 2])};
}

void TextReader::fail(const Word& word, const std::string& message) const {
    std::string printable = message;  // it may quote any byte of the file
    for (char& c : printable) {
        if (c < ' ' || c > '~') c = '?';
    }
    refuse_at(name_, word.place, printable);
}

void TextReader::fail_line(const std::string& message) const {
    fail(words_.front(), message);
}

void TextReader::fail_end(const std::string& what) const {
    refuse_at(name_, {line_ + 1, 1, text_.size()}, "the file ends; expected " + what + "; is it complete?");
}

bool is_keyword(std::string_view word, std::string_view lower) {
    return std::equal(word.begin(), word.end(), lower.begin(), lower.end(),
                      [](char a, char b) { return (a >= 'A' && a <= 'Z' ? char(a + ('a' - 'A')) : a) == b; });
}

}  // namespace tubule::surface3d
