#include "common/run/energy_checks.hpp"

#include <fmt/format.h>

namespace tubule {

namespace {

// Places of keys tell which term of powers became one of the list.
std::string as_written(const Case& c, const std::string& key) {
    const auto place = c.places.find(key);
    if (place == c.places.end()) return key;
    for (std::size_t entry = 0;; ++entry) {
        const std::string name = fmt::format("energy.term.{}.modulus", entry);
        const auto other = c.places.find(name);
        if (other == c.places.end()) return key;
        if (other->second == place->second) return name;
    }
}

}  // namespace

std::string key_of_formula(const Bending& energy) {
    for (const EnergyTerm& term : energy.terms)
        if (term.formula) return fmt::format("energy.term.{}.formula", term.entry);
    return "energy";
}

CaseError not_defined(const Case& c, const FormulaDomain::Margin& margin, const std::string& where) {
    return complaint(c, key_of_formula(c.energy),
                     fmt::format("must be defined on the start, but at {} {}", where, words(margin)));
}

void require_defined(const Case& c, const FormulaDomain::Margin& margin, const std::string& where) {
    if (!(margin.value > 0)) throw not_defined(c, margin, where);
}

std::string key_of_ill_posed(const Case& c) {
    const Bending& energy = c.energy;
    std::string key;
    for (std::size_t term = 0; term < count_terms(energy); ++term) {
        Bending alone;
        if (term < n_bending_terms)
            alone.k[term] = energy.k[term];
        else
            alone.terms = {energy.terms[term - n_bending_terms]};
        if (modulus(energy, term) != 0 && symbol_may_vanish(alone))
            key = key.empty() ? as_written(c, term_key(energy, term)) : "energy";
    }
    return key.empty() ? "energy" : key;
}

StopReport undefined_energy(const FormulaDomain::Margin& margin, double time, const std::string& where) {
    return {Stop::undefined, time, fmt::format("the energy is hardly defined any more at {}: {}", where, words(margin)),
            "choose a formula that is defined for all curvatures which the membrane may take"};
}

}  // namespace tubule
