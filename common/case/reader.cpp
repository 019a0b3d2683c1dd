#include "common/case/reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "common/case/overrides.hpp"
#include "common/case/read.hpp"
#include "common/case/text.hpp"

namespace tubule {

namespace {

std::string shown(const toml::node& node) {
    if (const auto* value = node.as_string()) return "the string " + toml_string(value->get());
    if (const auto* value = node.as_integer()) return fmt::format("{}", value->get());
    if (const auto* value = node.as_floating_point()) {
        const std::string digits = fmt::format("{}", value->get());
        return digits.find_first_of(".en") == std::string::npos ? digits + ".0" : digits;  // 1.0 is not an integer
    }
    if (const auto* value = node.as_boolean()) return fmt::format("{}", value->get());
    if (node.is_table()) return "a table";
    if (node.is_array()) return "a list";
    return "a date or time";
}

bool within(double x, const Range& range) {
    if (!std::isfinite(x) || x <= range.above || x < range.from || x > range.to) return false;
    return range.step == 0 || std::fmod(x - range.from, range.step) == 0;
}

[[noreturn]] void refuse_value(const std::string& where, const std::string& path, const std::string& what,
                               const toml::node& node) {
    throw CaseError(fmt::format("{}: {} must be {}, not {}", where, path, what, shown(node)));
}

std::string meant(const std::string& word, const std::vector<std::string>& names) {
    const auto name = near_miss(word, names);
    return name ? fmt::format("; did you mean '{}'?", *name) : "";
}

}  // namespace

std::string Reader::where(const toml::node& node) const {
    return place(node.source());
}

std::string Reader::path_of(const std::string& key) const {
    return path_.empty() || key.empty() ? path_ + key : path_ + "." + key;
}

const toml::node* Reader::find(const std::string& key, const std::string& what, bool needed) {
    if (pass_ == Pass::names) {
        names_.push_back(key);
        return nullptr;
    }
    const toml::node* node = table_.get(key);
    if (!node && needed) throw CaseError(fmt::format("{}: missing key {}: {}", where_, path_of(key), what));
    return node;
}

void Reader::refuse_unknown() const {
    for (const auto& [key, node] : table_) {
        const std::string name(key.str());
        if (std::find(names_.begin(), names_.end(), name) != names_.end() || (accepts_ && accepts_(name))) continue;
        const std::string suggestion = meant(name, names_);
        throw CaseError(fmt::format("{}: unknown key {}{} Allowed here: {}", place(key.source()), path_of(name),
                                    suggestion.empty() ? "." : suggestion, fmt::join(names_, ", ")));
    }
}

void Reader::refuse(const std::string& key, const std::string& complaint) const {
    std::string place_of_key = where_;
    const toml::node* at = &table_;
    for (const std::string& name : split(key, '.')) {
        at = child(*at, name);
        if (!at) break;
        place_of_key = where(*at);
    }
    throw CaseError(fmt::format("{}: {} {}", place_of_key, path_of(key), complaint));
}

void Reader::flag(const std::string& key, bool& target) {
    const std::string what = "true or false";
    const toml::node* node = find(key, what, false);
    if (!node) return;
    if (!node->is_boolean()) refuse_value(where(*node), path_of(key), what, *node);
    target = node->as_boolean()->get();
}

void Reader::text(const std::string& key, std::string& target, bool needed) {
    const std::string what = "a string";
    const toml::node* node = find(key, what, needed);
    if (!node) return;
    if (!node->is_string()) refuse_value(where(*node), path_of(key), what, *node);
    target = node->as_string()->get();
}

void Reader::increasing(const std::string& key, std::vector<double>& target, const Range& range, bool needed) {
    const std::string what = "a list of increasing numbers";
    const toml::node* node = find(key, what, needed);
    if (!node) return;
    target.clear();
    for (const toml::node& item : as_list(*node, path_of(key), what)) {
        const std::string path = fmt::format("{}.{}", path_of(key), target.size());
        const double x = number_in(item, path, range);
        if (!target.empty() && x <= target.back())
            throw CaseError(fmt::format("{}: {} must be larger than the {} before it, not {}: {} is {}", where(item),
                                        path, target.back(), x, path_of(key), what));
        target.push_back(x);
    }
}

void Reader::ramp(const std::string& key, Ramp& target) {
    const std::string what = "a number, or {time = [...], value = [...]}";
    const toml::node* node = find(key, what, false);
    if (!node) return;
    if (node->is_number())
        target = number_in(*node, path_of(key), {});
    else if (node->is_table())
        ramp_in(*node->as_table(), key, target);
    else
        refuse_value(where(*node), path_of(key), what, *node);
}

void Reader::ramp_in(const toml::table& table, const std::string& key, Ramp& target) const {
    std::vector<double> times, values;
    read(table, path_of(key), where(table), [&](Reader& k) {
        k.increasing("time", times, {.from = 0}, required);
        k.numbers("value", values, required);
        k.check("value", [&] {
            return times.empty()                   ? "needs at least one time"
                   : times.size() != values.size() ? "must be as many numbers as there are times"
                                                   : "";
        });
    });
    target = Ramp(times, values);
}

void Reader::numbers(const std::string& key, std::vector<double>& target, bool needed) {
    const std::string what = "a list of numbers";
    const toml::node* node = find(key, what, needed);
    if (!node) return;
    target.clear();
    for (const toml::node& item : as_list(*node, path_of(key), what))
        target.push_back(number_in(item, fmt::format("{}.{}", path_of(key), target.size()), {}));
}

double Reader::number_in(const toml::node& node, const std::string& path, const Range& range) const {
    if (node.is_number()) {
        const double x =
            node.is_integer() ? static_cast<double>(node.as_integer()->get()) : node.as_floating_point()->get();
        if (within(x, range)) return x;
    }
    refuse_value(where(node), path, expected("a number", range), node);
}

int Reader::integer_in(const toml::node& node, const std::string& path, const Range& range) const {
    if (node.is_integer() && within(static_cast<double>(node.as_integer()->get()), range))
        return static_cast<int>(node.as_integer()->get());
    refuse_value(where(node), path, expected("an integer", range), node);
}

std::size_t Reader::one_of(const toml::node& node, const std::string& path,
                           const std::vector<std::string>& names) const {
    if (!node.is_string()) refuse_value(where(node), path, expected(names), node);
    const std::string& name = node.as_string()->get();
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end())
        throw CaseError(fmt::format("{}: {} must be {}, not {}{}", where(node), path, expected(names),
                                    toml_string(name), meant(name, names)));
    return static_cast<std::size_t>(found - names.begin());
}

