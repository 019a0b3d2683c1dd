#include "tools/scan/theory.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "common/case/read.hpp"

namespace tubule {
namespace {

constexpr std::size_t most_nodes = 41;  // along an axis: a line needs fewer than a map

// Whether its shapes at rest without energy are the surfaces of constant mean curvature H0, and of which period:
// E = INT k20 (H-H0)^2 alone.
std::optional<double> delaunay_period(const Case& c) {
    const auto* tube = std::get_if<Tube>(&c.shape);
    if (!tube || c.model.kind != ModelKind::gradient_flow || c.model.keeps_volume.value_or(false)) return std::nullopt;
    bool only_k20 = true;
    for_each_bending_term([&](std::size_t i, const auto& term) {
        only_k20 = only_k20 && (std::string_view(term.key) == "k20" ? c.energy.k[i] > 0 : c.energy.k[i] == 0);
    });
    int waves = 0;
    for (const TubeMode& mode : tube->modes)
        if (mode.amplitude != 0) waves = std::gcd(waves, mode.n);
    if (!only_k20 || waves == 0) return std::nullopt;
    return tube->length / waves;
}

// Delaunay's unduloids of mean curvature H0 have periods between that of touching spheres of radius 2/|H0| and the
// wave that is neutral on the tube of radius 1/|H0|.
std::optional<double> longest_unduloid(const Case& c) {
    const auto period = delaunay_period(c);
    return period ? std::optional(*period * std::abs(c.energy.H0) - 2 * std::numbers::pi) : std::nullopt;
}
std::optional<double> shortest_unduloid(const Case& c) {
    const auto period = delaunay_period(c);
    return period ? std::optional(*period * std::abs(c.energy.H0) - 4) : std::nullopt;
}

std::vector<std::size_t> some_of(std::size_t size) {
    std::vector<std::size_t> places;
    const std::size_t n = std::min(size, most_nodes);
    for (std::size_t i = 0; i < n; ++i) places.push_back(n > 1 ? i * (size - 1) / (n - 1) : 0);
    return places;
}

}  // namespace

const std::vector<Threshold>& thresholds() {
    static const std::vector<Threshold> all{
        {"longest_unduloid", "longest unduloid, L|H\u2080| = 2\u03c0", longest_unduloid},
        {"shortest_unduloid", "shortest unduloid, L|H\u2080| = 4", shortest_unduloid}};
    return all;
}

std::vector<ThresholdMap> threshold_maps(const Scan& scan) {
    if (scan.axes.size() != 2 || scan.axes[0].keys.size() != 1 || scan.axes[1].keys.size() != 1) return {};
    std::vector<ThresholdMap> maps;
    for (const Threshold& threshold : thresholds())
        maps.push_back(
            {threshold.name, threshold.label, some_of(scan.axes[0].size()), some_of(scan.axes[1].size()), {}});
    for (const std::size_t i : maps.front().first)
        for (const std::size_t j : maps.front().second) {
            std::optional<Case> c;
            try {
                c = scan.case_of(i * scan.axes[1].size() + j);
            } catch (const CaseError&) {  // no case, no line
            }
            for (std::size_t k = 0; k < maps.size(); ++k)
                maps[k].values.push_back(
                    (c ? thresholds()[k].value(*c) : std::nullopt).value_or(std::numeric_limits<double>::quiet_NaN()));
        }
    std::erase_if(maps, [](const ThresholdMap& map) {
        const auto crosses = [&](auto sign) { return std::any_of(map.values.begin(), map.values.end(), sign); };
        return !crosses([](double v) { return v > 0; }) || !crosses([](double v) { return v < 0; });
    });
    return maps;
}

}  // namespace tubule
