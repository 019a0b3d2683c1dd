#include "common/case/reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <regex>
#include <stdexcept>

#include "common/case/other_names.hpp"
#include "common/case/overrides.hpp"
#include "common/case/read.hpp"
#include "common/case/text.hpp"

namespace tubule {

namespace {

constexpr std::size_t most_in_range = 100'000;
constexpr double shortest_ramp = 1e-6;  // of its time: where steps are shorter, the work of a load is inexact

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
    static const std::regex with_comma(R"(\s*([+-]?\d+),(\d+)\s*)");
    std::smatch number;
    const auto* text = node.as_string();
    const bool comma = text && std::regex_match(text->get(), number, with_comma);
    throw CaseErrors({{where, path,
                       fmt::format("{} must be {}, not {}{}", path, what, shown(node),
                                   comma ? number.format("; decimals have a point: $1.$2") : ""),
                       ""}});
}

std::string meant(const std::string& suggestion) {
    return suggestion.empty() ? "" : fmt::format("; did you mean '{}'?", suggestion);
}

// The numbers of a range; nothing if the text has another form.
std::optional<std::vector<double>> evenly_spaced(const std::string& text) {
    try {
        return parse_range(text, most_in_range).evenly();
    } catch (const std::invalid_argument&) {
        return std::nullopt;
    }
}

// Whether it is of the type of the target, which is set then.
template <class T>
bool assign(T& target, const toml::node& node) {
    if (const auto* value = node.as<T>()) target = value->get();
    return node.is<T>();
}

std::string lines_of(const std::vector<Complaint>& all) {
    std::string out;
    for (const Complaint& c : all) out += fmt::format("{}{}: {}", out.empty() ? "" : "\n", c.place, c.what);
    return out;
}

}  // namespace

CaseErrors::CaseErrors(std::vector<Complaint> all) : CaseError(lines_of(all)), complaints(std::move(all)) {}

std::string Reader::where(const toml::node& node) const {
    return place(node.source());
}

std::string Reader::path_of(const std::string& key) const {
    return path_.empty() || key.empty() ? path_ + key : path_ + "." + key;
}

const toml::node* Reader::find(const std::string& key, const std::string& what, bool needed, bool in_doubt) {
    if (pass_ == Pass::names) {
        names_.push_back(key);
        return nullptr;
    }
    const toml::node* node = table_.get(key);
    if (node || !needed) return node;
    if (was_meant(key)) {
        complaints_.keys_in_doubt = complaints_.keys_in_doubt || in_doubt;
        return nullptr;
    }
    collect([&] { refuse_missing(key, what); }, in_doubt);
    return nullptr;
}

void Reader::refuse_missing(const std::string& key, const std::string& what) const {
    for (const auto& [name, inner] : table_)
        if (const toml::table* table = inner.as_table(); table && table->contains(key))
            throw CaseErrors(
                {{place(table->find(key)->first.source()), path_of(key),
                  fmt::format("{} stands within [{}]; it belongs {}", key, path_of(std::string(name.str())),
                              path_.empty() ? "before the first table" : "under [" + path_ + "]"),
                  ""}});
    const std::string last = path_.substr(path_.rfind('.') + 1);
    throw CaseErrors({{where_, path_of(key),
                       fmt::format("missing key {}: {}{}", path_of(key), what,
                                   where_.starts_with("--set ") && list_index(last)
                                       ? fmt::format("; entries count from 0, so {} is a new one", path_)
                                       : ""),
                       ""}});
}

// Whether another word stands where this key was meant: it is not missing.
bool Reader::was_meant(const std::string& key) const {
    return std::find(meant_.begin(), meant_.end(), key) != meant_.end();
}

void Reader::refuse_unknown() {
    const bool in_doubt = complaints_.keys_in_doubt;
    for (const auto& [key, node] : table_) {
        const std::string name(key.str());
        if (std::find(names_.begin(), names_.end(), name) != names_.end() || (accepts_ && accepts_(name))) continue;
        // Names of a case; the file of a scan has other tables.
        const bool is_case = !path_.empty() || std::ranges::find(names_, "tier") != names_.end();
        const OtherName* other = is_case ? other_name(path_, name) : nullptr;
        const std::string suggestion = other ? std::string(other->key) : near_miss(name, names_).value_or("");
        if (in_doubt && suggestion.empty() && !other) continue;
        meant_.push_back(suggestion);
        const std::string words = other           ? fmt::format(": {}.", other->words)
                                  : name == path_ ? fmt::format(": under [{0}], keys have no {0}. before them.", name)
                                                  : meant(suggestion);
        complaints_.found.push_back({place(key.source()), path_of(name),
                                     fmt::format("unknown key {}{} Allowed here: {}", path_of(name),
                                                 words.empty() ? "." : words, fmt::join(names_, ", ")),
                                     suggestion});
    }
}

