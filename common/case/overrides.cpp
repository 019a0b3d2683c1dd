#include "common/case/overrides.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <span>

#include "common/case/read.hpp"
#include "common/case/text.hpp"
#include "common/case/toml_input.hpp"

namespace tubule {

namespace {

// A value in TOML, or as a string if it is none, as a node whose source is the override; in a table, since a node lives
// in one.
toml::table parse_value(const std::string& text, const std::string& source) {
    const auto begins = [&](std::string_view word) { return text.starts_with(word); };
    constexpr std::array words{"true", "false", "inf", "nan"};
    if (!text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) && !std::ranges::any_of(words, begins))
        return parse_value(toml_string(text), source);
    const bool meant_as_toml = !text.empty() && std::string_view("[{\"'").find(text.front()) != std::string_view::npos;
    try {
        toml::table parsed = parse_toml("value = " + text, source);
        if (parsed.size() == 1) return parsed;  // else the text holds a line break and more keys
    } catch (const CaseError& error) {
        const std::string words = error.what();
        if (meant_as_toml)
            throw CaseError(words + (words.find("is not closed by") == words.npos
                                         ? ""
                                         : "; a value with blanks stands in quotes: --set 'time.output=[1, 2]'"));
    }
    return parse_toml("value = " + toml_string(text), source);
}

// Puts the value into a table or list. `where` is the path of the parent, `name` the key or index in it.
toml::node& insert(toml::node& parent, std::span<const std::string> where, const std::string& name, toml::table&& value,
                   const std::string& source) {
    const std::string path = fmt::format("{}", fmt::join(where, "."));
    toml::node&& node = std::move(*value.get("value"));
    if (toml::table* table = parent.as_table()) {
        table->insert_or_assign(toml::key(name, node.source()), std::move(node));
        return *table->get(name);
    }
    toml::array* list = parent.as_array();
    if (!list)
        throw CaseError(fmt::format("{}: {} is neither a table nor a list, so it has no '{}'", source, path, name));
    const auto index = list_index(name);
    if (!index || *index > list->size())
        throw CaseError(fmt::format("{}: {} is a list of {}: '{}' must be an index from 0 to {} ({} adds an entry)",
                                    source, path, list->size(), name, list->size(), list->size()));
    if (*index == list->size())
        list->push_back(std::move(node));
    else
        list->replace(list->cbegin() + static_cast<std::ptrdiff_t>(*index), std::move(node));
    return *list->get(*index);
}

}  // namespace

void apply_override(toml::table& root, const std::string& set) {
    const std::string source = "--set " + set;
    const std::size_t equals = set.find('=');
    const std::vector<std::string> names = split(set.substr(0, equals), '.');
    const bool gap = std::find(names.begin(), names.end(), "") != names.end();
    if (equals == std::string::npos || gap)
        throw CaseError(source + ": must have the form key=value, such as --set energy.k42=0.06");
    if (names.size() > most_key_parts)
        throw CaseError(
            fmt::format("{}: the key has {} parts; at most {} are read", source, names.size(), most_key_parts));

    toml::node* at = &root;
    for (std::size_t i = 0; i + 1 < names.size(); ++i) {
        const std::span<const std::string> where(names.data(), i);
        toml::node* next = child(*at, names[i]);
        const char* empty = list_index(names[i + 1]) ? "[]" : "{}";
        at = next ? next : &insert(*at, where, names[i], parse_value(empty, source), source);
    }
    const std::span<const std::string> where(names.data(), names.size() - 1);
    insert(*at, where, names.back(), parse_value(set.substr(equals + 1), source), source);
}

}  // namespace tubule
