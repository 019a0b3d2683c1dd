// TOML text of any origin, parsed within bounds.
#pragma once

#include <toml++/toml.h>

#include <string>

namespace tubule {

constexpr std::size_t most_key_parts = 32;  // of a dotted key, a.b.c: more than any key of ours has

// The text as a table; `path` is the source that messages name. Throws CaseError with line and column where it is no
// TOML, or where a key has more parts than most_key_parts.
toml::table parse_toml(const std::string& text, const std::string& path);

// "file:line:column", or "--set key=value" for what an override brought.
std::string place(const toml::source_region& source);

}  // namespace tubule
