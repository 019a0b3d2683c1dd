// What the keys of a case combine with: a row for each feature that does not combine with all others. The reader
// refuses a case that breaks one of them; the writer leaves out the keys that its case cannot have.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/case/problem.hpp"

namespace tubule {

struct Property {
    std::string words;  // in messages, after "only valid with"
    std::function<bool(const Problem&)> holds;
};

// A key, or one of its values, is valid where the case has all properties.
struct Requirement {
    std::string key;                             // as in --set
    std::function<bool(const Problem&)> counts;  // whether the value is one that has needs; empty: every value has
    std::vector<Property> needs;
    std::string reason = {};             // or a remedy, in messages
    std::string instead = "be absent:";  // what the key must do, in messages; "not be {}:" names its value
};

const std::vector<Requirement>& requirements();

// The first of the needs that the case lacks; null if there is none, or if the row does not count.
const Property* missing_property(const Requirement& row, const Problem& p);

// Whether a case with these properties can have the key at all.
bool can_have(const Problem& p, std::string_view key);

}  // namespace tubule
