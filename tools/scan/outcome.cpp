#include "tools/scan/outcome.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace tubule {
namespace {

constexpr std::array<std::string_view, n_outcomes> names{
    "not-run",           "uniform-tube", "unduloid",  "sphere",  "closed", "pinched",     "overhang", "ill-posed",
    "self-intersection", "failed",       "undecided", "prolate", "oblate", "stomatocyte", "pear"};

bool is_sphere(double area, double volume) {
    return 6 * std::sqrt(std::numbers::pi) * volume / std::pow(area, 1.5) > 1 - volume_off_sphere;
}

Outcome at_rest(const EndShape& end) {
    if (end.periodic)
        return end.r_max - end.r_min < waves_of_uniform_tube * (end.r_max + end.r_min) ? Outcome::uniform_tube
                                                                                       : Outcome::unduloid;
    return is_sphere(end.area, end.volume) ? Outcome::sphere : Outcome::closed;
}

// Points at equal distances along a polygon, its ends included.
std::vector<std::array<double, 2>> equally_spaced(std::span<const double> r, std::span<const double> z) {
    std::vector<double> s(r.size(), 0);
    for (std::size_t i = 1; i < s.size(); ++i) s[i] = s[i - 1] + std::hypot(r[i] - r[i - 1], z[i] - z[i - 1]);
    constexpr std::size_t intervals = 200;
    std::vector<std::array<double, 2>> points;
    for (std::size_t k = 0, i = 1; k <= intervals; ++k) {
        const double at = s.back() * static_cast<double>(k) / intervals;
        while (i + 1 < s.size() && s[i] < at) ++i;
        const double part = (at - s[i - 1]) / (s[i] - s[i - 1]);
        points.push_back({r[i - 1] + part * (r[i] - r[i - 1]), z[i - 1] + part * (z[i] - z[i - 1])});
    }
    return points;
}

}  // namespace

std::string_view name(Outcome outcome) {
    return names[static_cast<std::size_t>(outcome)];
}

std::optional<Outcome> outcome_from_name(std::string_view name) {
    for (std::size_t i = 0; i < names.size(); ++i)
        if (names[i] == name) return static_cast<Outcome>(i);
    return std::nullopt;
}

std::vector<std::string> outcome_names() {
    return {names.begin(), names.end()};
}

Outcome outcome_of(Stop reason, const EndShape& end) {
    switch (reason) {
        case Stop::stationary:
            return at_rest(end);
        case Stop::pinch_off:
            return Outcome::pinched;
        case Stop::overhang:
            return Outcome::overhang;
        case Stop::ill_posed:
        case Stop::undefined:
            return Outcome::ill_posed;
        case Stop::self_intersection:
            return Outcome::self_intersection;
        default:  // no outcome of its own: the numerics failed, or the run could have gone on
            return exit_code(reason) == exit_code(Stop::solver_failed) ? Outcome::failed : Outcome::undecided;
    }
}

Outcome cell_at_rest(std::span<const double> r, std::span<const double> z, double area, double volume) {
    if (is_sphere(area, volume)) return Outcome::sphere;
    const double width = *std::max_element(r.begin(), r.end()), middle = (z.front() + z.back()) / 2;
    const auto [low, high] = std::minmax_element(z.begin(), z.end());
    const auto points = equally_spaced(r, z);
    double asymmetry = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto& image = points[points.size() - 1 - i];
        asymmetry =
            std::max({asymmetry, std::abs(points[i][0] - image[0]), std::abs(points[i][1] + image[1] - 2 * middle)});
    }
    if (asymmetry < asymmetry_of_mirrored * width) return *high - *low > 2 * width ? Outcome::prolate : Outcome::oblate;
    const double dent = std::max(std::min(z.front(), z.back()) - *low, *high - std::max(z.front(), z.back()));
    return dent > smallest_dent * width ? Outcome::stomatocyte : Outcome::pear;
}

}  // namespace tubule
