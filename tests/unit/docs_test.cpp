// What is listed once in the code stands in the docs as well.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "common/case/case.hpp"
#include "common/case/keys.hpp"
#include "common/series/catalogue.hpp"
#include "tests/support/paths.hpp"

namespace tubule::docs_test {

std::string page(const std::string& name) {
    std::ifstream file(test::sources + "/" + name);
    return {std::istreambuf_iterator<char>(file), {}};
}

bool has(const std::string& text, const std::string& row) {
    return text.find(row) != std::string::npos;
}

TEST(Docs, TellEveryStopItsExitStatusAndWhenItIsGiven) {
    const std::string results = page("docs/results.md");
    for (const StopKind& stop : stop_kinds) {
        const std::string row = fmt::format("\n| `{}` | {} | {} |\n", stop.name, stop.exit_code, stop.meaning);
        EXPECT_TRUE(has(results, row)) << "docs/results.md lacks the row" << row;
    }
}

TEST(Docs, TellWhatToDoAboutEveryStop) {
    const std::string stops = page("docs/failures.md");
    for (const StopKind& stop : stop_kinds) {
        if (stop.exit_code != 3 && stop.exit_code != 4) continue;  // `run` names the place for these
        EXPECT_TRUE(has(stops, fmt::format("\n| <a id=\"{0}\"></a>`{0}` | ", stop.name)))
            << "docs/failures.md lacks the row of " << stop.name;
    }
}

TEST(Docs, TellEverySeries) {
    const std::string results = page("docs/results.md");
    for (const SeriesEntry& series : series_catalogue) {
        const std::string row = fmt::format("\n| `{}` | {} | {} |\n", series.name, series.unit, series.meaning);
        EXPECT_TRUE(has(results, row)) << "docs/results.md lacks the row" << row;
    }
    const std::string keys = page("docs/case_files.md");
    for (const SeriesEntry& series : series_catalogue) {
        if (series.use != SeriesUse::effort) continue;
        EXPECT_TRUE(has(keys, fmt::format("`{}`", series.name))) << "docs/case_files.md lacks " << series.name;
    }
}

template <class... Shapes>
void expect_rows(const std::variant<Shapes...>&) {
    const std::string keys = page("docs/case_files.md");
    for (const char* kind : {Shapes::kind...})
        EXPECT_TRUE(has(keys, fmt::format("\n| `\"{}\"` | ", kind))) << "docs/case_files.md lacks the shape " << kind;
}
TEST(Docs, TellEveryShape) {
    expect_rows(Shape{});
}

TEST(Docs, TellEveryEnergyTerm) {
    const std::string keys = page("docs/case_files.md"), results = page("docs/results.md");
    for_each_bending_term([&](std::size_t, const auto& term) {
        EXPECT_TRUE(has(keys, fmt::format("`{}`", term.key))) << "docs/case_files.md lacks " << term.key;
        EXPECT_TRUE(has(results, fmt::format("`energy_{}`", term.name))) << "docs/results.md lacks " << term.name;
    });
}

// What a key is, in the words of docs/case_files.md.
struct KeyFacts {
    std::string type;
    std::set<std::string> allowed;
};

std::string allowed_numbers(const Range& range) {
    const bool above = std::isfinite(range.above), from = std::isfinite(range.from), to = std::isfinite(range.to);
    if (!range.note.empty() || !(above || from || to)) return "";
    if (range.step > 0) {
        std::string all;
        for (double n = range.from; n <= range.to; n += range.step)
            all += fmt::format("{}{}", all.empty() ? "" : ", ", n);
        return all;
    }
    if (from && to) return fmt::format("{:.0f} to {:.0f}", range.from, range.to);
    const std::string low = fmt::format("{} {}", above ? ">" : ">=", above ? range.above : range.from);
    return to ? fmt::format("{}, <= {}", low, range.to) : low;
}

// The visitor of common/case/keys.hpp that lists keys.
class KeyList {
public:
    static constexpr bool required = true;
    KeyList(std::map<std::string, KeyFacts>& found, const std::string& path) : found_(found), path_(path) {}