void Reader::refuse(const std::string& key, const std::string& complaint) {
    std::string place_of_key = where_;
    const toml::node* at = &table_;
    for (const std::string& name : split(key, '.')) {
        at = child(*at, name);
        if (!at) break;
        place_of_key = where(*at);
    }
    complaints_.found.push_back({place_of_key, path_of(key), fmt::format("{} {}", path_of(key), complaint), ""});
}

template <class Take>
bool Reader::value(const std::string& key, const std::string& what, bool needed, const Take& take) {
    const toml::node* node = find(key, what, needed);
    if (node)
        collect([&] {
            if (!take(*node)) refuse_value(where(*node), path_of(key), what, *node);
        });
    return node != nullptr;
}

void Reader::flag(const std::string& key, bool& target) {
    value(key, "true or false", false, [&](const toml::node& node) { return assign(target, node); });
}

void Reader::text(const std::string& key, std::string& target, bool needed, const std::string& what) {
    value(key, what, needed, [&](const toml::node& node) { return assign(target, node); });
}

void Reader::texts(const std::string& key, std::vector<std::string>& target) {
    const std::string what = "a list of strings";
    const toml::node* node = find(key, what, false);
    if (!node) return;
    collect([&] {
        for (const toml::node& item : as_list(*node, path_of(key), what))
            if (!assign(target.emplace_back(), item)) refuse_value(where(item), path_of(key), what, item);
    });
}

void Reader::formula(const std::string& key, std::shared_ptr<const Formula>& target,
                     std::span<const std::string_view> variables, bool needed) {
    const std::string what = "a formula, such as " + toml_string("0.1*" + std::string(variables.front()) + "^2");
    value(key, what, needed, [&](const toml::node& node) {
        if (node.is_string()) target = formula_in(node, key, variables);
        return node.is_string();
    });
}

std::shared_ptr<const Formula> Reader::formula_in(const toml::node& node, const std::string& key,
                                                  std::span<const std::string_view> variables) const {
    try {
        return std::make_shared<const Formula>(parse_formula(node.as_string()->get(), variables));
    } catch (const FormulaError& error) {
        throw CaseErrors({{where_in(node, error.column), path_of(key),
                           fmt::format("{}, character {}: {}", path_of(key), error.column, error.what()), ""}});
    }
}

void Reader::number_or_formula(const std::string& key, double& number, std::shared_ptr<const Formula>& formula,
                               std::span<const std::string_view> variables) {
    value(key, fmt::format("a number, or a formula of {}", fmt::join(variables, ", ")), false,
          [&](const toml::node& node) {
              if (node.is_number()) number = number_in(node, path_of(key), {});
              if (node.is_string()) formula = formula_in(node, key, variables);
              return node.is_number() || node.is_string();
          });
}

// The place of a character of a string, if the file has it literally, in quotes on one line.
std::string Reader::where_in(const toml::node& node, std::size_t character) const {
    toml::source_region at = node.source();
    const std::string& text = node.as_string()->get();
    const auto length =  // in characters, as TOML++ counts
        std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; });
    if (at.end.line == at.begin.line && at.end.column == at.begin.column + length + 2)
        at.begin.column += static_cast<toml::source_index>(character);
    return place(at);
}

void Reader::increasing(const std::string& key, std::vector<double>& target, const Range& range, bool needed) {
    const std::string what = "a list of increasing numbers";
    const toml::node* node = find(key, what, needed);
    if (!node) return;
    target.clear();
    collect([&] {
        if (node->is_string()) {
            const auto values = evenly_spaced(node->as_string()->get());
            const bool allowed = values && std::ranges::all_of(*values, [&](double x) { return allows(x, range); });
            if (!allowed)
                refuse_value(where(*node), path_of(key), what + " or a range \"lo:hi:n\", " + expected("each", range),
                             *node);
            target = *values;
            return;
        }
        for (const toml::node& item : as_list(*node, path_of(key), what)) {
            const std::string path = fmt::format("{}.{}", path_of(key), target.size());
            const double x = number_in(item, path, range);
            if (!target.empty() && x <= target.back())
                throw CaseErrors({{where(item), path,
                                   fmt::format("{} must be larger than the {} before it, not {}: {} is {}", path,
                                               target.back(), x, path_of(key), what),
                                   ""}});
            target.push_back(x);
        }
    });
}

