#include "common/theory/vesiculation.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <numbers>

namespace tubule::theory {
namespace {

using std::numbers::pi;

constexpr int most_others = 200;
// r/R up to which n equal spheres fit into one: exact packings.
const double fits_inside[]{1, 0.5, 2 * std::sqrt(3.0) - 3, std::sqrt(6.0) - 2, std::sqrt(2.0) - 1, std::sqrt(2.0) - 1};

double sphere_energy(const Bending& bending, double radius, double sign) {
    return 4 * pi * radius * radius * density(bending, -sign * 2 / radius, 1 / (radius * radius)).f;
}

// The energy of a neck that has shrunk to a point: a catenoid, H = 0 and INT |K| dS = 4 pi. Nothing if it grows without
// bound.
std::optional<double> neck_energy(const Bending& bending, double area) {
    const auto per_curvature = [&](double K) { return density(bending, 0.0, -K).f / K; };
    const double wide = per_curvature(1e12 / area), narrow = per_curvature(1e14 / area);
    const double none = 1e-9 * std::abs(density(bending, 0.0, 0.0).f) * area;
    if (!std::isfinite(narrow) || std::abs(narrow) > 2 * std::abs(wide) + none) return std::nullopt;
    return 4 * pi * narrow;
}

// x = r^2 between two bounds such that R^2 + n x = 1 and R^3 +- n r^3 = v.
double other_square(int n, double sign, double v, double low, double high) {
    const auto volume = [&](double x) { return std::pow(std::fmax(0, 1 - n * x), 1.5) + sign * n * std::pow(x, 1.5); };
    const bool rises = volume(high) > volume(low);
    for (int k = 0; k < 100; ++k) {
        const double middle = (low + high) / 2;
        ((volume(middle) < v) == rises ? low : high) = middle;
    }
    return (low + high) / 2;
}

}  // namespace

std::optional<LimitShape> vesiculated_limit(const Bending& bending, double area, double volume) {
    const double size = std::sqrt(area / (4 * pi)), v = 3 * volume / (4 * pi * size * size * size);
    if (bending.H0_varies() || !(v > 0 && v < 1)) return std::nullopt;
    const std::optional<double> neck = neck_energy(bending, area);
    if (!neck) return std::nullopt;
    std::optional<LimitShape> best;
    const auto consider = [&](int n, bool inside, double low, double high) {
        const double sign = inside ? -1 : 1, square = other_square(n, sign, v, low, high);
        LimitShape shape{n, inside, size * std::sqrt(std::fmax(0, 1 - n * square)), size * std::sqrt(square)};
        if (!(shape.radius > 0 && shape.other_radius > 0)) return;
        if (inside && shape.other_radius > fits_inside[n - 1] * shape.radius) return;
        const double M = -8 * pi * (shape.radius + sign * n * shape.other_radius);
        shape.energy = sphere_energy(bending, shape.radius, 1) +
                       n * (sphere_energy(bending, shape.other_radius, sign) + *neck) +
                       area_difference_energy(bending, M);
        if (std::isfinite(shape.energy) && (!best || shape.energy < best->energy)) best = shape;
    };
    for (int n = 1; n <= most_others; ++n) {
        const double equal = 1.0 / (n + 1);
        if (v * v < equal) continue;  // n + 1 spheres of this area enclose more
        consider(n, false, 0, equal);
        if (n > 1 && v * v * n < 1) consider(n, false, equal, 1.0 / n);
    }
    for (int n = 1; n <= static_cast<int>(std::size(fits_inside)); ++n) consider(n, true, 0, 1.0 / (n + 1));
    return best;
}

std::string described(const LimitShape& s) {
    if (s.inside)
        return fmt::format("a sphere of radius {:.4g} with {} of radius {:.4g} inside", s.radius, s.others,
                           s.other_radius);
    if (std::abs(s.radius - s.other_radius) < 1e-6 * s.radius)
        return fmt::format("{} spheres of radius {:.4g}", s.others + 1, s.radius);
    if (s.others == 1) return fmt::format("spheres of the radii {:.4g} and {:.4g}", s.radius, s.other_radius);
    return fmt::format("a sphere of radius {:.4g} and {} of radius {:.4g}", s.radius, s.others, s.other_radius);
}

}  // namespace tubule::theory
