#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/case/keys.hpp"
#include "common/case/read.hpp"
#include "common/case/requirements.hpp"
#include "common/case/text.hpp"

namespace tubule {

namespace {

// With the digits that read back exactly; without a fraction as an integer, but -0, which as an integer has no sign.
template <class T>
std::string toml_number(T value) {
    const std::string digits = fmt::format("{}", value);
    return digits == "-0" ? "-0.0" : digits;
}

std::string toml_list(const std::vector<double>& values) {
    std::vector<std::string> numbers;
    for (const double value : values) numbers.push_back(toml_number(value));
    return fmt::format("[{}]", fmt::join(numbers, ", "));
}

// The visitor that writes a table by the descriptions of keys.hpp: its own keys first, as TOML requires, then its
// tables. Keys that the case cannot have are left out.
class Writer {
public:
    static constexpr bool required = true;

    Writer(const Problem& p, const std::string& path) : problem_(p), path_(path) {}

    template <class T>
    void number(const std::string& key, const T& value, const Range& = {}, bool = false) {
        if constexpr (std::is_same_v<T, typename without_optional<T>::type>)
            line(key, toml_number(value));
        else if (value)
            line(key, toml_number(*value));
    }

    template <class T>
    void integer(const std::string& key, const T& value, const Range&, bool = false) {
        number(key, value);
    }

    template <class T>
    void choice(const std::string& key, const T& value, const Choices<T>& choices, bool = false) {
        for (const auto& [name, meaning] : choices)
            if (value == meaning) line(key, toml_string(name));
    }

    void flag(const std::string& key, bool value) { line(key, value ? "true" : "false"); }
    void text(const std::string& key, const std::string& value, bool = false, const std::string& = {}) {
        if (!value.empty()) line(key, toml_string(value));
    }
    void increasing(const std::string& key, const std::vector<double>& values, const Range&) {
        if (!values.empty()) line(key, toml_list(values));
    }
    void ramp(const std::string& key, const Ramp& ramp) {
        line(key, ramp.times().empty()
                      ? toml_number(ramp.values().front())
                      : fmt::format("{{time = {}, value = {}}}", toml_list(ramp.times()), toml_list(ramp.values())));
    }

    void ramp(const std::string& key, const std::optional<Ramp>& values) {
        if (values) ramp(key, *values);
    }

    void ramp_or_formula(const std::string& key, const Ramp& values, const std::shared_ptr<const Formula>& formula,
                         std::span<const std::string_view>) {
        if (formula)
            line(key, toml_string(formula->text));
        else
            ramp(key, values);
    }

    void formula(const std::string& key, const std::shared_ptr<const Formula>& formula,
                 std::span<const std::string_view>, bool = false) {
        if (formula) line(key, toml_string(formula->text));
    }

    void number_or_formula(const std::string& key, double number, const std::shared_ptr<const Formula>& formula,
                           std::span<const std::string_view>) {
        if (formula && formula->text.empty()) return;  // from the file of a profile
        line(key, formula ? toml_string(formula->text) : toml_number(number));
    }

    void absent(const std::string&, const std::string&) {}

    template <class... Kinds>
    void kind(const std::variant<Kinds...>& value) {
        std::visit([&](const auto& which) { line("kind", toml_string(which.kind)); }, value);
    }

    template <class Describe>
    void table(const std::string& key, const Describe& describe) {
        Writer inner(problem_, path_of(key));
        describe(inner);
        if (!inner.empty() && can_have(problem_, path_of(key)))
            sections_ += fmt::format("\n[{}]\n{}", inner.path_, inner.document());
    }

    template <class T, class Describe>
    void optional_table(const std::string& key, std::optional<T>& value, const Describe& describe) {
        if (!value) return;
        Writer inner(problem_, path_of(key));
        describe(inner, *value);
        sections_ += fmt::format("\n[{}]\n{}", inner.path_, inner.document());
    }

    template <class T, class Describe>
    void tables(const std::string& key, std::vector<T>& values, const Describe& describe) {
        for (T& value : values) {
            Writer inner(problem_, path_of(key));
            describe(inner, value);
            sections_ += fmt::format("\n[[{}]]\n{}", inner.path_, inner.document());
        }
    }

    template <class T, class Describe>
    void entries(const OpenNames&, std::vector<T>& values, std::string T::*name, const Describe& describe) {
        for (T& value : values) {
            const std::string key = value.*name;
            Writer inner(problem_, path_of(key));
            describe(inner, value);
            line(key, fmt::format("{{{}}}", fmt::join(inner.lines_, ", ")));
        }
    }

    template <class Complain>
    void check(const std::string&, const Complain&) {}

    bool empty() const { return lines_.empty() && sections_.empty(); }
    std::string document() const {
        return fmt::format("{}{}{}", fmt::join(lines_, "\n"), lines_.empty() ? "" : "\n", sections_);
    }

private:
    std::string path_of(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
    void line(const std::string& key, const std::string& value) {
        if (can_have(problem_, path_of(key))) lines_.push_back(key + " = " + value);
    }

    const Problem& problem_;
    std::string path_;
    std::vector<std::string> lines_;
    std::string sections_;
};

}  // namespace

std::string effective_toml(const Case& c) {
    const Problem problem(c);
    Writer writer(problem, "");
    Case copy = c;  // a description takes its targets by reference; the writer leaves them as they are
    keys(writer, copy);
    return writer.document();
}

}  // namespace tubule
