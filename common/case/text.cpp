#include "common/case/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <stdexcept>

namespace tubule {

namespace {

// What it takes to turn a into b: 1 for swapping neighbours, the most common typo, and 2 for inserting, deleting
// or replacing a letter. Letter case does not matter.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
    const auto same = [&](std::size_t i, std::size_t j) {
        return std::tolower(static_cast<unsigned char>(a[i])) == std::tolower(static_cast<unsigned char>(b[j]));
    };
    for (std::size_t i = 0; i <= a.size(); ++i) {
        for (std::size_t j = 0; j <= b.size(); ++j) {
            if (i == 0 || j == 0) {
                d[i][j] = 2 * (i + j);
                continue;
            }
            d[i][j] = std::min({d[i - 1][j] + 2, d[i][j - 1] + 2, d[i - 1][j - 1] + (same(i - 1, j - 1) ? 0 : 2)});
            if (i > 1 && j > 1 && same(i - 1, j - 2) && same(i - 2, j - 1))
                d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    }
    return d[a.size()][b.size()];
}

}  // namespace

std::string toml_string(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (c == '"' || c == '\\')
            result += {'\\', c};
        else if (byte < 0x20 || byte == 0x7f)
            result += fmt::format("\\u{:04x}", byte);
        else
            result += c;
    }
    return result + '"';
}

namespace {

// The text with something else for each byte that is not part of a UTF-8 character.
template <class Else>
std::string in_utf8(std::string_view text, const Else& other) {
    std::string valid;
    for (std::size_t i = 0; i < text.size();) {
        const auto byte = [&](std::size_t k) {
            return i + k < text.size() ? static_cast<unsigned char>(text[i + k]) : 0;
        };
        const unsigned first = byte(0), second = byte(1);
        std::size_t length = first < 0x80   ? 1
                             : first < 0xc2 ? 0
                             : first < 0xe0 ? 2
                             : first < 0xf0 ? 3
                             : first < 0xf5 ? 4
                                            : 0;
        for (std::size_t k = 1; k < length; ++k)
            if ((byte(k) & 0xc0) != 0x80) length = 0;
        // Longer than needed, half of a surrogate pair, or beyond the last character.
        if ((first == 0xe0 && second < 0xa0) || (first == 0xed && second >= 0xa0) || (first == 0xf0 && second < 0x90) ||
            (first == 0xf4 && second >= 0x90))
            length = 0;
        valid += length > 0 ? std::string(text.substr(i, length)) : other(first);
        i += std::max<std::size_t>(length, 1);
    }
    return valid;
}

}  // namespace

std::string valid_utf8(std::string_view text) {
    return in_utf8(text, [](unsigned) { return "?"; });
}

std::string printable(std::string_view text) {
    const auto escaped = [](unsigned byte) { return fmt::format("\\x{:02x}", byte); };
    std::string out;
    for (const char c : in_utf8(text, escaped)) {
        const auto byte = static_cast<unsigned char>(c);
        out += (byte < 0x20 && c != '\n') || byte == 0x7f ? escaped(byte) : std::string(1, c);
    }
    return out;
}

std::string_view no_plain_text(std::string_view bytes) {
    using namespace std::literals;
    if (bytes.starts_with("PK\x03\x04")) return "a zip archive, such as a spreadsheet";
    if (bytes.starts_with("\x89HDF")) return "an HDF5 file, such as a result";
    if (bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff") ||
        bytes.substr(std::min<std::size_t>(1, bytes.size())).starts_with("\0"sv))
        return "text in UTF-16";
    const auto has_line = [&](std::string_view word) {
        const std::size_t at = bytes.find(word);
        return at != bytes.npos && (at == 0 || bytes[at - 1] == '\n') &&
               bytes.substr(at + word.size()).starts_with("\n");
    };
    if (has_line("vertices") && has_line("edges")) return "a file of Surface Evolver (meshes come in by shape.kind = \"file\", as OBJ, OFF, PLY or STL)";
    return bytes.find('\0') != bytes.npos ? "binary" : "";
}

std::vector<std::string> split(std::string_view text, char separator) {
    std::vector<std::string> parts(1);
    for (const char c : text) {
        if (c == separator)
            parts.emplace_back();
        else
            parts.back() += c;
    }
    return parts;
}

std::optional<double> number_of(std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
    return value;
}

std::vector<double> NumberRange::evenly() const {
    std::vector<double> out;
    for (std::size_t i = 0; i < n; ++i)
        out.push_back(lo + (hi - lo) * static_cast<double>(i) / static_cast<double>(n - 1));
    out.back() = hi;
    return out;
}

NumberRange parse_range(const std::string& text, std::size_t most, bool may_be_logarithmic) {
    const auto refuse = [](const std::string& why) { throw std::invalid_argument(why); };
    const std::vector<std::string> parts = split(text, ':');
    if (parts.size() < 3 || parts.size() > (may_be_logarithmic ? 4 : 3)) refuse("not a range");
    const auto lo = number_of(parts[0]), hi = number_of(parts[1]), count = number_of(parts[2]);
    if (!lo || !hi || !count) refuse("not a number");
    if (*count != std::floor(*count) || *count < 2) refuse(fmt::format("{} values", parts[2]));
    if (*count > static_cast<double>(most)) refuse(fmt::format("more than {} values", most));
    if (!(*hi > *lo)) refuse(fmt::format("the range is empty: {} is not above {}", parts[1], parts[0]));
    const bool logarithmic = parts.size() == 4;
    if (logarithmic && parts[3] != "log") refuse(fmt::format("'{}' is not 'log'", parts[3]));
    if (logarithmic && !(*lo > 0)) refuse("a logarithmic range must begin above 0");
    return {*lo, *hi, static_cast<std::size_t>(*count), logarithmic};
}

std::optional<std::size_t> list_index(std::string_view text) {
    const bool digits = std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c); });
    if (text.empty() || text.size() > 6 || !digits) return {};
    return std::stoul(std::string(text));
}

std::optional<std::string> near_miss(std::string_view word, const std::vector<std::string>& names) {
    std::optional<std::string> nearest;
    std::size_t smallest = 0;
    for (const std::string& name : names) {
        const auto [shorter, longer] = std::minmax({word.size(), name.size()});
        const std::size_t most = 2 * std::max<std::size_t>(1, longer / 3);
        if (word.empty() || 2 * (longer - shorter) > most) continue;  // the distance is no less
        const std::size_t distance = edit_distance(word, name);
        if (distance > most) continue;
        if (!nearest || distance < smallest) nearest = name, smallest = distance;
    }
    return nearest;
}

std::string meant_by(std::string_view word, const std::vector<std::string>& names) {
    const auto near = near_miss(word, names);
    return near ? fmt::format("; did you mean '{}'?", *near) : "";
}

}  // namespace tubule
