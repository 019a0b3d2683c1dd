// One point of a scan in three dimensions: its case, and what its result says of the outcome in tier 1.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/case/case.hpp"
#include "common/result/result.hpp"
#include "common/theory/dispersion.hpp"
#include "tools/scan/point.hpp"

namespace tubule::confirm {

struct Choices {
    int elements = 400;         // about how many triangles
    double noise = 1e-3;        // amplitude of each wave that is added, relative to the radius
    std::optional<double> end;  // instead of time.end of the case
};

// A wave with m >= 1 of a tube (n waves along it), or of a sphere (n stands for l).
struct AddedWave {
    int n = 1, m = 1;
};

// Of a tube m = 1 and 2, each with n = 1 and with the n that fits and grows fastest on the straight tube of the start
// or, for a tube that came to rest, of its end. Of a sphere l = 2, m = 1 and 2; l = 3, m = 1. Throws CaseError for
// other shapes.
std::vector<AddedWave> added_waves(const Case& c, const PointResult& axisymmetric);

// The case as one of tier surface3d, as TOML text, with these waves added to its start. Choices that belong to tier 1,
// time.stationary and [expect] are left out: a symmetric shape at rest may be none in three dimensions.
std::string surface_case(const Case& c, const std::vector<AddedWave>& waves, const Choices& choices);

enum class Verdict {
    agrees,
    symmetry_broken,  // a wave with m >= 1 has become large
    wave_grows,       // one grows, but is small yet
    other_outcome,
    no_answer  // the numerics gave up in three dimensions
};
std::string_view name(Verdict verdict);

// A wave grows if it is twice as large as all added waves were together at the start, and has become large with 1 % of
// the radius.
inline constexpr double growing = 2, large_wave = waves_of_uniform_tube;

struct Answer {
    Verdict verdict = Verdict::no_answer;
    Outcome outcome = Outcome::undecided;  // by the radii alone; without meaning where the symmetry is broken
    Stop stop = Stop::finished;
    double time = 0;                  // of the stop
    double energy_difference = 0;     // where both tiers are there last, relative to E_ref
    double energy_error = 0;          // as the run in three dimensions states it
    AddedWave largest;                // wave with m >= 1 at the end
    double noise = 0, amplitude = 0;  // of all added waves at the start, and of the largest one; relative to the radius
};

// Throws std::runtime_error if the result is incomplete.
Answer answer(const Case& c, const PointResult& axisymmetric, const std::vector<AddedWave>& waves,
              const Result& surface);

// Why a symmetric tube may lose its symmetry: for m = 0, 1, 2 the wave that fits and grows fastest (or decays slowest),
// in closed form, on the straight tube of the start and of tier 1's end.
struct Explanation {
    double radius = 1, tension = 0;
    std::vector<theory::FittingWave> waves;
};
std::vector<Explanation> explain(const Case& c, const PointResult& axisymmetric);

}  // namespace tubule::confirm
