#include "common/case/units.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>
#include <vector>

#include "common/case/read.hpp"

namespace tubule {
namespace {

constexpr double boltzmann = 1.380649e-23;  // J/K, exact in the SI
constexpr double celsius = 273.15;          // its zero in K
constexpr double largest = 1e40;            // of a quantity in SI units: powers of it are numbers
constexpr double agreement = 0.05;          // of quantities that determine the same number

struct QuantityEntry {
    std::string_view example;
    std::vector<std::pair<std::string, double>> units;  // in SI units; kT times the temperature
};

const QuantityEntry& entry_of(QuantityKind kind) {
    static const std::array<QuantityEntry, 6> all{
        {{"50 nm", {{"nm", 1e-9}, {"um", 1e-6}, {"mm", 1e-3}, {"m", 1}}},
         {"20 kT", {{"kT", boltzmann}, {"J", 1}, {"aJ", 1e-18}, {"zJ", 1e-21}, {"pN nm", 1e-21}}},
         {"37 C", {{"C", 1}, {"K", 1}}},
         {"3e-9 Pa s m", {{"Pa s m", 1}, {"nPa s m", 1e-9}, {"N s/m", 1}, {"nN s/m", 1e-9}, {"uN s/m", 1e-6}}},
         {"5e-6 kg/m^2", {{"kg/m^2", 1}, {"g/m^2", 1e-3}, {"mg/m^2", 1e-6}}},
         {"2e4 Pa s/m", {{"Pa s/m", 1}, {"kPa s/m", 1e3}, {"N s/m^3", 1}}}}};
    return all[static_cast<std::size_t>(kind)];
}

// A number and the unit behind it, letters for signs that keyboards lack; nothing if there is no number.
std::optional<std::pair<double, std::string>> parts_of(const std::string& text) {
    double number = 0;
    const char *begin = text.data(), *end = begin + text.size();
    while (begin != end && *begin == ' ') ++begin;
    const auto read = std::from_chars(begin, end, number);
    if (read.ec != std::errc{} || !std::isfinite(number)) return std::nullopt;
    std::string unit(read.ptr, end);
    for (const auto& [sign, letter] : {std::pair{"\u00b5", "u"}, {"\u03bc", "u"}, {"\u00b0", ""}})
        if (const auto at = unit.find(sign); at != unit.npos) unit.replace(at, std::string(sign).size(), letter);
    const auto from = unit.find_first_not_of(' '), to = unit.find_last_not_of(' ');
    return std::pair{number, from == unit.npos ? "" : unit.substr(from, to - from + 1)};
}

// In SI units; of a text that is right.
double si(const std::string& text, QuantityKind kind, double temperature = 1) {
    const auto [number, unit] = parts_of(text).value();
    if (kind == QuantityKind::temperature) return unit == "C" ? number + celsius : number;
    const auto& units = entry_of(kind).units;
    const auto found = std::ranges::find(units, unit, &std::pair<std::string, double>::first);
    return number * found->second * (unit == "kT" ? temperature : 1);
}

// The unit of time by one of the quantities.
struct Clock {
    std::string key;
    double time;
};

// The first of those that the case has. The others must agree with it.
std::optional<Clock> clock_of(const Case& c, const Scales& s) {
    const Units& u = *c.units;
    const double R2 = s.length * s.length, gamma = c.model.gamma.value_or(1);
    std::optional<Clock> out;
    if (!u.density.empty()) out = {"units.density", std::sqrt(si(u.density, QuantityKind::density) / s.energy) * R2};
    if (!u.viscosity.empty()) {
        const double one = si(u.viscosity, QuantityKind::viscosity) * R2 / s.energy;  // with Re = 1
        if (out && !(std::abs(out->time / one - c.model.Re) <= agreement * c.model.Re))
            throw complaint(c, "units.viscosity",
                            fmt::format("makes model.Re {:.4g} with {}, not {:.4g}: change model.Re, or leave one of "
                                        "the two out",
                                        out->time / one, out->key, c.model.Re));
        if (!out) out = {"units.viscosity", c.model.Re * one};
    }
    if (u.friction.empty()) return out;
    const double one = si(u.friction, QuantityKind::friction) * R2 * R2 / s.energy;  // with gamma = 1
    if (out && !(std::abs(one / out->time - gamma) <= agreement * gamma))
        throw complaint(c, "units.friction",
                        fmt::format("makes model.gamma {:.4g} with {}, not {:.4g}: change model.gamma, or leave one of "
                                    "the two out",
                                    one / out->time, out->key, gamma));
    if (!out && !(gamma > 0)) throw complaint(c, "units.friction", "needs model.gamma > 0, for which it stands");
    return out ? out : Clock{"units.friction", one / gamma};
}

// ---- units to show

constexpr std::array<const char*, 10> prefixes{"a", "f", "p", "n", "u", "m", "", "k", "M", "G"};
constexpr int first_power = -18, powers_apart = 3;

// With the prefix that makes this number of it, such as one, a number from 1 to 1000, where there is one.
LabUnit prefixed(double si, const std::string& base, int largest_power = 9, double number = 1) {
    constexpr double rounding = 1e-9;
    const double digits = std::log10(si * number);
    const int power = std::clamp(static_cast<int>(std::floor(digits / powers_apart + rounding)) * powers_apart,
                                 first_power, largest_power);
    return {si * std::pow(10.0, -power), prefixes[(power - first_power) / powers_apart] + base};
}

// Powers of energy, length and time.
using Powers = std::array<int, 3>;
constexpr std::array<std::string_view, 3> dimensions{"energy", "length", "time"};

std::optional<Powers> powers_of(std::string_view unit) {
    Powers out{};
    int sign = 1;
    for (const std::string& part : split(unit, '/')) {
        for (const std::string& word : split(part, ' ')) {
            const std::size_t hat = word.find('^');
            const auto found = std::ranges::find(dimensions, word.substr(0, hat));
            if (found != dimensions.end())
                out[found - dimensions.begin()] += sign * (hat == word.npos ? 1 : std::stoi(word.substr(hat + 1)));
            else if (word != "1")
                return std::nullopt;
        }
        sign = -1;
    }
    return out;
}

LabUnit product(const std::array<LabUnit, 3>& units, const Powers& powers) {
    LabUnit out;
    std::vector<std::string> above, below;
    for (const std::size_t i : {0, 2, 1}) {
        const int p = powers[i];
        out.scale *= std::pow(units[i].scale, p);
        if (p != 0)
            (p > 0 ? above : below).push_back(units[i].name + (std::abs(p) > 1 ? fmt::format("^{}", std::abs(p)) : ""));
    }
    out.name = above.empty() ? "1" : fmt::format("{}", fmt::join(above, " "));
    for (const std::string& one : below) out.name += "/" + one;
    return out;
}

}  // namespace

std::string quantity_words(QuantityKind kind) {
    return fmt::format("a number with a unit, such as \"{}\"", entry_of(kind).example);
}

std::string wrong_quantity(const std::string& text, QuantityKind kind) {
    std::vector<std::string> names;
    for (const auto& [name, value] : entry_of(kind).units) names.push_back(name);
    const std::string words = fmt::format("must be {}, not {}", quantity_words(kind), toml_string(text));
    const auto parts = parts_of(text);
    if (!parts) return words;
    const auto& [number, unit] = *parts;
    if (unit.starts_with(",")) return words + "; decimals have a point";
    if (std::ranges::find(names, unit) == names.end())
        return fmt::format("{}; its unit is one of {}{}", words, fmt::join(names, ", "), meant_by(unit, names));
    const double value = si(text, kind, celsius);
    if (value >= 1 / largest && value <= largest) return {};
    return value > 0
               ? fmt::format("must be from {:g} to {:g} in SI units, not {}", 1 / largest, largest, toml_string(text))
               : fmt::format("must be above zero{}, not {}", kind == QuantityKind::temperature ? ", which is 0 K" : "",
                             toml_string(text));
}

Scales scales_of(const Case& c) {
    const Units& u = c.units.value();
    const double k20 = c.energy.k[term_number("k20")];
    if (!(k20 > 0)) throw complaint(c, "units.bending_rigidity", "needs energy.k20 > 0: it is 2 k20 units of energy");
    Scales s;
    s.temperature = si(u.temperature, QuantityKind::temperature);
    s.kT = boltzmann * s.temperature;
    s.length = si(u.length, QuantityKind::length);
    s.energy = si(u.bending_rigidity, QuantityKind::energy, s.temperature) / (2 * k20);
    if (const auto clock = clock_of(c, s)) s.time = clock->time, s.time_from = clock->key;
    for (const auto& [key, value] : {std::pair{"units.bending_rigidity", s.energy}, {"units", s.time.value_or(1)}})
        if (!(value >= 1e-200 && value <= 1e200))
            throw complaint(c, key, fmt::format("makes a unit of {:.3g} in SI units, which is none", value));
    return s;
}

std::optional<Scales> known_scales(const Case& c) {
    return c.units ? std::optional(scales_of(c)) : std::nullopt;
}

LabUnit lab_unit(const std::optional<Scales>& scales, std::string_view unit, double number) {
    const auto powers = powers_of(unit);
    if (!scales || !powers || *powers == Powers{} || ((*powers)[2] != 0 && !scales->time)) return {};
    const auto& [energy, length, time] = *powers;
    const double T = scales->time.value_or(1);
    static const std::array<std::pair<Powers, const char*>, 4> named{
        {{{1, -1, 0}, "N"}, {{1, -2, 0}, "N/m"}, {{1, -3, 0}, "Pa"}, {{0, 1, -1}, "m/s"}}};
    for (const auto& [of, name] : named)
        if (of == *powers) {
            const double si = std::pow(scales->energy, energy) * std::pow(scales->length, length) * std::pow(T, time);
            // What is far below one unit is mostly rounding of zero.
            const double size = std::isfinite(number) && std::abs(number) > 1e-6 ? std::abs(number) : 1;
            const bool of_tweezers = of == named[0].first && si * size > 1e-15 && si * size < 1e-9;
            return of_tweezers ? LabUnit{si * 1e12, "pN"} : prefixed(si, name, 9, size);
        }
    return product({{{scales->energy / scales->kT, "kT"}, prefixed(scales->length, "m", 0), prefixed(T, "s", 0)}},
                   *powers);
}

}  // namespace tubule
