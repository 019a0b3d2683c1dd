// What is refused or warned of because of its energy, and the scale of errors of the energy. What stops runs:
// stops.hpp.
#pragma once

#include <string>

#include "common/case/problem.hpp"
#include "common/case/read.hpp"
#include "common/solve/stop.hpp"

namespace tubule {

// Throws CaseError where the formula of the energy is not defined initially; `where` is the place of the margin.
void require_defined(const Problem& c, const FormulaDomain::Margin& margin, const std::string& where);
CaseError not_defined(const Problem& c, const FormulaDomain::Margin& margin, const std::string& where);
// The key of the formula; "energy" if there is none.
std::string key_of_formula(const Bending& energy);

// CaseError where F, theory.md (3.24), has no value initially, as the pressure is a formula of the volume.
void require_pressure(const Problem& c, double volume);

// CaseError where potentials of places do not suit the initial shape: on a tube (period > 0) walls and formulas of
// another period, an energy INT W dS that is not finite, a point behind a wall (`distance` is the least one to a wall).
void refuse_potentials(const Problem& c, double period, double energy, double distance);

// CaseError where beads have no place on the initial shape: none with two poles, or poles that are too near.
void require_beads(const Problem& c, bool closed, double distance);

// CaseError for what would deform a sphere, or a straight tube with its period, of fixed area and volume: no other
// shape has these, and no multiplier then holds the volume.
void refuse_to_deform(const Problem& c);
// CaseError unless a formula of the place and of time, or the sources, have the period of a tube.
void require_period(const Problem& c, const char* key, const Formula& formula, double period);
void require_periodic_sources(const Problem& c, double period);

// The key of what makes an energy ill-posed: the only term whose symbol, theory.md (2.14), can be negative, or
// "energy". That which the case has: a term of powers may stand for one of the list.
std::string key_of_ill_posed(const Problem& c);

// E_ref of a run from its initial energy or from (11.1), as the case has it. Throws CaseError where that energy is too
// small to be a scale, or where the formula of a case has no finite value.
double reference_energy(const Problem& c, double energy, double by_magnitude);

// The warning that the tolerance exceeds the energy or its change, or empty; energies of the surface, E_ref as above.
// Before a run: errors may exceed the energy. After it: they may exceed the fall of the energy, kinetic energy
// included.
std::string doubt_before(const Problem& c, double energy, double E_ref);
std::string doubt_after(const Problem& c, Stop stop, double start, double end, double E_ref);

}  // namespace tubule
