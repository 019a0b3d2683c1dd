#include "tools/scan/uniform_fate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace tubule {
namespace {

constexpr double small_wave = 0.01;     // amplitude / radius
constexpr double small_excess = 1e-3;   // energy of the waves / energy scale of the straight tube
constexpr double margin = 0.1;          // of the rates, against what small waves do to them
constexpr double radius_ratio = 1.05;   // between radii that are looked at
constexpr double largest_growth = 1e3;  // of a radius that never rests

// The density and its derivatives in H on a straight tube.
CurvatureJet<double> on_tube(const Bending& energy, double R) {
    return density<double>(energy, -1 / R, 0);
}

double energy_scale(const Bending& energy, double R) {
    return magnitude(energy, -1 / R, 0);
}

}  // namespace

std::optional<UniformFate> UniformFate::of(const Problem& c) {
    const auto* tube = std::get_if<Tube>(&c.shape);
    if (!tube || !c.is_axisymmetric() || c.unknowns == Unknowns::equilibrium) return std::nullopt;
    const MotionLaw& law = c.law;
    if (!law.unconstrained() || !law.without_loads() || c.energy.alpha) return std::nullopt;
    for (const double H : {-3.0, -1.0, -0.3, 0.7})
        if (density<double>(c.energy, H, 0).HK != 0) return std::nullopt;
    int waves = 0;
    for (const TubeMode& mode : tube->modes)
        if (mode.amplitude != 0) waves = std::gcd(waves, mode.n);
    return UniformFate(c.energy, tube->length, std::max(waves, 1), c.accuracy.r_min);
}

// d log R / dt of the straight tube.
double UniformFate::drift(double R) const {
    const auto f = on_tube(energy_, R);
    return -(f.f + f.H / R) / (R * R);
}

// Whether a/R decays for every wave of amplitude a. With y = q^2 and Z = y - 1/R^2 the rate
// -[F2 Z^2 + (f + F1/R) Z - 2 F1 y/R + 2 k42 y^2/R^2] is a parabola in y: its highest places are looked at.
bool UniformFate::waves_decay(double R) const {
    const auto f = on_tube(energy_, R);
    const double R2 = R * R, F1 = f.H, F2 = f.HH, base = f.f + F1 / R;
    // f_KK K_y^2, where a wave bends the tube by K = q^2 a/R: k42 enters as 2 k42 = f_KK.
    const double quadratic = F2 + f.KK / R2, linear = -2 * F2 / R2 + base - 2 * F1 / R;
    if (!(quadratic > margin * std::abs(F2))) return false;  // else ill-posed, or nearly so
    const double longest = 2 * std::numbers::pi * waves_ / length_;
    const double highest = std::sqrt(std::max(-linear / (2 * quadratic), 0.0)) / longest;
    for (const double n : {1.0, std::floor(highest), std::ceil(highest)}) {
        const double y = std::pow(std::max(n, 1.0) * longest, 2), Z = y - 1 / R2;
        const double terms[]{F2 * Z * Z, base * Z, -2 * F1 * y / R, f.KK * y * y / R2, drift(R)};
        const double rate = -(terms[0] + terms[1] + terms[2] + terms[3]) - terms[4];
        double size = 0;
        for (const double term : terms) size = std::max(size, std::abs(term));
        if (!(rate < -margin * size)) return false;
    }
    return true;
}

// Where a straight tube of radius R goes, to within a step of radius_ratio.
double UniformFate::radius_at_rest(double R) const {
    const double first = drift(R), step = first > 0 ? radius_ratio : 1 / radius_ratio;
    if (first == 0) return R;
    double at = R;
    while (at < largest_growth * R && at > floor_ && drift(at) * first > 0) at *= step;
    return at;
}

bool UniformFate::decided(const TubeState& s) const {
    if (!(s.r_max - s.r_min <= small_wave * (s.r_max + s.r_min))) return false;
    const double R = std::sqrt(s.volume / (std::numbers::pi * length_)), area = 2 * std::numbers::pi * R * length_;
    if (!(std::abs(s.energy - area * on_tube(energy_, R).f) <= small_excess * area * energy_scale(energy_, R)))
        return false;
    const double rest = radius_at_rest(R), low = std::min(R, rest), high = std::max(R, rest);
    if (low <= floor_) return false;  // it ends as a neck would
    for (double at = low; at < high * radius_ratio; at *= radius_ratio)
        if (!waves_decay(std::min(at, high))) return false;
    return true;
}

}  // namespace tubule
