// The visitor that reads a parsed TOML table by the descriptions of keys.hpp, and refuses what they do not allow.
#pragma once

#include <toml++/toml.h>

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "common/case/complaints.hpp"
#include "common/case/keys.hpp"
#include "common/case/toml_input.hpp"

namespace tubule {

// Reads one table. Every description is run twice: first to learn the names of the keys, so that a misspelt
// one is reported as such and not as another one missing, then to take the values, in order. All that is wrong is
// collected; a target whose key is wrong keeps its default.
class Reader {
public:
    static constexpr bool required = true;

    // `path` is the table as in --set ("" for the whole file); `where` the place that stands for it in messages.
    template <class Describe>
    static void read(const toml::table& table, const std::string& path, const std::string& where,
                     Complaints& complaints, const Describe& describe) {
        try {
            Reader names(table, path, where, complaints, Pass::names);
            describe(names);
            names.refuse_unknown();
            Reader values(table, path, where, complaints, Pass::values);
            values.meant_ = std::move(names.meant_);
            describe(values);
        } catch (const Unreadable&) {
        }
    }

    template <class T>
    void number(const std::string& key, T& target, const Range& range = {}, bool needed = false) {
        if (const toml::node* node = find(key, expected("a number", range), needed))
            collect([&] { target = number_in(*node, path_of(key), range); });
    }

    template <class T>
    void integer(const std::string& key, T& target, const Range& range, bool needed = false) {
        if (const toml::node* node = find(key, expected("an integer", range), needed))
            collect([&] { target = integer_in(*node, path_of(key), range); });
    }

    template <class T>
    void choice(const std::string& key, T& target, const Choices<T>& choices, bool needed = false) {
        std::vector<std::string> names;
        for (const auto& [name, value] : choices) names.push_back(name);
        const std::size_t before = complaints_.found.size();
        const toml::node* node = find(key, expected(names), needed, decides);
        if (node) collect([&] { target = choices[one_of(*node, path_of(key), names)].second; }, decides);
        const bool unknown = needed && pass_ == Pass::values && (!node || complaints_.found.size() > before);
        if (unknown) throw Unreadable();
    }

    void flag(const std::string& key, bool& target);
    void text(const std::string& key, std::string& target, bool needed = false, const std::string& what = "a string");
    void texts(const std::string& key, std::vector<std::string>& target);
    void increasing(const std::string& key, std::vector<double>& target, const Range& range, bool needed = false);

    void numbers(const std::string& key, std::vector<double>& target, bool needed = false);

    // A number, or {time = [...], value = [...]}.
    void ramp(const std::string& key, Ramp& target);
    void ramp(const std::string& key, std::optional<Ramp>& target);
    // The same, or a formula as text. Whether the key is there.
    bool ramp_or_formula(const std::string& key, Ramp& target, std::shared_ptr<const Formula>& formula,
                         std::span<const std::string_view> variables);

    void formula(const std::string& key, std::shared_ptr<const Formula>& target,
                 std::span<const std::string_view> variables, bool needed = false);

    // A number, or a formula as text.
    void number_or_formula(const std::string& key, double& number, std::shared_ptr<const Formula>& formula,
                           std::span<const std::string_view> variables);

    void absent(const std::string& key, const std::string& complaint) {
        if (pass_ == Pass::names)
            names_.push_back(key);
        else if (table_.contains(key) && !complaints_.any())
            refuse(key, complaint);
    }

    // Key "kind": makes the alternative of that name, whose keys belong to the same table.
    template <class... Kinds>
    void kind(std::variant<Kinds...>& target) {
        const std::vector<std::string> names{Kinds::kind...};
        find("kind", expected(names), required, decides);
        const toml::node* node = table_.get("kind");
        if (!node) {
            if (pass_ == Pass::values) throw Unreadable();
            return;
        }
        const std::size_t before = complaints_.found.size();
        collect(
            [&] {
                const std::string& name = names[one_of(*node, path_of("kind"), names)];
                ((name == Kinds::kind ? void(target = Kinds{}) : void()), ...);
            },
            decides);
        if (complaints_.found.size() > before) throw Unreadable();
    }

    // An absent table is read like an empty one: required keys are missing, the rest have their defaults.
    template <class Describe>
    void table(const std::string& key, const Describe& describe, const std::string& what = "a table") {
        const toml::node* node = find(key, what, false);
        if (pass_ == Pass::names || (!node && was_meant(key))) return;
        const toml::table absent;
        collect([&] {
            read(node ? as_table(*node, path_of(key), what) : absent, path_of(key), node ? where(*node) : where_,
                 complaints_, describe);
        });
    }

