#include "common/case/toml_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "common/case/read.hpp"
#include "common/case/text.hpp"

namespace tubule {
namespace {

// toml++ handles nested values up to a depth of its own, but walks down the parts of a key without any: a key of some
// ten thousand parts overflows the stack.
void refuse_long_keys(std::string_view text, const std::string& path) {
    std::size_t parts = 1;
    for (std::size_t i = 0; i < text.size();) {
        const char c = text[i];
        if (c == '#') {
            i = std::min(text.find('\n', i), text.size());
        } else if (c == '"' || c == '\'') {
            i = end_of_string(text, i);
        } else {
            const bool in_key = std::isalnum(static_cast<unsigned char>(c)) ||
                                std::string_view("-_ \t.").find(c) != std::string_view::npos;
            parts = c == '.' ? parts + 1 : in_key ? parts : 1;
            ++i;
        }
        if (parts <= most_key_parts) continue;
        toml::source_region where;
        const std::string_view before = text.substr(0, i);
        where.begin.line = static_cast<toml::source_index>(1 + std::count(before.begin(), before.end(), '\n'));
        where.begin.column = static_cast<toml::source_index>(i - (before.rfind('\n') + 1));
        where.path = std::make_shared<const std::string>(path);
        throw CaseError(fmt::format("{}: a key has more than {} parts", place(where), most_key_parts));
    }
}

}  // namespace

std::string place(const toml::source_region& source) {
    const std::string path = source.path ? *source.path : "";  // TOML++ drops an empty one
    if (path.starts_with("--set ")) return path;
    return fmt::format("{}:{}:{}", path, source.begin.line, source.begin.column);
}

toml::table parse_toml(const std::string& text, const std::string& path) {
    if (const auto other = no_plain_text(text); !other.empty())
        throw CaseError(fmt::format("{}:1:1: is {}: a case is TOML, plain text saved as UTF-8", path, other));
    refuse_long_keys(text, path);
    try {
        return toml::parse(text, std::string_view(path));
    } catch (const toml::parse_error& error) {
        toml::source_region where = error.source();
        const std::string description(error.description());
        const auto mistake = toml_mistake(text, where.begin.line, where.begin.column, description);
        if (mistake)
            where.begin = {static_cast<toml::source_index>(mistake->line),
                           static_cast<toml::source_index>(mistake->column)};
        throw CaseError(fmt::format("{}: not valid TOML: {}", place(where), mistake ? mistake->words : description));
    }
}

}  // namespace tubule
