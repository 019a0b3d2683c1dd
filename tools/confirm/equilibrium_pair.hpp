// An equilibrium of a scan in both tiers: its cases, and whether the results say the same.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "tools/confirm/surface_point.hpp"

namespace tubule::confirm {

// The case alone in tier axisym, with growth rates for m up to 4, as TOML text.
std::string profile_case(const Problem& c);

// In tier surface3d, as TOML text: the same quantities held, from the result of profile_case() at this path, with the
// 12 slowest modes; on about this many triangles, or as many as an error of the energy of 1e-4 needs. Throws CaseError
// where this tier refuses the case.
std::string lifted_case(const Problem& c, const Result& profile, const std::string& path, std::optional<int> elements);

struct EquilibriumEnd {
    Verdict verdict = Verdict::no_answer;
    std::string axisym_stop, stop;
    double axisym_energy = not_known, energy = not_known;
    double energy_difference = not_known, energy_error = not_known;  // relative to E_ref; that stated by both together
    std::set<int> axisym_growing, growing;                           // wave numbers m of growing modes
    int m = -1;  // of the mode in three dimensions that grows fastest or decays slowest; -1: none
    double axisym_rate = not_known, rate = not_known;  // of gradient flow in 3D, by model.kind in tier axisym
};

// no_answer where one of them is no equilibrium; other_outcome where the energies differ by more than three times what
// both state, or the growing modes have other m; symmetry_broken where they agree on a growing mode with m >= 1. Rates
// below a thousandth of the fastest decay are neither. Throws std::runtime_error for incomplete results.
EquilibriumEnd equilibrium_end(const Result& profile, const Result& surface);

}  // namespace tubule::confirm
