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

StopReport undefined_energy(const FormulaDomain::Margin& margin, double time, const std::string& where) {
    return {Stop::undefined, time, fmt::format("the energy is hardly defined any more at {}: {}", where, words(margin)),
            "choose a formula that is defined for all curvatures which the membrane may take"};
}

}  // namespace tubule
