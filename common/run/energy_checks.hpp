// What is refused, warned of or stops a run because of its energy.
#pragma once

#include <string>

#include "common/case/case.hpp"
#include "common/solve/stop.hpp"

namespace tubule {

// Throws CaseError where the formula of the energy is not defined on the start; `where` is the place of the margin.
void require_defined(const Case& c, const FormulaDomain::Margin& margin, const std::string& where);

// The stop of a run that comes too near to where the formula is not defined.
StopReport undefined_energy(const FormulaDomain::Margin& margin, double time, const std::string& where);

// The key of what makes an energy ill-posed: the only term whose symbol, theory.md (2.14), can be negative, or "energy".
std::string key_of_ill_posed(const Bending& energy);

// Whether a run that failed came near to that.
inline bool may_be_undefined(const FormulaDomain::Margin& margin) {
    return margin.value < 0.05;
}

}  // namespace tubule
