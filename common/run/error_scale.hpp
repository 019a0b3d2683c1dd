// What errors of the energy are relative to, and whether errors as large as asked would hide what is asked for.
#pragma once

#include <string>

#include "common/case/case.hpp"
#include "common/solve/stop.hpp"

namespace tubule {

// E_ref of a run from the energy of its start and from (11.1), as the case has it. Throws CaseError where that energy
// is too small to be a scale, or where the formula of a case has no finite value.
double reference_energy(const Case& c, double energy, double by_magnitude);

// Words if so, else empty; energies of the surface, E_ref as above. Before a run: errors may be larger than
// the energy. After it: than what the energy, kinetic energy included, has fallen by.
std::string doubt_before(const Case& c, double energy, double E_ref);
std::string doubt_after(const Case& c, Stop stop, double start, double end, double E_ref);

}  // namespace tubule
