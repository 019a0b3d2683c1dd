// Why runs of all tiers stop. `where` is a place in the words of the tier, such as "z = 0.3".
#pragma once

#include <string>

#include "common/case/problem.hpp"
#include "common/solve/stop.hpp"

namespace tubule {

StopReport neck_closed(double radius, const std::string& where, double time);
StopReport ill_posed(const std::string& where, double time);
StopReport behind_wall(const std::string& where, double time);

// The next step would raise the total energy by this part of E_ref, though no law of motion lets it rise.
StopReport energy_rises(double rise, double time);

// `what`, for example "an element near s = 0.3 is", exceeds by the factor `times` the length that resolves the shortest
// growing wave where kg > 0: theory.md (2.26). `refine` says how to use more elements.
StopReport unresolved_waves(const std::string& what, double times, double time, const std::string& refine);

// A run comes too near to where a formula of the energy, or of the pressure, is not defined. may_be_undefined():
// whether a run that failed came near to that.
StopReport undefined_energy(const FormulaDomain::Margin& margin, double time, const std::string& where);
StopReport undefined_pressure(const FormulaDomain::Margin& margin, double time);
inline bool may_be_undefined(const FormulaDomain::Margin& margin) {
    return margin.value < 0.05;
}

}  // namespace tubule
