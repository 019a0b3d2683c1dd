#include "tools/scan/uniform_end.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/theory/dispersion.hpp"

namespace tubule {
namespace {

constexpr double small_wave = 0.01;     // amplitude / radius
constexpr double small_excess = 1e-3;   // energy of the waves / energy scale of the straight tube
constexpr double margin = 0.1;          // of the rates, against what small waves do to them
constexpr double radius_ratio = 1.05;   // between radii that are looked at
constexpr double largest_growth = 1e3;  // of a radius that never rests

// d log R / dt of a straight tube.
double drift(const theory::UniformTube& tube) {
    return theory::radius_rate(tube) / tube.radius;
}

}  // namespace

std::optional<UniformEnd> UniformEnd::of(const Problem& c) {
    const auto* tube = std::get_if<Tube>(&c.shape);
    if (!tube || !c.runs_in_tier_axisym() || c.unknowns == Unknowns::equilibrium) return std::nullopt;
    const MotionLaw& law = c.law;
    if (!law.unconstrained() || !law.without_loads() || c.energy.alpha) return std::nullopt;
    for (const double H : {-3.0, -1.0, -0.3, 0.7})
        if (density<double>(c.energy, H, 0).HK != 0) return std::nullopt;
    Bending energy = c.energy;
    energy.kg = 0;  // with it waves decay faster
    return UniformEnd(energy, tube->length, std::max(common_waves(*tube), 1), c.accuracy.r_min);
}

// Whether a/R decays for every wave of amplitude a: its rate -G(q) is highest next to one place, of those that fit.
bool UniformEnd::waves_decay(double R) const {
    const theory::UniformTube tube{energy_, R};
    const theory::Stiffness G = theory::stiffness(tube, 0);
    const auto f = density<double>(energy_, -1 / R, 0);
    if (!(G.q4 > margin * std::abs(f.HH))) return false;  // else ill-posed, or nearly so
    const double longest = 2 * std::numbers::pi * waves_ / length_;
    const double highest = std::sqrt(std::max(-G.q2 / (2 * G.q4), 0.0)) / longest;
    for (const double n : {1.0, std::floor(highest), std::ceil(highest)}) {
        const double q = std::max(n, 1.0) * longest, y = q * q, Z = y - 1 / (R * R);
        double size = std::abs(drift(tube));  // of the largest term of G, theory.md (5.6), too
        for (const double term : {f.HH * Z * Z, (f.f + f.H / R) * Z, 2 * f.H * y / R, f.KK * y * y / (R * R)})
            size = std::max(size, std::abs(term));
        if (!(-G(q) - drift(tube) < -margin * size)) return false;
    }
    return true;
}

// Where a straight tube of radius R goes, to within a step of radius_ratio.
double UniformEnd::radius_at_rest(double R) const {
    const auto drift_at = [&](double radius) { return drift({energy_, radius}); };
    const double first = drift_at(R), step = first > 0 ? radius_ratio : 1 / radius_ratio;
    if (first == 0) return R;
    double at = R;
    while (at < largest_growth * R && at > floor_ && drift_at(at) * first > 0) at *= step;
    return at;
}

bool UniformEnd::decided(const TubeState& s) const {
    if (!(s.r_max - s.r_min <= small_wave * (s.r_max + s.r_min))) return false;
    const double R = std::sqrt(s.volume / (std::numbers::pi * length_)), area = 2 * std::numbers::pi * R * length_;
    if (!(std::abs(s.energy - area * density<double>(energy_, -1 / R, 0).f) <=
          small_excess * area * magnitude(energy_, -1 / R, 0)))
        return false;
    const double rest = radius_at_rest(R), low = std::min(R, rest), high = std::max(R, rest);
    if (low <= floor_) return false;  // it ends as a neck would
    for (double at = low; at < high * radius_ratio; at *= radius_ratio)
        if (!waves_decay(std::min(at, high))) return false;
    return true;
}

}  // namespace tubule