const toml::table& Reader::as_table(const toml::node& node, const std::string& path) const {
    if (!node.is_table()) refuse_value(where(node), path, "a table", node);
    return *node.as_table();
}

const toml::array& Reader::as_list(const toml::node& node, const std::string& path, const std::string& what) const {
    if (!node.is_array()) refuse_value(where(node), path, what, node);
    return *node.as_array();
}

std::string Reader::expected(const std::string& noun, const Range& range) {
    std::vector<std::string> bounds;
    if (range.step > 0) {
        for (double x = range.from; x <= range.to; x += range.step) bounds.push_back(fmt::format("{}", x));
        return fmt::format("one of {}", fmt::join(bounds, ", "));
    }
    if (std::isfinite(range.above)) bounds.push_back(fmt::format("> {}", range.above));
    if (std::isfinite(range.from)) bounds.push_back(fmt::format(">= {}", range.from));
    if (std::isfinite(range.to)) bounds.push_back(fmt::format("<= {}", range.to));
    if (bounds.empty()) return "a finite number";
    return fmt::format("{} {}{}", noun, fmt::join(bounds, " and "), range.note.empty() ? "" : " (" + range.note + ")");
}

std::string Reader::expected(const std::vector<std::string>& names) {
    std::vector<std::string> words;
    for (const std::string& name : names) words.push_back(toml_string(name));
    return fmt::format("{}{}", words.size() > 1 ? "one of " : "", fmt::join(words, ", "));
}

}  // namespace tubule
