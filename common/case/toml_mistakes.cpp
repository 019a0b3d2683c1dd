#include <fmt/format.h>

#include <algorithm>
#include <regex>
#include <vector>

#include "common/case/text.hpp"
#include "common/case/toml_input.hpp"

namespace tubule {
namespace {

constexpr std::size_t longest_line = 1000;  // longer ones are nobody's typing, and regular expressions are recursive

// A line that matches has this mistake, at the group of this number; $1, $2 ... in the words are its groups. The first
// that matches counts, so that narrow patterns come before wide ones. In lines, strings are blanked out: "____".
struct Rule {
    const char* pattern;
    int at;
    const char* words;
};
#define KEY R"(^\s*([A-Za-z0-9_.\-]+)\s*)"
#define NUMBER R"([+\-]?\d[\d.]*(?:[eE][+\-]?\d+)?)"
constexpr Rule rules[]{
    {R"(^\s*(```).*$)", 1, "leave out the lines ``` around a case that was copied"},
    {R"((?:^|\s)(//|/\*|%|--|\*\*\*).*$)", 1, "a comment begins with #"},
    {R"(^\s*([!;*]).*$)", 1, "a comment begins with #"},
    {R"(^\s*([{}]))", 1, "a case is written in TOML, not in JSON: a line [energy], then a line k20 = 0.5"},
    // Names of tables.
    {R"(^\s*(\[[^\]]*)$)", 1, "the name of a table ends with ], such as [shape]"},
    {R"(^\s*\[\[([^\[\]]*)\]\s*$)", 1, "the name of a list of tables has two brackets on both sides: [[$1]]"},
    {R"(^\s*\[[^\[\]]*\](\])\s*$)", 1, "the name of a table has as many ] as ["},
    {R"(^\s*\[\[?[^\[\]=]*\]\]?\s*(\S.*)$)", 1, "what follows the name of a table stands in a new line"},
    {KEY R"((\]+)\s*$)", 2, "the name of a table begins with [, such as [$1]"},
    // Keys.
    {KEY R"((:)\s*$)", 2, "the name of a table stands in brackets: [$1]"},
    {KEY R"((:=|==|=>|<-|:)\s*\S.*$)", 2, "a key and its value are joined by a single =, $1 = ..."},
    {R"([\{,]\s*([A-Za-z_]\w*)\s*(:)\s*)", 2, "a key and its value are joined by =, $1 = ..."},
    {R"(^\s*"_*"\s*(:))", 1, "a key and its value are joined by =, and a key needs no quotes: k20 = 0.5"},
    {KEY R"((=)?\s*$)", 1, "$1 has no value: $1 = and a value is needed"},
    {R"(^\s*(=))", 1, "a key is missing before ="},
    {R"(^\s*\S+(\s+)[^\s=][^=]*=.*$)", 1, "a key is one word, such as r_min"},
    {KEY R"(([^=]*)$)", 2, "between $1 and its value = is missing"},
    {R"(^[^\[\{=]*=[^\[\{=]*?([,;]?\s+|[,;])[A-Za-z_][\w.\-]*\s*=)", 1, "each key stands in a line of its own"},
    {R"(([,;])\s*$)", 1, "a line ends without $1"},
    // Numbers.
    {R"(=\s*()" NUMBER "(?::" NUMBER R"(){1,2})\s*$)", 1, "a range stands in quotes: \"$1\""},
    {R"([=\[,]\s*([+\-]?\d+),(\d+)\s*(?:\}|$))", 1, "decimals have a point, not a comma: $1.$2"},
    {R"(=\s*[\{(]?\s*()" NUMBER "(?:\\s*,\\s*" NUMBER R"()+)\s*[\})]?\s*$)", 1,
     "a list stands in square brackets: [$1]"},
    {R"([\[,][^\]=]*(;))", 1, "values of a list are separated by commas: [1, 2]"},
    {R"([=\[,]\s*([+\-]{2}|[+\-]?\d*\.\d*\.))", 1, "a number has one sign and one point"},
    {R"([=\[,]\s*[+\-]?[\d.]+([dD])[+\-]?\d)", 1, "the exponent of a number is written as e: 1e-3"},
    {R"([=\[,]\s*([+\-]?)(\.\d+))", 2, "a number begins with a digit: $010$2"},
    {R"([=\[,]\s*([+\-]?\d+)(\.)(?!\d))", 2, "digits follow the point of a number: $1.0"},
    {R"([\d.][eE][+\-]?\d*(\.|\s|$))", 1, "the exponent of a number is a whole number, as in 1e-3"},
    {R"([=\[,]\s*[+\-]?(0\d+))", 1, "a number has no zeros before it"},
    {R"(=\s*\S+\s+()" NUMBER R"()\s*$)", 1, "a value is one number: blanks are not part of it, and a list is [1, 2]"},
    {R"([=\[,]\s*)" NUMBER R"(\s*(\*\*|[*/^+\-])\s*[\w.(+\-])", 1,
     "a value is one number, nothing is computed; a formula, where one is allowed, stands in quotes"},
    {R"([=\[,]\s*([A-Za-z_]\w*)\()", 1,
     "a value is one number, nothing is computed; a formula, where one is allowed, stands in quotes"},
    {R"([=\[,]\s*(?:)" NUMBER R"(\s*)?(pi\b))", 1, "numbers are written as digits: pi is 3.141592653589793"},
    {R"([=\[,]\s*([+\-]?)([iI]nf(?:inity|\.)?|[nN]a[nN])\b)", 2, "a number must be finite: write it as digits"},
    {R"([=\[,]\s*)" NUMBER R"(\s*([^\s\d.,;:=#"'+\-*/^()\[\]\{\}\x01-\x1f]\S*)\s*$)", 1,
     "a number has no unit: all are dimensionless, but for texts such as \"50 nm\" in [units]"},
    {R"([=\[]\s*\[?\s*)" NUMBER R"((\s+))" NUMBER, 1, "numbers of a list are separated by commas: [1, 2]"},
    {R"([\[,]\s*(,))", 1, "between two commas a value is missing"},
    // Words.
    {R"(=\s*(\())", 1, "a value has no parentheses around it: a number is 0.5, a list [1, 2]"},
    {R"([=\[,]\s*(True|TRUE|[yY]es|[oO]n)\s*(?:[,\]\}]|$))", 1, "write true in small letters, without quotes: true"},
    {R"([=\[,]\s*(False|FALSE|[nN]o|[oO]ff)\s*(?:[,\]\}]|$))", 1,
     "write false in small letters, without quotes: false"},
    {R"([=\[,]\s*(None|none|null|NULL|nil)\s*(?:[,\]\}]|$))", 1, "there is no $1: leave the key out"},
    {R"([=\[,]\s*(?!(?:true|false)\s*[,\]\}])([A-Za-z_./~][^\s"'=,\[\]\{\}]*)\s*(?:[,\]\}]|$))", 1,
     "text stands in quotes: \"$1\""},
    {R"(=\s*([^\s"'\[\{\w+\-.]))", 1, "a value is a number, text in quotes, true, false, a list [1, 2] or a table"},
};
#undef KEY
#undef NUMBER

// Characters that look like those of TOML.
struct LookAlike {
    std::string_view character, words;
};
constexpr LookAlike look_alikes[]{
    {"\u201c", "quotes are straight: \"text\""},           {"\u201d", "quotes are straight: \"text\""},
    {"\u201e", "quotes are straight: \"text\""},           {"\u2018", "quotes are straight: \"text\""},
    {"\u2019", "quotes are straight: \"text\""},           {"\u00ab", "quotes are straight: \"text\""},
    {"\u00bb", "quotes are straight: \"text\""},           {"\u00b4", "quotes are straight: \"text\""},
    {"\u2212", "a minus is the sign - of a keyboard"},     {"\u2013", "a minus is the sign - of a keyboard"},
    {"\u00a0", "here is a no-break space: write a blank"}, {"\uff1d", "write the sign = of a keyboard"}};

bool begins_character(char c) {
    return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
}

std::size_t characters(std::string_view text) {
    return static_cast<std::size_t>(std::ranges::count_if(text, begins_character));
}

std::size_t line_of(std::string_view text, std::size_t at) {
    return 1 + static_cast<std::size_t>(std::ranges::count(text.substr(0, at), '\n'));
}

TomlMistake mistake_at(std::string_view text, std::size_t at, std::string words) {
    const std::size_t begin = at == 0 ? 0 : text.rfind('\n', at - 1) + 1;
    return {line_of(text, at), 1 + characters(text.substr(begin, at - begin)), std::move(words)};
}

// Brackets of values that are open before `at`, in order, and whether the outermost is closed later.
struct OpenBrackets {
    std::vector<std::size_t> open;
    bool is_closed = false;
};
OpenBrackets open_brackets(std::string_view text, std::size_t at) {
    OpenBrackets out;
    std::vector<std::size_t> open;
    bool begins_line = true;
    for (std::size_t i = 0; i < text.size();) {
        if (i >= at && out.open.empty()) out.open = open;
        if (i >= at && open.empty()) break;
        const char c = text[i];
        if (c == '#' || (open.empty() && c == '[' && begins_line)) {  // a comment, the name of a table
            i = std::min(text.find('\n', i), text.size());
            continue;
        }
        begins_line = c == '\n' || (begins_line && (c == ' ' || c == '\t'));
        if (c == '"' || c == '\'') {
            i = end_of_string(text, i);
            continue;
        }
        if (c == '[' || c == '{') open.push_back(i);
        if ((c == ']' || c == '}') && !open.empty()) open.pop_back();
        ++i;
    }
    if (at >= text.size()) out.open = open;
    out.is_closed = open.empty();
    return out;
}

// A list that is not closed is noticed where the next table begins, or at the end.
std::optional<TomlMistake> unclosed(std::string_view text, std::size_t at) {
    const auto [open, is_closed] = open_brackets(text, at);
    if (open.empty()) return std::nullopt;
    if (!is_closed)
        return mistake_at(
            text, open.front(),
            fmt::format("this {} is not closed by {}", text[open.front()], text[open.front()] == '[' ? ']' : '}'));
    const auto brace = std::ranges::find_if(open, [&](std::size_t i) { return text[i] == '{'; });
    if (brace == open.end() || text.substr(*brace, at + 1 - *brace).find('\n') == text.npos) return std::nullopt;
    return mistake_at(text, *brace,
                      "a table in braces stands on one line; or give it a name in brackets, [name], and "
                      "each key a line of its own");
}

// The line with strings as "____", without its comment. A quote that is not closed: where it is, in `unclosed`.
std::string blanked(std::string_view line, std::size_t& unclosed) {
    std::string out;
    unclosed = line.npos;
    for (std::size_t i = 0; i < line.size() && line[i] != '#';) {
        if (line[i] != '"' && line[i] != '\'') {
            out += line[i++];
            continue;
        }
        const std::size_t end = end_of_string(line, i);
        if (end < i + 2 || line[end - 1] != line[i]) unclosed = i;
        out += line[i] + std::string(end - i > 1 ? end - i - 2 : 0, '_') + (end - i > 1 ? std::string(1, line[i]) : "");
        i = end;
    }
    return out;
}

// A key or a table that is given again; by the parser's words, "cannot redefine existing table 'shape'".
std::optional<TomlMistake> twice(std::string_view text, std::size_t at, const std::string& description) {
    static const std::regex form("cannot redefine existing .*'(.*\\.)?(.*)'.*");
    std::smatch match;
    if (!std::regex_match(description.begin() + static_cast<std::ptrdiff_t>(description.find("cannot")),
                          description.end(), match, form))
        return std::nullopt;
    const std::string name = match[2].str();
    const bool heading = text.substr(at).starts_with("["),
               of_a_list = heading && match[1].matched;  // as in [shape.mode]
    std::size_t first = 0, line = 1;
    for (std::size_t begin = 0; begin < at; begin = text.find('\n', begin) + 1, ++line) {
        std::string_view left = text.substr(begin, text.find_first_of("\n=]", begin) - begin);
        left = left.substr(std::min(left.find_first_not_of(" \t"), left.size()));
        if (left.starts_with("[") != heading) continue;
        left = left.substr(std::min(left.find_first_not_of(" \t["), left.size()));
        left = left.substr(0, left.find_last_not_of(" \t") + 1);
        if (left.ends_with(name) && line < line_of(text, at)) first = line;
    }
    return mistake_at(
        text, at,
        fmt::format("{} is given twice{}: keep one of the two{}", match[1].str() + name,
                    first > 0 ? fmt::format(", first in line {}", first) : "",
                    of_a_list ? "; where several are allowed, each is [[" + match[1].str() + name + "]]" : ""));
}

// `line` is that which begins there, with strings blanked out.
std::optional<TomlMistake> by_rules(std::string_view text, std::size_t begin, const std::string& line) {
    static const std::vector<std::regex> patterns = [] {
        std::vector<std::regex> all;
        for (const Rule& rule : rules) all.emplace_back(rule.pattern);
        return all;
    }();
    for (std::size_t i = 0; i < patterns.size(); ++i) {
        std::smatch match;
        if (!std::regex_search(line, match, patterns[i])) continue;
        const auto at = static_cast<std::size_t>(match.position(static_cast<std::size_t>(rules[i].at)));
        return mistake_at(text, begin + at, match.format(rules[i].words));
    }
    return std::nullopt;
}

}  // namespace

std::size_t end_of_string(std::string_view text, std::size_t from) {
    const char quote = text[from];
    const std::string three(3, quote);
    const bool of_lines = text.substr(from).starts_with(three);
    for (std::size_t i = from + (of_lines ? 3 : 1); i < text.size(); ++i) {
        if (text[i] == '\\' && quote == '"') {
            ++i;
        } else if (!of_lines && (text[i] == quote || text[i] == '\n')) {
            return text[i] == quote ? i + 1 : i;
        } else if (of_lines && text.substr(i).starts_with(three)) {
            i += 3;  // up to two more quotes belong to its contents
            for (int more = 0; more < 2 && i < text.size() && text[i] == quote; ++more) ++i;
            return i;
        }
    }
    return text.size();
}

std::optional<TomlMistake> toml_mistake(std::string_view text, std::size_t line, std::size_t column,
                                        const std::string& description) {
    std::size_t begin = 0;
    for (std::size_t i = 1; i < line && begin < text.size(); ++i)
        begin = std::min(text.find('\n', begin), text.size()) + 1;
    begin = std::min(begin, text.size());
    const std::string_view raw = text.substr(begin, text.find_first_of("\r\n", begin) - begin);
    std::size_t at = begin;
    for (std::size_t i = 1; at < text.size() && i < column; ++i) do
            ++at;
        while (at < text.size() && !begins_character(text[at]));
    if (description.find("cannot redefine") != description.npos) return twice(text, begin, description);
    if (description.find("escape sequence") != description.npos || description.find("scalar seq") != description.npos)
        return mistake_at(text, std::max(text.rfind('\\', at), begin),
                          "\\ begins an escape within \"...\": write \\\\, or '...', which takes text as it is");
    if (raw.size() > longest_line) return std::nullopt;
    if (auto bracket = unclosed(text, at)) return bracket;
    std::size_t quote = 0;
    const std::string blank = blanked(raw, quote);
    for (const LookAlike& one : look_alikes)
        if (const std::size_t found = blank.find(one.character); found != blank.npos)
            return mistake_at(text, begin + found, std::string(one.words));
    if (quote != raw.npos) return mistake_at(text, begin + quote, "this quote is not closed");
    return by_rules(text, begin, blank);
}

}  // namespace tubule