    // The target stays empty where the table is absent.
    template <class T, class Describe>
    void optional_table(const std::string& key, std::optional<T>& target, const Describe& describe) {
        const toml::node* node = find(key, "a table", false);
        if (!node) return;
        collect([&] {
            read(as_table(*node, path_of(key)), path_of(key), where(*node), complaints_,
                 [&](Reader& k) { describe(k, target ? *target : target.emplace()); });
        });
    }

    template <class T, class Describe>
    void tables(const std::string& key, std::vector<T>& target, const Describe& describe) {
        const toml::node* node = find(key, "a list of tables", false);
        if (!node) return;
        collect([&] {
            const toml::array& list = as_list(*node, path_of(key), "a list of tables, [[" + path_of(key) + "]]");
            target.assign(list.size(), T{});
            for (std::size_t i = 0; i < list.size(); ++i) {
                const std::string path = path_of(key) + "." + std::to_string(i);
                collect([&] {
                    read(as_table(list[i], path), path, where(list[i]), complaints_,
                         [&](Reader& k) { describe(k, target[i]); });
                });
            }
        });
    }

    template <class T, class Describe>
    void entries(const OpenNames& names, std::vector<T>& target, std::string T::*name, const Describe& describe) {
        if (pass_ == Pass::names) {
            names_.insert(names_.end(), names.listed.begin(), names.listed.end());
            accepts_ = names.accepts;
            return;
        }
        for (const auto& [key, node] : table_) {
            if (!names.accepts(key.str())) continue;
            T entry;
            entry.*name = key.str();
            table(
                entry.*name, [&](Reader& k) { describe(k, entry); }, names.form);
            target.push_back(std::move(entry));
        }
    }

    // `key` is relative to this table, "" the table itself; if it is absent, the enclosing table is reported.
    template <class Complain>
    void check(const std::string& key, const Complain& complain) {
        if (pass_ == Pass::names || complaints_.any()) return;
        const std::string complaint = complain();
        if (!complaint.empty()) refuse(key, complaint);
    }

private:
    enum class Pass { names, values };
    static constexpr bool decides = true;  // which keys there are, here or in other tables
    struct Unreadable {};                  // a table of which it is not known which keys it has

    Reader(const toml::table& table, const std::string& path, const std::string& where, Complaints& complaints,
           Pass pass)
        : table_(table), path_(path), where_(where), complaints_(complaints), pass_(pass) {}

    template <class Take>
    void collect(const Take& take, bool in_doubt = false) {
        try {
            take();
        } catch (const CaseErrors& error) {
            complaints_.found.insert(complaints_.found.end(), error.complaints.begin(), error.complaints.end());
            complaints_.keys_in_doubt = complaints_.keys_in_doubt || in_doubt;
        }
    }
    const toml::node* find(const std::string& key, const std::string& what, bool needed, bool in_doubt = false);
    bool was_meant(const std::string& key) const;
    [[noreturn]] void refuse_missing(const std::string& key, const std::string& what) const;
    void refuse_unknown();
    void refuse(const std::string& key, const std::string& complaint);

    // Whether the key is there. `take` says whether the value is what `what` says, and takes it if so.
    template <class Take>
    bool value(const std::string& key, const std::string& what, bool needed, const Take& take);
    std::shared_ptr<const Formula> formula_in(const toml::node& node, const std::string& key,
                                              std::span<const std::string_view> variables) const;
    void ramp_in(const toml::table& table, const std::string& key, Ramp& target);
    std::string path_of(const std::string& key) const;
    std::string where(const toml::node& node) const;
    std::string where_in(const toml::node& node, std::size_t character) const;

    bool allows(double x, Range range) const;
    double number_in(const toml::node& node, const std::string& path, const Range& range) const;
    int integer_in(const toml::node& node, const std::string& path, const Range& range) const;
    std::size_t one_of(const toml::node& node, const std::string& path, const std::vector<std::string>& names) const;
    const toml::table& as_table(const toml::node& node, const std::string& path,
                                const std::string& what = "a table") const;
    const toml::array& as_list(const toml::node& node, const std::string& path, const std::string& what) const;

    static std::string expected(const std::string& noun, const Range& range);
    static std::string expected(const std::vector<std::string>& names);

    const toml::table& table_;
    std::string path_, where_;
    Complaints& complaints_;
    Pass pass_;
    std::vector<std::string> names_, meant_;  // meant_: keys that unknown ones are near misses of
    bool (*accepts_)(std::string_view) = nullptr;
};

}  // namespace tubule
