// Points of a scan in three dimensions: which are worth it, their cases, and whether the results of both tiers say the
// same.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/case/problem.hpp"
#include "common/result/result.hpp"
#include "common/theory/dispersion.hpp"
#include "common/theory/growth_fit.hpp"
#include "tools/scan/outcome.hpp"
#include "tools/scan/plan.hpp"
#include "tools/scan/point.hpp"

namespace tubule::confirm {

// ---- motions

struct Choices {
    std::optional<int> elements;  // about how many triangles; 200 for motions
    double noise = 1e-3;          // amplitude of each wave that is added, relative to the radius
    std::optional<double> end;    // instead of time.end of the case
};

// The case as one of tier surface3d, as TOML text. Waves with m >= 1 are added to its start: to a tube n = 1 with m = 1
// and 2, and for each m the one of fastest_waves(); to a sphere l = 2 and 3 with m = 1, l = 2 with m = 2. There are
// 20 frames until tier 1's end or, where a wave with m >= 1 grows, while it grows by e^6; and 20 after that. Choices
// that belong to tier 1, time.stationary and [expect] are left out: a symmetric equilibrium may be none in three
// dimensions. Throws CaseError for other shapes.
std::string surface_case(const Problem& c, const PointResult& axisymmetric, const Choices& choices);

// For m = 0, 1, 2 the wave that fits and grows fastest (or decays slowest) in closed form, on the straight tube of the
// start; changes of the radius and moves of the whole are left out. Empty for other shapes.
std::vector<theory::FittingWave> fastest_waves(const Problem& c);

enum class Verdict {
    agrees,
    symmetry_broken,  // a wave with m >= 1 has grown
    other_outcome,
    no_answer  // the numerics failed in three dimensions, or it ended before tier 1 had its outcome
};
std::string_view name(Verdict verdict);

// The symmetry counts as broken when the largest wave is this many times the largest at the start.
inline constexpr double grown = 3;

inline constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

struct SurfaceEnd {
    Verdict verdict = Verdict::no_answer;
    Outcome outcome = Outcome::failed;  // by the radii alone; without meaning where the symmetry is broken
    std::string stop;
    double time = not_known;               // of the stop
    double energy_difference = not_known;  // from tier 1 at its end, relative to E_ref; if both were there
    double energy_error = not_known;       // as the run in three dimensions states it
    int n = 0, m = 0;                      // of the wave with m >= 1 that is largest at the end; l, m of a sphere
    double noise = not_known;              // the largest at the start, relative to the radius
    double amplitude = not_known;          // the one at the end
    theory::GrowthFit fit{.rate = not_known, .error = not_known};  // of that one over time
    double linear_rate = not_known;                                // by theory::mean_rate over the time of the fit
};

// Throws std::runtime_error if the result is incomplete.
SurfaceEnd surface_end(const PointResult& axisymmetric, const Result& surface);

// ---- equilibria

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

// ---- which points

enum class Why { boundary, extreme, random };
std::string_view name(Why why);

struct Pick {
    std::size_t point = 0;
    Why why = Why::random;
};

// At most `count` points that were run and did not fail, of a grid of this shape: half of them both sides of lines
// between outcomes (pairs of outcomes that are not there yet first, then far from those that are), a quarter corners of
// the grid, the rest at random. If one kind has too few, the next gets more. The same seed picks the same points.
std::vector<Pick> pick_points(const GridShape& shape, const std::vector<Outcome>& outcomes,
                              std::optional<Outcome> around, std::size_t count, unsigned seed);

}  // namespace tubule::confirm
