#include "common/run/energy_checks.hpp"

#include <fmt/format.h>

#include "common/case/read.hpp"

namespace tubule {

void require_defined(const Case& c, const FormulaDomain::Margin& margin, const std::string& where) {
    if (margin.value > 0) return;
    std::size_t entry = 0;
    for (const EnergyTerm& term : c.energy.terms)
        if (term.formula) entry = term.entry;
    throw complaint(c, fmt::format("energy.term.{}.formula", entry),
                    fmt::format("must be defined on the start, but at {} {}", where, words(margin)));
}

std::string key_of_ill_posed(const Bending& energy) {
    std::string key;
    for (std::size_t term = 0; term < count_terms(energy); ++term) {
        Bending alone;
        if (term < n_bending_terms)
            alone.k[term] = energy.k[term];
        else
            alone.terms = {energy.terms[term - n_bending_terms]};
        if (modulus(energy, term) != 0 && symbol_may_vanish(alone))
            key = key.empty() ? term_key(energy, term) : "energy";
    }
    return key.empty() ? "energy" : key;
}

StopReport undefined_energy(const FormulaDomain::Margin& margin, double time, const std::string& where) {
    return {Stop::undefined, time, fmt::format("the energy is hardly defined any more at {}: {}", where, words(margin)),
            "choose a formula that is defined for all curvatures which the membrane may take"};
}

}  // namespace tubule
