// The scale of errors of the energy, and warnings where the tolerance exceeds the energy or its change.
#pragma once

#include <string>

#include "common/case/case.hpp"
#include "common/solve/stop.hpp"

namespace tubule {

// E_ref of a run from its initial energy or from (11.1), as the case has it. Throws CaseError where that energy is too
// small to be a scale, or where the formula of a case has no finite value.
double reference_energy(const Case& c, double energy, double by_magnitude);

// The warning, or empty; energies of the surface, E_ref as above. Before a run: errors may exceed the energy. After it:
// they may exceed the fall of the energy, kinetic energy included.
std::string doubt_before(const Case& c, double energy, double E_ref);
std::string doubt_after(const Case& c, Stop stop, double start, double end, double E_ref);

}  // namespace tubule