// A bound that comes from another key is none if that key may be wrong.
bool Reader::allows(double x, Range range) const {
    if (!range.note.empty() && complaints_.any()) range.to = std::numeric_limits<double>::infinity();
    return within(x, range);
}

void Reader::ramp(const std::string& key, Ramp& target) {
    std::shared_ptr<const Formula> none;
    ramp_or_formula(key, target, none, {});
}

void Reader::ramp(const std::string& key, std::optional<Ramp>& target) {
    Ramp value;
    std::shared_ptr<const Formula> none;
    if (ramp_or_formula(key, value, none, {})) target = value;
}

bool Reader::ramp_or_formula(const std::string& key, Ramp& target, std::shared_ptr<const Formula>& formula,
                             std::span<const std::string_view> variables) {
    std::string what = "a number, or {time = [...], value = [...]}";
    if (!variables.empty()) what += fmt::format(", or a formula of {}", fmt::join(variables, ", "));
    return value(key, what, false, [&](const toml::node& node) {
        const bool is_formula = node.is_string() && !variables.empty();
        if (node.is_number()) target = number_in(node, path_of(key), {});
        if (node.is_table()) ramp_in(*node.as_table(), key, target);
        if (is_formula) formula = formula_in(node, key, variables);
        return node.is_number() || node.is_table() || is_formula;
    });
}

void Reader::ramp_in(const toml::table& table, const std::string& key, Ramp& target) {
    std::vector<double> times, values;
    const std::size_t complaints = complaints_.found.size();
    read(table, path_of(key), where(table), complaints_, [&](Reader& k) {
        k.increasing("time", times, {.from = 0}, required);
        k.numbers("value", values, required);
        k.check("time", [&] {
            const auto jumps = [](double from, double to) { return to - from < shortest_ramp * to; };
            return std::adjacent_find(times.begin(), times.end(), jumps) == times.end()
                       ? ""
                       : "must increase by a millionth at least: a jump needs a duration that steps resolve";
        });
        k.check("value", [&] {
            return times.empty()                   ? "needs at least one time"
                   : times.size() != values.size() ? "must be as many numbers as there are times"
                                                   : "";
        });
    });
    if (complaints_.found.size() == complaints) target = Ramp(times, values);
}

void Reader::numbers(const std::string& key, std::vector<double>& target, bool needed) {
    const std::string what = "a list of numbers";
    const toml::node* node = find(key, what, needed);
    if (!node) return;
    target.clear();
    collect([&] {
        for (const toml::node& item : as_list(*node, path_of(key), what))
            target.push_back(number_in(item, fmt::format("{}.{}", path_of(key), target.size()), {}));
    });
}

double Reader::number_in(const toml::node& node, const std::string& path, const Range& range) const {
    if (node.is_number()) {
        const double x =
            node.is_integer() ? static_cast<double>(node.as_integer()->get()) : node.as_floating_point()->get();
        if (allows(x, range)) return x;
    }
    refuse_value(where(node), path, expected("a number", range), node);
}

int Reader::integer_in(const toml::node& node, const std::string& path, const Range& range) const {
    if (node.is_integer() && allows(static_cast<double>(node.as_integer()->get()), range))
        return static_cast<int>(node.as_integer()->get());
    refuse_value(where(node), path, expected("an integer", range), node);
}

std::size_t Reader::one_of(const toml::node& node, const std::string& path,
                           const std::vector<std::string>& names) const {
    if (!node.is_string()) refuse_value(where(node), path, expected(names), node);
    const std::string& name = node.as_string()->get();
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
        const std::string suggestion = near_miss(name, names).value_or("");
        throw CaseErrors(
            {{where(node), path,
              fmt::format("{} must be {}, not {}{}", path, expected(names), toml_string(name), meant(suggestion)),
              suggestion}});
    }
    return static_cast<std::size_t>(found - names.begin());
}

const toml::table& Reader::as_table(const toml::node& node, const std::string& path, const std::string& what) const {
    if (!node.is_table()) refuse_value(where(node), path, what, node);
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
