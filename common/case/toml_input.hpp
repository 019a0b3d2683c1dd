// TOML text of any origin, parsed within bounds.
#pragma once

#include <toml++/toml.h>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace tubule {

constexpr std::size_t most_key_parts = 32;  // of a dotted key, a.b.c: more than any key of ours has

// The text as a table; `path` is the source that messages name. Throws CaseError with line and column where it is no
// TOML, or where a key has more parts than most_key_parts.
toml::table parse_toml(const std::string& text, const std::string& path);

// Calls visit(key, node) for a value and, where that returns true, for all that it holds; keys as in --set.
template <class Visit>
void walk(const toml::node& node, const std::string& key, const Visit& visit) {
    if (!visit(key, node)) return;
    const std::string prefix = key.empty() ? "" : key + ".";
    if (const auto* list = node.as_array())
        for (std::size_t i = 0; i < list->size(); ++i) walk(*list->get(i), prefix + std::to_string(i), visit);
    if (const auto* table = node.as_table())
        for (const auto& [name, value] : *table) walk(value, prefix + std::string(name.str()), visit);
}

// "file:line:column", or "--set key=value" for what an override brought.
std::string place(const toml::source_region& source);

// Mistakes that people make in TOML, in their words: a parser only says which character it did not expect.

struct TomlMistake {
    std::size_t line = 0, column = 0;  // from 1; in characters
    std::string words;                 // what is wrong, and what to write
};

// What is wrong where the parser stopped, if it is a common mistake; `description` are the words of TOML++.
std::optional<TomlMistake> toml_mistake(std::string_view text, std::size_t line, std::size_t column,
                                        const std::string& description);

// The position behind the string that begins at `from`; a string that its line does not close ends with the line.
std::size_t end_of_string(std::string_view text, std::size_t from);

}  // namespace tubule
