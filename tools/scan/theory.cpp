#include "tools/scan/theory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/case/read.hpp"
#include "common/theory/dispersion.hpp"
#include "tools/scan/starts.hpp"

namespace tubule {
namespace {

constexpr std::size_t most_nodes = 41;   // along an axis where lines are looked for: fewer than a map has
constexpr std::size_t fine_enough = 65;  // where they are drawn

// E = INT k20 (H-H0)^2, and area differences.
bool only_k20(const Bending& energy) {
    bool only = true;
    for_each_bending_term([&](std::size_t i, const auto& term) {
        only = only && (std::string_view(term.key) == "k20" ? energy.k[i] > 0 : energy.k[i] == 0);
    });
    return only && energy.terms.empty() && energy.kg == 0;
}

// Whether its equilibria without energy are the surfaces of constant mean curvature H0, and of which period:
// E = INT k20 (H-H0)^2 alone. Area differences cost energy on all of them but those with M = M0.
std::optional<double> delaunay_period(const Problem& c) {
    const auto* tube = std::get_if<Tube>(&c.shape);
    const MotionLaw& law = c.law;
    if (!tube || !law.unconstrained() || !law.without_loads()) return std::nullopt;
    const int waves = common_waves(*tube);
    if (!only_k20(c.energy) || c.energy.alpha || waves == 0) return std::nullopt;
    return tube->length / waves;
}

// Delaunay's unduloids of mean curvature H0 have periods between that of touching spheres of radius 2/|H0| and the
// wave that is neutral on the tube of radius 1/|H0|.
std::optional<double> longest_unduloid(const Problem& c) {
    const auto period = delaunay_period(c);
    return period ? std::optional(*period * std::abs(c.energy.H0) - 2 * std::numbers::pi) : std::nullopt;
}
std::optional<double> shortest_unduloid(const Problem& c) {
    const auto period = delaunay_period(c);
    return period ? std::optional(*period * std::abs(c.energy.H0) - 4) : std::nullopt;
}

// The straight tube in equilibrium. Gradient flow with free volume and no forces: radius 1/|H0|, if no term but k20
// affects it. With constant forces and a radius that nothing keeps: where the initial radius goes.
// Otherwise the straight tube of the start; nothing if a fixed area and volume make the tension an unknown.
std::optional<theory::UniformTube> tube_at_rest(const Problem& c) {
    const auto* tube = std::get_if<Tube>(&c.shape);
    if (!tube || c.equilibrium) return std::nullopt;
    const MotionLaw& law = c.law;
    if (law.loads_change() || law.pressure_of_volume) return std::nullopt;
    const Bending energy = theory::on_tube(c.energy, tube->length);
    const auto tension = theory::tension_of(law, energy, tube->radius);
    if (!tension) return std::nullopt;
    theory::UniformTube start{energy, tube->radius, *tension};
    if (law.keeps_volume || !law.area_is_free()) return start;
    if (law.reservoir || !law.without_loads()) {
        const auto radius = theory::radius_at_rest(law, start);
        if (!radius) return std::nullopt;
        start.radius = *radius;
        return start;
    }
    const theory::UniformTube rest{energy, 1 / std::abs(c.energy.H0), 0};
    const double k20 = c.energy.k[term_number("k20")], rounding = 1e-12 * std::abs(k20 * std::pow(c.energy.H0, 3));
    if (c.energy.H0 == 0 || k20 == 0 || std::abs(theory::radius_rate(rest)) > rounding) return std::nullopt;
    return rest;
}

// What drives the waves of one m, of those that fit: -G of theory.md (5.8) of the one that is driven most. The models
// differ in what they make of it, but not in its sign. For m = 0 those that repeat the cells of the start, as tier 1
// does.
std::optional<double> driven_most(const Problem& c, int m) {
    const auto tube = tube_at_rest(c);
    if (!tube) return std::nullopt;
    const auto& shape = std::get<Tube>(c.shape);
    const theory::Stiffness G = theory::stiffness(*tube, m);
    if (!G.rises()) return std::nullopt;  // ill-posed: there is no such wave
    const double longest = 2 * std::numbers::pi * (m == 0 ? std::max(common_waves(shape), 1) : 1) / shape.length;
    // Where dG/d(q^2) = 3 q6 q^4 + 2 q4 q^2 + q2 vanishes last.
    const double root = std::sqrt(std::max(G.q4 * G.q4 - 3 * G.q6 * G.q2, 0.0));
    const double square = G.q4 + root > 0 ? -G.q2 / (G.q4 + root) : (root - G.q4) / (3 * G.q6);
    const double lowest = std::sqrt(std::max(square, 0.0)) / longest;
    const double first = m < 2 ? 1 : 0;  // n = 0: another radius, or the whole tube moves
    double most = -G(first * longest);
    for (const double n : {std::floor(lowest), std::ceil(lowest)})
        if (n >= first) most = std::max(most, -G(n * longest));
    return std::abs(most) > 1e-12 * std::abs(G.q0) ? most : 0;  // without k42 they are neutral at q R = 1, not beyond
}
template <int m>
std::optional<double> waves_around(const Problem& c) {
    return driven_most(c, m);
}

// For a closed cell with given area and volume and, but for area differences, the energy k20 alone: radius of the
// sphere of its area, and its reduced volume.
struct Vesicle {
    double radius, reduced_volume;
};
std::optional<Vesicle> vesicle(const Problem& c) {
    if (!c.equilibrium || !std::holds_alternative<Sphere>(c.shape) || c.held != Held::area_and_volume)
        return std::nullopt;
    const EquilibriumChoices& e = *c.equilibrium;
    if (!e.area || !(e.volume || e.reduced_volume) || !only_k20(c.energy)) return std::nullopt;
    const double radius = std::sqrt(*e.area / (4 * std::numbers::pi));
    return Vesicle{radius, e.volume ? *e.volume / (4 * std::numbers::pi / 3 * std::pow(radius, 3)) : *e.reduced_volume};
}

// Vesicles end as two spheres that touch in a neck without size, where -H0 is the sum of their mean curvatures,
// 1/R1 + 1/R2 (1/R1 - 1/R2 for one inside the other): theory.md 8. Area differences act as an H0, theory.md (2.20).
// `inside` -1: beside each other.
std::optional<double> spheres_with_neck(const Problem& c, double inside) {
    const auto v = vesicle(c);
    if (!v) return std::nullopt;
    // R1 = R cos a, R2 = R sin a; the reduced volume decreases from 1.
    const auto volume = [&](double a) { return std::pow(std::cos(a), 3) - inside * std::pow(std::sin(a), 3); };
    double low = 0, high = std::numbers::pi / 4;
    if (v->reduced_volume < volume(high)) return std::nullopt;
    for (int k = 0; k < 60; ++k) (volume((low + high) / 2) > v->reduced_volume ? low : high) = (low + high) / 2;
    const double neck = (inside / std::sin(low) - 1 / std::cos(low)) / v->radius;  // H0 of it
    const double M = 8 * std::numbers::pi * v->radius * (inside * std::sin(low) - std::cos(low));
    const double H0 = c.energy.H0 - area_difference_force(c.energy, M) / (2 * c.energy.k[term_number("k20")]);
    return inside * (H0 - neck);
}
std::optional<double> two_spheres(const Problem& c) {
    return spheres_with_neck(c, -1);
}
std::optional<double> sphere_in_sphere(const Problem& c) {
    return spheres_with_neck(c, 1);
}

struct Threshold {
    const char *name, *label;
    std::optional<double> (*value)(const Problem& c);  // empty where it does not apply to the case
};
constexpr Threshold thresholds[]{{"longest_unduloid", "longest unduloid, L|H\u2080| = 2\u03c0", longest_unduloid},
                                 {"shortest_unduloid", "shortest unduloid, L|H\u2080| = 4", shortest_unduloid},
                                 {"pearling", "straight tube, m = 0 neutral", waves_around<0>},
                                 {"buckling", "straight tube, m = 1 neutral", waves_around<1>},
                                 {"ovalisation", "straight tube, m = 2 neutral", waves_around<2>},
                                 {"two_spheres", "two spheres with a neck", two_spheres},
                                 {"sphere_in_sphere", "sphere in a sphere", sphere_in_sphere}};

// Every value of a short axis, some of a long one.
Axis some_of(const Axis& axis) {
    Axis some = axis;
    const std::size_t n = std::min(axis.size(), most_nodes);
    some.values.resize(n);
    for (std::size_t i = 0; n > 1 && i < n; ++i) some.values[i] = axis.values[i * (axis.size() - 1) / (n - 1)];
    return some;
}

// With a value between every two neighbours, unless it is fine enough.
Axis halved(const Axis& axis) {
    if (axis.size() >= fine_enough) return axis;
    Axis fine = axis;
    fine.values.clear();
    for (std::size_t i = 0; i < axis.size(); ++i) {
        if (i > 0) fine.values.push_back({fmt::format("{}", axis.value(i - 1, 0.5))});
        fine.values.push_back(axis.values[i]);
    }
    return fine;
}

// A grid of two axes of numbers, and thresholds on it.
struct Grid {
    Scan scan;
    std::array<std::size_t, 2> axes;
    std::vector<const Threshold*> kinds;
    std::vector<std::vector<double>> values{};  // of each threshold, row by row

