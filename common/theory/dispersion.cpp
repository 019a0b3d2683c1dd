#include "common/theory/dispersion.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "common/solve/pause.hpp"

namespace tubule::theory {

namespace {

using Complex = std::complex<double>;
constexpr double infinity = std::numeric_limits<double>::infinity();

CurvatureJet<double> on(const UniformTube& tube) {
    return density(tube.energy, -1 / tube.radius, 0.0);
}
CurvatureJet<double> on(const UniformSphere& sphere) {
    const double R = sphere.radius;
    return density(with_M(sphere.energy, -8 * pi * R), -2 / R, 1 / (R * R));
}

// f + F1/R + sigma0: what multiplies Z.
double pull(const UniformTube& tube) {
    const auto f = on(tube);
    return f.f + f.H / tube.radius + tube.tension;
}

// F2 - 2 f_HK/R + f_KK/R^2, the principal symbol of waves along the axis.
double symbol_along(const UniformTube& tube) {
    const auto f = on(tube);
    return f.HH - 2 * f.HK / tube.radius + f.KK / (tube.radius * tube.radius);
}

// The sum of the sizes of what stiffness() adds up.
double size_of_stiffness(const UniformTube& tube, double q, int m) {
    const double R = tube.radius, Y = q * q + (m * m + 1) / (R * R);
    const auto f = on(tube);
    return Y * (Y * (2 * tube.energy.kg * Y + std::abs(f.HH) + 2 * std::abs(f.HK) / R + std::abs(f.KK) / (R * R)) +
                std::abs(f.f) + 2 * std::abs(f.H) / R + std::abs(tube.tension));
}

// A wave whose stiffness is rounding is neutral.
double driving_stiffness(const UniformTube& tube, double q, int m) {
    constexpr double rounding = 1e-13;
    const double G = stiffness(tube, m)(q);
    return std::abs(G) < rounding * size_of_stiffness(tube, q, m) ? 0 : G;
}

double squared_wave_number(const UniformTube& tube, double q, int m) {
    return q * q + m * m / (tube.radius * tube.radius);
}

bool faster(const Complex& a, const Complex& b) {
    return a.real() != b.real() ? a.real() > b.real() : a.imag() > b.imag();
}

// Real a s^2 + b s + c = 0, a > 0, without cancellation.
std::vector<Complex> quadratic_roots(double a, double b, double c) {
    const double discriminant = b * b - 4 * a * c;
    if (discriminant < 0) {
        const Complex s(-b / (2 * a), std::sqrt(-discriminant) / (2 * a));
        return {s, std::conj(s)};
    }
    const double far = -(b + std::copysign(std::sqrt(discriminant), b)) / 2;
    std::vector<Complex> roots{far / a, far != 0 ? c / far : 0.0};
    std::sort(roots.begin(), roots.end(), faster);
    return roots;
}

// Real s^3 + c2 s^2 + c1 s + c0 = 0: eigenvalues of the companion matrix, improved by Newton's method.
std::vector<Complex> cubic_roots(double c2, double c1, double c0) {
    Eigen::Matrix3d companion;
    companion << 0, 0, -c0, 1, 0, -c1, 0, 1, -c2;
    const Eigen::EigenSolver<Eigen::Matrix3d> eigen(companion, false);
    std::vector<Complex> roots;
    for (Complex s : eigen.eigenvalues()) {
        for (int i = 0; i < 2; ++i) {
            const Complex slope = (3.0 * s + 2 * c2) * s + c1, value = ((s + c2) * s + c1) * s + c0;
            if (std::abs(value) < 0.1 * std::abs(slope) * std::abs(s)) s -= value / slope;
        }
        roots.push_back(s);
    }
    std::sort(roots.begin(), roots.end(), faster);
    return roots;
}

// Zeros y > 0 of c3 y^3 + c2 y^2 + c1 y + c0, ascending.
std::vector<double> positive_roots(double c3, double c2, double c1, double c0) {
    std::vector<Complex> roots;
    if (c3 != 0) {
        roots = cubic_roots(c2 / c3, c1 / c3, c0 / c3);
    } else if (c2 != 0) {
        const double sign = std::copysign(1.0, c2);
        roots = quadratic_roots(sign * c2, sign * c1, sign * c0);
    } else if (c1 != 0) {
        roots = {-c0 / c1};
    }
    std::vector<double> out;
    for (const Complex& y : roots)
        if (y.imag() == 0 && y.real() > 0) out.push_back(y.real());
    std::sort(out.begin(), out.end());
    return out;
}

// The denominator of theory.md (5.10): what resists without inertia, over Q R^2.
double drag_of(const MotionLaw& law, double R, double q, int m) {
    const double mu = law.viscosity, Q = q * q + m * m / (R * R), twist = law.friction + mu * Q, around = m / R;
    const double drag = law.friction * (Q * R * R + 1) + 4 * mu * q * q;
    return m == 0 || q == 0 ? drag : drag - 4 * mu * mu * q * q * around * around / twist;
}

}  // namespace

Bending on_tube(const Bending& energy, double length) {
    return with_M(energy, -2 * pi * length);
}

double radius_rate(const UniformTube& tube) {
    const auto f = on(tube);
    return -(f.f + f.H / tube.radius) / tube.radius;
}

double radius_rate(const UniformSphere& sphere) {
    const auto f = on(sphere);
    const double R = sphere.radius;
    return -2 / R * (f.f + f.H / R - f.K / (R * R));
}

double pressure_at_rest(const UniformTube& tube) {
    return tube.tension / tube.radius - radius_rate(tube);
}

double pressure_at_rest(const UniformSphere& sphere) {
    return 2 * sphere.tension / sphere.radius - radius_rate(sphere);
}

double axial_force(const UniformTube& tube, double pressure) {
    const double R = tube.radius;
    return 2 * pi * R * (on(tube).f + tube.tension) - pi * R * R * pressure;
}

std::optional<double> tension_of(const MotionLaw& law, const Bending& energy, double radius) {
    const Loads loads = loads_at(law, 0);
    if (law.area_is_free()) return loads.tension;
    if (!law.keeps_volume) return tension_of_free_volume(energy, radius, loads.pressure);
    if (!law.free_period) return std::nullopt;
    const auto f = on(UniformTube{energy, radius});
    return (loads.force / pi + f.H) / radius - f.f;  // theory.md (3.22)
}

double radius_rate_of(const MotionLaw& law, const UniformTube& tube) {
    if (law.keeps_volume || !law.area_is_free()) return 0;
    const double drive = loads_at(law, 0).pressure - pressure_at_rest(tube);
    return drive / (law.friction + 2 * law.viscosity / (tube.radius * tube.radius));
}

std::optional<double> radius_at_rest(const MotionLaw& law, const UniformTube& tube) {
    constexpr double ratio = 1.02, farthest = 1e3;
    const auto rate = [&](double R) {
        UniformTube at = tube;
        at.radius = R;
        return radius_rate_of(law, at);
    };
    const double first = rate(tube.radius);
    if (first == 0) return tube.radius;
    double before = tube.radius, after = before;
    do {
        before = after, after *= first > 0 ? ratio : 1 / ratio;
        if (after > farthest * tube.radius || farthest * after < tube.radius) return std::nullopt;
    } while (rate(after) * first > 0);
    for (int i = 0; i < 60; ++i) {
        const double middle = (before + after) / 2;
        (rate(middle) * first > 0 ? before : after) = middle;
    }
    return (before + after) / 2;
}

double tension_of_free_volume(const Bending& energy, double radius, double pressure) {
    return radius * (radius_rate(UniformTube{energy, radius, 0}) + pressure);
}

double reduced_tension(const UniformTube& tube) {
    return pull(tube) * tube.radius * tube.radius / on(tube).HH;
}

Stiffness stiffness(const UniformTube& tube, int m) {
    const double R = tube.radius, z0 = (m * m - 1) / (R * R);  // Z = q^2 + z0
    const auto f = on(tube);
    // 2 kg Q Z^2 of the gradient term, Q = q^2 + around
    const double kg = 2 * tube.energy.kg, around = m * m / (R * R);
    return {kg, symbol_along(tube) + kg * (2 * z0 + around),
            2 * f.HH * z0 + pull(tube) - 2 * f.H / R - 2 * f.HK * z0 / R + kg * z0 * (z0 + 2 * around),
            f.HH * z0 * z0 + pull(tube) * z0 + kg * around * z0 * z0};
}

double stiffness(const UniformSphere& sphere, int l) {
    const double R = sphere.radius, L = l * (l + 1.0) - 2;
    const auto f = on(sphere);
    const double as_a_whole = l == 0 ? 16 * pi * sphere.energy.alpha.value_or(0) / (R * R) : 0;  // theory.md (2.21)
    const double gradients = 2 * sphere.energy.kg * l * (l + 1.0) / (R * R);                     // theory.md (6.11)
    return L / (R * R) *
               (L / (R * R) * (f.HH - 2 * f.HK / R + f.KK / (R * R) + gradients) + f.f - f.K / (R * R) +
                sphere.tension) +
           as_a_whole;
}

double mobility(const UniformTube& tube, const MotionLaw& law, double q, int m) {
    const double R = tube.radius, QR2 = squared_wave_number(tube, q, m) * R * R;
    if (!law.inextensible) return 1;
    if (law.inertia != 0) return QR2 / (QR2 + 1);
    return q == 0 && m == 0 ? 0 : QR2 / drag_of(law, R, q, m);
}

Growth growth(const UniformTube& tube, const MotionLaw& law, double q, int m) {
    m = std::abs(m);
    const double R = tube.radius, Q = squared_wave_number(tube, q, m), G = driving_stiffness(tube, q, m);
    if (!law.inextensible) return {{0.0 - G}};
    // The radius (m = 0) or the position (m = 1), which are conserved.
    const bool rigid = q == 0 && m < 2;
    if (law.inertia == 0) return {{rigid || G == 0 ? 0.0 : -mobility(tube, law, q, m) * G}};
    // theory.md (5.12), times a + mu Q: with A = Q R^2 + 1, B = 4 mu q^2, C = 4 mu^2 q^2 (m/R)^2, D = mu Q and a =
    // omega + gamma, omega [(a A + B)(a + D) - C] + Q R^2 G (a + D) = 0. Without C the factor a + D belongs to a swirl
    // without a wave.
    const double mu = law.viscosity, gamma = law.friction, A = Q * R * R + 1, B = 4 * mu * q * q, D = mu * Q,
                 C = 4 * mu * mu * q * q * m * m / (R * R), F = rigid ? 0.0 : Q * R * R * G;
    if (C == 0) return {quadratic_roots(A, gamma * A + B, F)};
    return {cubic_roots((2 * A * gamma + A * D + B) / A, ((A * gamma + A * D + B) * gamma + B * D - C + F) / A,
                        F * (gamma + D) / A)};
}

Growth growth(const UniformSphere& sphere, const MotionLaw& law, int l) {
    const double R = sphere.radius, Lam = l * (l + 1.0), L = Lam - 2, G = stiffness(sphere, l);
    if (!law.inextensible) return {{-G}};
    if (l < 2) return {{0.0}};  // size and position, which are conserved
    const double drag = law.friction * (Lam + 4) + 4 * law.viscosity * L / (R * R);
    if (law.inertia == 0) return {{-Lam * G / drag}};
    return {quadratic_roots(Lam + 4, drag, Lam * G)};
}

double toroidal_rate(const UniformSphere& sphere, const MotionLaw& law, int l) {
    return -law.friction - law.viscosity * (l * (l + 1.0) - 2) / (sphere.radius * sphere.radius);
}

bool ill_posed_along(const UniformTube& tube) {
    return tube.energy.kg == 0 && !(symbol_along(tube) > 0);
}
bool ill_posed_around(const UniformTube& tube) {
    return tube.energy.kg == 0 && !(on(tube).HH > 0);
}

std::vector<Band> growing_bands(const UniformTube& tube, int m) {
    const Stiffness G = stiffness(tube, m);
    // The zeros of G in y = q^2 > 0 at which it changes sign.
    std::vector<double> changes = positive_roots(G.q6, G.q4, G.q2, G.q0);
    changes.insert(changes.begin(), 0.0);
    std::vector<Band> bands;
    for (std::size_t i = 0; i < changes.size(); ++i) {
        const bool last = i + 1 == changes.size();
        const double middle = last ? 2 * changes[i] + 1 : (changes[i] + changes[i + 1]) / 2;
        if (G(std::sqrt(middle)) < 0)
            bands.push_back({std::sqrt(changes[i]), last ? infinity : std::sqrt(changes[i + 1])});
    }
    return bands;
}

std::optional<FastestWave> fastest_wave(const UniformTube& tube, const MotionLaw& law, int m) {
    std::optional<FastestWave> best;
    const auto rate = [&](double q) { return growth(tube, law, q, m).rate(); };
    for (const Band& band : growing_bands(tube, m)) {
        if (!std::isfinite(band.to) || !std::isfinite(rate(band.from))) return std::nullopt;
        // Rates have one or two maxima within a band: samples find the highest, golden sections refine it.
        constexpr int samples = 64;
        const double step = (band.to - band.from) / samples;
        int top = 0;
        for (int i = 1; i <= samples; ++i)
            if (rate(band.from + i * step) > rate(band.from + top * step)) top = i;
        double low = band.from + std::max(top - 1, 0) * step, high = band.from + std::min(top + 1, samples) * step;
        const double golden = (std::sqrt(5.0) - 1) / 2;
        while (high - low > 1e-9 * band.to) {  // rounding hides a maximum within less
            const double a = high - golden * (high - low), b = low + golden * (high - low);
            if (rate(a) >= rate(b))
                high = b;
            else
                low = a;
        }
        const double q = top == 0 && rate(band.from) >= rate((low + high) / 2) ? band.from : (low + high) / 2;
        // The search has run into q = 0, where rates have no bound.
        if (q > 0 && q < 1e-6 * band.to && !(rate(q) < 10 * rate(1e-3 * step))) return std::nullopt;
        if (!best || rate(q) > best->rate) best = {q, rate(q)};
    }
    return best;
}

std::optional<FittingWave> fastest_fitting_wave(const UniformTube& tube, const MotionLaw& law, double length,
                                                int last) {
    std::optional<FittingWave> best;
    for (int m = 0; m <= last; ++m)
        for (const Band& band : growing_bands(tube, m)) {
            if (!std::isfinite(band.to)) return std::nullopt;
            for (int n = static_cast<int>(std::ceil(band.from * length / (2 * pi))); 2 * pi * n / length < band.to;
                 ++n) {
                check_pause();
                if (n == 0 && m < 2) continue;
                const double q = 2 * pi * n / length, rate = growth(tube, law, q, m).rate();
                if (!std::isfinite(rate)) return std::nullopt;
                if (rate > 0 && (!best || rate > best->rate)) best = {n, m, q, rate};
            }
        }
    return best;
}

// With y = q^2 and T = f + F1/R + sigma0 the stiffness is P(y) + T (y + z0), z0 = (m^2 - 1)/R^2. It is negative nowhere
// if T >= -P/(y + z0) for all y > -z0 and T <= -P/(y + z0) for all y < -z0: the extremes of that ratio bound T, and
// where P vanishes at -z0 so does its limit there.
std::optional<StableTensions> stable_tensions(const UniformTube& tube, int m) {
    constexpr double rounding = 2e-15;
    if (ill_posed_along(tube)) return std::nullopt;
    const double T = pull(tube), z0 = (m * m - 1) / (tube.radius * tube.radius);
    Stiffness P = stiffness(tube, m);
    P.q2 -= T, P.q0 -= T * z0;
    const auto slope = [&](double y) { return (3 * P.q6 * y + 2 * P.q4) * y + P.q2; };
    const auto value = [&](double y) { return ((P.q6 * y + P.q4) * y + P.q2) * y + P.q0; };
    StableTensions out;
    const auto bound = [&](double y, double ratio, bool below, bool above) {
        if (below && ratio > out.lowest) out.lowest = ratio, out.q_lowest = std::sqrt(y);
        if (above && ratio < out.highest) out.highest = ratio, out.q_highest = std::sqrt(y);
    };
    std::vector<double> places = positive_roots(2 * P.q6, P.q4 + 3 * P.q6 * z0, 2 * P.q4 * z0, P.q2 * z0 - P.q0);
    places.push_back(0);
    for (const double y : places)
        if (std::abs(y + z0) > 1e-12 * std::abs(z0)) bound(y, -value(y) / (y + z0), y + z0 > 0, y + z0 < 0);
    if (m < 2) {
        const double size = ((std::abs(P.q6 * z0) + std::abs(P.q4)) * std::abs(z0) + std::abs(P.q2)) * std::abs(z0);
        if (value(-z0) < -rounding * size) return std::nullopt;
        if (value(-z0) <= rounding * size) bound(-z0, -slope(-z0), true, m == 0);
    }
    // Both are one number where a wave is neutral at every other tension.
    const double apart = out.lowest - out.highest;
    if (apart > 1e-12 * (std::abs(out.lowest) + std::abs(out.highest) + std::abs(P.q2))) return std::nullopt;
    out.lowest += tube.tension - T, out.highest += tube.tension - T;
    return out;
}

std::optional<StableTensions> common_stable_tensions(const UniformTube& tube, int last) {
    StableTensions all;
    for (int m = 0; m <= last; ++m) {
        const auto one = stable_tensions(tube, m);
        if (!one) return std::nullopt;
        if (one->lowest > all.lowest) all.lowest = one->lowest, all.q_lowest = one->q_lowest;
        if (one->highest < all.highest) all.highest = one->highest, all.q_highest = one->q_highest;
    }
    if (all.lowest > all.highest) return std::nullopt;
    return all;
}

// f_KK adds y^2/R^2 to G for each unit, y = q^2.
std::optional<double> least_f_KK(const UniformTube& tube) {
    const Stiffness G = stiffness(tube, 0);
    if (G.q0 < 0 || (G.q0 == 0 && G.q2 < 0)) return std::nullopt;
    const double R = tube.radius;
    double missing = -G.q4;  // of the shortest waves; with q6 > 0 they need nothing
    if (G.q6 > 0) missing = -infinity;
    for (const double y : positive_roots(G.q6, 0, -G.q2, -2 * G.q0))
        missing = std::max(missing, -(G.q6 * y + G.q4 + (G.q2 + G.q0 / y) / y));
    return on(tube).KK + missing * R * R;
}

}  // namespace tubule::theory
