#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/case/read.hpp"
#include "tools/compare/results.hpp"
#include "tools/confirm/confirm.hpp"

namespace tubule::confirm {
namespace {

constexpr int last_m = 4, modes = 12;
constexpr double accuracy = 1e-4;
constexpr double neutral = 1e-3;  // of the fastest decay: smaller rates have no sign

double last(const Result& result, const std::string& name) {
    const auto found = result.series.find(name);
    if (found == result.series.end() || found->second.empty()) return not_known;
    return found->second.back();
}

// Rates by m, several of one m in three dimensions.
using Rates = std::vector<std::pair<int, double>>;

Rates rates_of_profile(const Result& result) {
    Rates out;
    for (int m = 0; m <= last_m; ++m)
        if (const double rate = last(result, fmt::format("growth_{}", m)); std::isfinite(rate))
            out.emplace_back(m, rate);
    return out;
}

Rates rates_of_surface(const Result& result) {
    Rates out;
    for (int i = 1; i <= modes; ++i)
        if (const double rate = last(result, fmt::format("rate_{}", i)); std::isfinite(rate))
            out.emplace_back(static_cast<int>(last(result, fmt::format("wave_number_{}", i))), rate);
    return out;
}

double size_of(const Rates& rates) {
    double out = 0;
    for (const auto& [m, rate] : rates) out = std::max(out, std::abs(rate));
    return out;
}

// With rates above `least`; of those that tier axisym looks for.
std::set<int> growing(const Rates& rates, double least) {
    std::set<int> out;
    for (const auto& [m, rate] : rates)
        if (m <= last_m && rate > least) out.insert(m);
    return out;
}

bool includes(const std::set<int>& a, const std::set<int>& b) {
    return std::includes(a.begin(), a.end(), b.begin(), b.end());
}

}  // namespace

std::string profile_case(const Problem& c) {
    Case out = c;
    out.equilibrium->modes = std::max(c.equilibrium->modes.value_or(0), last_m);
    out.expect = {};
    const std::string text = effective_toml(out);
    parse_case(text, {}, c.path);
    return text;
}

std::string lifted_case(const Problem& c, const Result& profile, const std::string& path, std::optional<int> elements) {
    Case out = c.of_surface();
    out.shape = ResultFrame{.path = path};
    out.accuracy.energy = std::max(c.accuracy.energy, accuracy);
    out.discretisation = {};
    out.surface = {};
    out.surface.elements = elements;
    out.expect = {};
    EquilibriumChoices& e = *out.equilibrium;
    e.family.reset(), e.modes.reset();
    e.held = c.held, e.descend = false, e.rates = modes;
    // As tier axisym held them, not as the triangles of the initial shape have them.
    if (holds_area(c.held)) e.area = last(profile, "area");
    if (holds_volume(c.held)) e.volume = last(profile, "volume"), e.reduced_volume.reset();
    if (c.held == Held::reduced_volume) e.reduced_volume = last(profile, "reduced_volume");
    const std::string text = effective_toml(out);
    parse_case(text, {}, c.path);
    return text;
}

EquilibriumEnd equilibrium_end(const Result& profile, const Result& surface) {
    EquilibriumEnd a;
    a.axisym_stop = compare::stop_word(profile), a.stop = compare::stop_word(surface);
    if (!stop_from_name(a.axisym_stop) || !stop_from_name(a.stop))
        throw std::runtime_error("the result is not complete");
    if (a.axisym_stop != name(Stop::finished) || a.stop != name(Stop::finished)) return a;
    a.axisym_energy = last(profile, "energy"), a.energy = last(surface, "energy");
    const double E_ref = compare::reference_energy(surface);
    a.energy_difference = (a.energy - a.axisym_energy) / E_ref;
    a.energy_error = (last(profile, "energy_error") + last(surface, "energy_error")) / E_ref;

    const Rates of_profile = rates_of_profile(profile), of_surface = rates_of_surface(surface);
    const double least_profile = neutral * size_of(of_profile), least = neutral * size_of(of_surface);
    a.axisym_growing = growing(of_profile, least_profile), a.growing = growing(of_surface, least);
    if (!of_surface.empty()) {
        a.m = of_surface.front().first, a.rate = of_surface.front().second;
        for (const auto& [m, rate] : of_profile)
            if (m == a.m) a.axisym_rate = rate;
    }
    // What grows in one tier is at least neutral in the other. With a free period tier axisym has no rates of m = 0.
    std::set<int> allowed = growing(of_profile, -least_profile);
    if (std::isnan(last(profile, "growth_0"))) allowed.insert(0);
    const bool same = includes(growing(of_surface, -least), a.axisym_growing) && includes(allowed, a.growing);
    if (!same || std::abs(a.energy_difference) > 3 * a.energy_error)
        a.verdict = Verdict::other_outcome;
    else
        a.verdict = a.growing.empty() || *a.growing.rbegin() == 0 ? Verdict::agrees : Verdict::symmetry_broken;
    return a;
}

}  // namespace tubule::confirm