    std::size_t size(std::size_t side) const { return scan.axes[axes[side]].size(); }

    // The values of all thresholds at a node; NaN where one does not apply or there is no case.
    std::vector<double> exact(const Nodes& nodes, std::size_t node) const {
        std::vector<double> found(kinds.size(), std::numeric_limits<double>::quiet_NaN());
        try {
            const Problem c = scan.case_of(nodes.point_of(node, 0));
            for (std::size_t k = 0; k < kinds.size(); ++k) found[k] = kinds[k]->value(c).value_or(found[k]);
        } catch (const CaseError&) {  // no case, no line
        }
        return found;
    }
};

int sign(double value) {
    return std::isnan(value) ? 2 : (value > 0) - (value < 0);
}

// Values on a grid with halved axes: exact in and beside cells through which a line passes, elsewhere means.
Grid refined(const Grid& coarse) {
    Grid fine = coarse;
    std::array<std::size_t, 2> n{}, m{}, step{};
    for (const std::size_t side : {0, 1}) {
        Axis& axis = fine.scan.axes[fine.axes[side]];
        axis = halved(axis);
        n[side] = coarse.size(side), m[side] = axis.size(), step[side] = m[side] > n[side] ? 2 : 1;
    }
    for (auto& values : fine.values) values.assign(m[0] * m[1], 0);
    const Nodes nodes(fine.scan);
    for (std::size_t node = 0; node < m[0] * m[1]; ++node) {
        std::array<std::size_t, 2> low{}, high{}, from{}, to{};  // coarse nodes around, and beside these
        for (const std::size_t side : {0, 1}) {
            const std::size_t at = side == 0 ? node / m[1] : node % m[1];
            low[side] = at / step[side], high[side] = (at + step[side] - 1) / step[side];
            from[side] = low[side] - std::min<std::size_t>(low[side], 1);
            to[side] = std::min(high[side] + 1, n[side] - 1);
        }
        const bool known = low == high;
        bool crossed = false;
        for (const auto& values : coarse.values)
            for (std::size_t i = from[0]; i <= to[0]; ++i)
                for (std::size_t j = from[1]; j <= to[1]; ++j)
                    crossed |= sign(values[i * n[1] + j]) != sign(values[from[0] * n[1] + from[1]]);
        const auto exact = crossed && !known ? fine.exact(nodes, node) : std::vector<double>();
        for (std::size_t k = 0; k < fine.values.size(); ++k) {
            const auto value = [&](std::size_t i, std::size_t j) { return coarse.values[k][i * n[1] + j]; };
            fine.values[k][node] = !exact.empty() ? exact[k]
                                                  : (value(low[0], low[1]) + value(low[0], high[1]) +
                                                     value(high[0], low[1]) + value(high[0], high[1])) /
                                                        4;
        }
    }
    return fine;
}

// Values of an axis, or places where they are no numbers.
std::vector<double> numbers_of(const Axis& axis) {
    std::vector<double> numbers;
    for (const auto& value : axis.values)
        numbers.push_back(number_of(value[0]).value_or(static_cast<double>(numbers.size())));
    return numbers;
}

// Whether there is a case between its first two values, both numbers.
bool divisible(const Scan& scan, std::size_t axis) {
    Scan between = scan;
    for (const auto& value : scan.axes[axis].values)
        if (!number_of(value[0])) return false;
    if (scan.axes[axis].size() < 2) return false;
    between.axes[axis].values = {{fmt::format("{}", scan.axes[axis].value(0, 0.5))}};
    try {
        between.case_of(0);
        return true;
    } catch (const CaseError&) {  // as between whole numbers
        return false;
    }
}

}  // namespace

std::vector<ThresholdMap> threshold_maps(const Scan& scan) {
    std::vector<std::size_t> axes;  // that of starts changes no threshold
    {
        const Nodes nodes(scan);
        for (std::size_t a = 0; a < scan.axes.size(); ++a)
            if (!nodes.has_starts() || a != start_axis(scan)) axes.push_back(a);
    }
    if (axes.size() != 2 || scan.axes[axes[0]].keys.size() != 1 || scan.axes[axes[1]].keys.size() != 1) return {};
    Grid grid{scan, {axes[0], axes[1]}, {}};
    for (const std::size_t a : axes) grid.scan.axes[a] = some_of(scan.axes[a]);
    for (const Threshold& threshold : thresholds) grid.kinds.push_back(&threshold);
    grid.values.resize(grid.kinds.size());
    const Nodes nodes(grid.scan);
    for (std::size_t node = 0; node < grid.size(0) * grid.size(1); ++node) {
        const auto found = grid.exact(nodes, node);
        for (std::size_t k = 0; k < found.size(); ++k) grid.values[k].push_back(found[k]);
    }
    for (std::size_t k = grid.kinds.size(); k-- > 0;) {
        const auto has = [&](int wanted) {
            return std::any_of(grid.values[k].begin(), grid.values[k].end(),
                               [&](double v) { return sign(v) == wanted; });
        };
        if (has(1) && has(-1)) continue;
        grid.kinds.erase(grid.kinds.begin() + static_cast<std::ptrdiff_t>(k));
        grid.values.erase(grid.values.begin() + static_cast<std::ptrdiff_t>(k));
    }
    const bool fine = !grid.kinds.empty() && divisible(grid.scan, axes[0]) && divisible(grid.scan, axes[1]);
    while (fine && std::min(grid.size(0), grid.size(1)) < fine_enough) grid = refined(grid);
    std::vector<ThresholdMap> maps;
    for (std::size_t k = 0; k < grid.kinds.size(); ++k)
        maps.push_back({grid.kinds[k]->name, grid.kinds[k]->label, numbers_of(grid.scan.axes[axes[0]]),
                        numbers_of(grid.scan.axes[axes[1]]), grid.values[k]});
    return maps;
}

}  // namespace tubule