    template <class T>
    void number(const std::string& key, const T&, const Range& range = {}, bool = false) {
        add(key, "float", allowed_numbers(range));
    }
    template <class T>
    void integer(const std::string& key, const T&, const Range& range, bool = false) {
        add(key, "integer", allowed_numbers(range));
    }
    template <class T>
    void choice(const std::string& key, const T&, const Choices<T>& choices, bool = false) {
        for (const auto& [name, meaning] : choices) add(key, "string", fmt::format("`\"{}\"`", name));
    }
    void flag(const std::string& key, bool) { add(key, "boolean", ""); }
    void text(const std::string& key, const std::string&, bool = false, const std::string& = {}) {
        add(key, "string", "");
    }
    void increasing(const std::string& key, const std::vector<double>&, const Range&) {
        add(key, "list of floats", "");
    }
    void ramp(const std::string& key, const Ramp&) { add(key, "float or table", ""); }
    void ramp(const std::string& key, const std::optional<Ramp>&) { ramp(key, Ramp()); }
    void ramp_or_formula(const std::string& key, const Ramp&, const std::shared_ptr<const Formula>&,
                         std::span<const std::string_view>) {
        add(key, "float, table or string", "");
    }
    void formula(const std::string& key, const std::shared_ptr<const Formula>&, std::span<const std::string_view>,
                 bool = false) {
        add(key, "string", "");
    }
    void number_or_formula(const std::string& key, double, const std::shared_ptr<const Formula>&,
                           std::span<const std::string_view>) {
        add(key, "float or string", "");
    }
    void absent(const std::string&, const std::string&) {}
    template <class... Kinds>
    void kind(const std::variant<Kinds...>&) {}
    template <class Describe>
    void table(const std::string& key, const Describe& describe) {
        if (key == "expect") return;  // its keys are the names of series
        KeyList inner(found_, path_of(key));
        describe(inner);
    }
    template <class T, class Describe>
    void optional_table(const std::string& key, std::optional<T>& value, const Describe& describe) {
        if (!value) return;
        KeyList inner(found_, path_of(key));
        describe(inner, *value);
    }
    template <class T, class Describe>
    void tables(const std::string& key, std::vector<T>&, const Describe& describe) {
        KeyList inner(found_, path_of(key));
        T one{};
        describe(inner, one);
        if constexpr (std::is_same_v<T, Potential>)
            for (const auto kind : {Potential::Kind::sphere, Potential::Kind::formula}) {
                one.kind = kind;
                describe(inner, one);
            }
    }
    template <class T, class Describe>
    void entries(const OpenNames&, std::vector<T>&, std::string T::*, const Describe&) {}
    template <class Complain>
    void check(const std::string&, const Complain&) {}

private:
    std::string path_of(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
    void add(const std::string& key, const std::string& type, const std::string& allowed) {
        KeyFacts& facts = found_[path_of(key)];
        facts.type = type;
        if (!allowed.empty()) facts.allowed.insert(allowed);
    }

    std::map<std::string, KeyFacts>& found_;
    std::string path_;
};

// All cases that differ in which keys they have, apart from their shape.
std::vector<Case> kinds_of_cases() {
    std::vector<Case> cases;
    for (const ModelEntry& model : models)
        for (const bool is_free : {false, true}) {
            Case c;
            c.units.emplace();
            c.model.kind = model.kind;
            c.model.keeps_volume = !is_free;
            c.model.area = !is_free ? AreaRule::fixed : model.inextensible ? AreaRule::reservoir : AreaRule::free;
            c.model.free_period = is_free;
            if (model.inertia) c.velocity.initial = InitialVelocity::rotation;
            c.tier = Tier::axisym;
            cases.push_back(c);
            cases.push_back(c);
            cases.back().equilibrium.emplace();
            c.time.end = 1;  // a surface moves if its case has [time]
            for (std::size_t i = 0; i < schemes.size(); ++i)
                for (const Tier tier : {Tier::surface3d, Tier::automatic}) {
                    c.tier = tier;
                    c.surface.scheme = Scheme{i};
                    cases.push_back(c);
                }
        }
    Case rest;
    rest.tier = Tier::surface3d;
    rest.time.end = 0;
    cases.push_back(rest);
    return cases;
}

struct KeyRow {
    std::string type, allowed;
};

// Rows of the table "All keys", by the path of the key; a key may have rows of several tiers.
std::multimap<std::string, KeyRow> documented_keys() {
    std::multimap<std::string, KeyRow> rows;
    std::istringstream page_text(page("docs/case_files.md"));
    std::string line, table;
    while (std::getline(page_text, line) && line != "## All keys") {
    }
    while (std::getline(page_text, line) && line.substr(0, 3) != "## ") {
        std::vector<std::string> cells;
        std::istringstream parts(line);
        for (std::string cell; std::getline(parts, cell, '|');) cells.push_back(cell);
        if (cells.size() < 6) continue;
        std::smatch match;
        if (std::regex_search(cells[1], match, std::regex("\\[+([^\\]]*)\\]"))) table = match[1].str() + ".";
        const std::regex name("`(\\w+)`");
        for (std::sregex_iterator it(cells[1].begin(), cells[1].end(), name), end; it != end; ++it)
            rows.insert({table + (*it)[1].str(), {cells[2], cells[4]}});
    }
    return rows;
}

TEST(Docs, TellEveryKeyItsTypeAndWhatIsAllowed) {
    std::map<std::string, KeyFacts> keys_of_code;
    for (Case c : kinds_of_cases()) {
        KeyList list(keys_of_code, "");
        keys(list, c);
    }
    const auto rows = documented_keys();
    for (const auto& [key, facts] : keys_of_code) {
        if (key.starts_with("shape.")) continue;  // a table of its own
        const auto [begin, end] = rows.equal_range(key);
        EXPECT_NE(begin, end) << "docs/case_files.md lacks " << key;
        for (auto row = begin; row != end; ++row)
            EXPECT_TRUE(row->second.type.starts_with(" " + facts.type)) << key << " is a " << facts.type;
        for (const std::string& words : facts.allowed)
            EXPECT_TRUE(std::any_of(begin, end, [&](const auto& row) { return has(row.second.allowed, words); }))
                << "docs/case_files.md: " << key << " lacks " << words;
    }
    for (const auto& [key, row] : rows)
        EXPECT_TRUE(keys_of_code.contains(key)) << "docs/case_files.md: " << key << " is no key";
}

template <class... Shapes>
void expect_keys_of_shapes(const std::variant<Shapes...>&) {
    const std::string text = page("docs/case_files.md");
    const auto expect_keys = [&](auto shape) {
        std::map<std::string, KeyFacts> found;
        KeyList list(found, "");
        keys(list, shape);
        const std::size_t begin = text.find(fmt::format("\n| `\"{}\"` | ", shape.kind));
        ASSERT_NE(begin, std::string::npos) << shape.kind;
        const std::string row = text.substr(begin, text.find('\n', begin + 1) - begin);
        for (const auto& [key, facts] : found) {
            const std::string name = key.substr(key.rfind('.') + 1);
            EXPECT_TRUE(has(row, fmt::format("`{}`", name)))
                << "docs/case_files.md: shape " << shape.kind << " lacks " << key;
        }
    };
    (expect_keys(Shapes{}), ...);
}
TEST(Docs, TellTheKeysOfEveryShape) {
    expect_keys_of_shapes(Shape{});
}

}  // namespace tubule::docs_test
