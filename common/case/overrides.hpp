// --set a.b=value on a parsed case file, before it is validated.
#pragma once

#include <toml++/toml.h>

#include <string>

#include "common/case/text.hpp"

namespace tubule {

// Applies "a.b.0.c=value": tables that are missing are made, a list takes the index behind its last entry as
// a new entry, and a value that is no TOML is a string. What it inserts has the text "--set ..." as its source,
// so that later errors name it. Throws CaseError when the override is invalid by itself.
void apply_override(toml::table& root, const std::string& set);

// The entry of a table or list under a name or index; null where there is none.
template <class Node>  // toml::node or const toml::node
Node* child(Node& parent, const std::string& name) {
    if (auto* table = parent.as_table()) return table->get(name);
    auto* list = parent.as_array();
    const auto index = list_index(name);
    return list && index ? list->get(*index) : nullptr;
}

}  // namespace tubule
