#include "common/energy/bending.hpp"

#include <fmt/format.h>

#include <limits>
#include <numbers>

namespace tubule {
namespace {

int order(const EnergyTerm& term) {
    return term.H + 2 * term.K;
}

bool is_square_or_flat(const EnergyTerm& term) {
    if (term.formula) return false;
    if (term.H + term.K <= 1) return true;  // no second derivatives
    return term.modulus >= 0 && ((term.K == 0 && term.H % 2 == 0) || (term.H == 0 && term.K % 2 == 0));
}

// The lowest density of surfaces whose principal curvatures are of this size, and where, as an angle in their plane.
// The multiples of K are left out: their integral is the same for all shapes. With a gradient term only straight tubes
// and spheres count, where it vanishes.
std::pair<double, double> lowest(Bending bending, double size) {
    std::erase_if(bending.terms, [](const EnergyTerm& t) { return !t.formula && t.H == 0 && t.K == 1; });
    constexpr int angles = 720;  // cylinders, saddles and spheres among them
    std::pair<double, double> least{std::numeric_limits<double>::infinity(), 0};
    for (int i = 0; i < angles; ++i) {
        const double angle = 2 * std::numbers::pi * i / angles;
        const bool along_axis = i % (angles / 4) == 0, saddle = i % (angles / 4) == angles / 8 && i / (angles / 4) % 2;
        const bool sphere = i % (angles / 4) == angles / 8 && !saddle;
        if (bending.kg != 0 && !along_axis && !sphere) continue;
        const double a = size * std::cos(angle), b = size * std::sin(angle);
        const double f = density(bending, saddle ? 0 : a + b, along_axis ? 0 : a * b).f;
        const double terms = magnitude(bending, saddle ? 0 : a + b, along_axis ? 0 : a * b);
        if (f < least.first && !(std::abs(f) < 1e-9 * terms)) least = {f, angle};
    }
    return least;
}

}  // namespace

std::string term_name(const EnergyTerm& term) {
    if (term.formula) return "formula";
    return order(term) < 10 ? fmt::format("{}{}", order(term), term.K) : fmt::format("{}_{}", order(term), term.K);
}

std::string term_label(const EnergyTerm& term) {
    if (term.formula) return "k f(H,K)";
    const auto power = [](const std::string& base, int n) {
        return n == 0 ? "" : n == 1 ? base : fmt::format("{}^{{{}}}", base, n);
    };
    std::string name = term_name(term);
    std::ranges::replace(name, '_', ',');
    return fmt::format("k_{{{}}}{}{}", name, power("(H-H_0)", term.H), power("K", term.K));
}

std::string term_label(std::string_view name) {
    if (name == "kg") return "k_g|\\nabla H|^2";
    std::string label = "k f(H,K)";
    bool listed = name == "formula";
    for_each_bending_term([&](std::size_t, const auto& term) {
        if (name == term.name) label = term.label, listed = true;
    });
    if (listed) return label;
    const std::size_t bar = name.find('_'), digits = bar == name.npos ? 1 : bar;
    const int order = std::stoi(std::string(name.substr(0, digits))),
              K = std::stoi(std::string(name.substr(bar == name.npos ? 1 : bar + 1)));
    return term_label(EnergyTerm{.H = order - 2 * K, .K = K});
}

std::vector<std::string> term_names(const Bending& bending) {
    std::vector<std::string> out;
    for_each_bending_term([&](std::size_t, const auto& term) { out.emplace_back(term.name); });
    for (const EnergyTerm& term : bending.terms) out.push_back(term_name(term));
    return out;
}

std::string term_key(const Bending& bending, std::size_t term) {
    if (term >= n_bending_terms)
        return fmt::format("energy.term.{}.modulus", bending.terms[term - n_bending_terms].entry);
    std::string key = "energy.";
    for_each_bending_term([&](std::size_t i, const auto& listed) {
        if (i == term) key += listed.key;
    });
    return key;
}

std::size_t listed_as(const EnergyTerm& term) {
    std::size_t out = n_bending_terms;
    for_each_bending_term([&](std::size_t i, const auto& listed) {
        if (term_name(term) == listed.name) out = i;
    });
    return out;
}

void merge_listed_terms(Bending& bending) {
    std::erase_if(bending.terms, [&](const EnergyTerm& term) {
        const std::size_t listed = listed_as(term);
        if (listed < n_bending_terms) bending.k[listed] += term.modulus;
        return listed < n_bending_terms;
    });
}

bool symbol_may_vanish(const Bending& bending) {
    return bending.kg == 0 && (std::ranges::any_of(bending.k, [](double k) { return k < 0; }) ||
                               !std::ranges::all_of(bending.terms, is_square_or_flat));
}

std::string unbounded_below(const Bending& bending) {
    if (bending.terms.empty() && std::ranges::all_of(bending.k, [](double k) { return k >= 0; })) return {};
    constexpr double large = 1e11, larger = 1e12, falls = 1e-3;
    const double before = lowest(bending, large).first;
    const auto [after, angle] = lowest(bending, larger);
    if (!(after < 0) || !(after < before - falls * std::abs(before))) return {};
    if (bending.kg != 0)
        return fmt::format(
            "the energy has no lower bound: that of {} falls without end, as grad H = 0 there whatever energy.kg is",
            std::abs(std::abs(std::cos(angle)) - std::abs(std::sin(angle))) < 0.1 ? "ever smaller spheres"
                                                                                  : "ever thinner straight tubes");
    const double larger_one = std::max(std::abs(std::cos(angle)), std::abs(std::sin(angle)));
    return fmt::format(
        "the energy density f(H,K) has no lower bound: it falls without end as the principal curvatures grow like "
        "{:.2g}*t and {:.2g}*t; a membrane may gain energy by bending ever more sharply, which no mesh resolves",
        std::cos(angle) / larger_one, std::sin(angle) / larger_one);
}

}  // namespace tubule
