#include "axisym/start.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

namespace tubule::axisym {
namespace {

// A plane z about which every mode is even.
std::optional<double> mirror_plane(const std::vector<TubeMode>& modes, double length) {
    const TubeMode& first = modes.front();
    for (int k = 0; k < 2 * first.n; ++k) {
        const double z = (k * std::numbers::pi - first.phase) * length / (2 * std::numbers::pi * first.n);
        const bool even = std::all_of(modes.begin(), modes.end(), [&](const TubeMode& mode) {
            return std::abs(std::sin(2 * std::numbers::pi * mode.n * z / length + mode.phase)) < 1e-12 * (1 + mode.n);
        });
        if (even) return z;
    }
    return std::nullopt;
}

}  // namespace

Cell cell_of(const Tube& tube, bool symmetry) {
    if (!symmetry) return {0, tube.length, false, 1};
    std::vector<TubeMode> modes;
    int waves = 0;
    for (const TubeMode& mode : tube.modes)
        if (mode.n > 0 && mode.amplitude != 0) {
            modes.push_back(mode);
            waves = std::gcd(waves, mode.n);
        }
    if (modes.empty()) return {0, tube.length / 2, true, 1};
    std::sort(modes.begin(), modes.end(), [](const auto& a, const auto& b) { return a.n < b.n; });
    const double period = tube.length / waves;
    if (const auto z = mirror_plane(modes, tube.length)) return {*z, *z + period / 2, true, waves};
    return {0, period, false, waves};
}

std::vector<double> uniform_breaks(const Cell& cell, int n) {
    std::vector<double> breaks(n + 1);
    for (int i = 0; i <= n; ++i) breaks[i] = cell.z0 + cell.length() * i / n;
    breaks.back() = cell.z1;
    return breaks;
}

std::vector<double> adapted_breaks(const ProfileSpace& space, const std::vector<double>& defect, double target,
                                   int fewest) {
    // The defect of an element of size h is c h^(2p-1). Equal shares mean h ~ c^(-1/(2p-1)).
    constexpr int parts = 4;
    constexpr double growth = 0.35;  // of the element size per distance
    const int exponent = 2 * space.degree() - 1, n = space.elements();
    std::vector<double> edges, density;  // elements per length, up to a factor
    for (int e = 0; e < n; ++e) {
        const double z = space.breaks()[e], h = space.breaks()[e + 1] - z;
        for (int i = 0; i < parts; ++i) {
            edges.push_back(z + h * i / parts);
            density.push_back(std::pow(defect[e] + 1e-300, 1.0 / exponent) / h);
        }
    }
    edges.push_back(space.breaks().back());
    const int m = static_cast<int>(density.size());
    const auto width = [&](int i) { return edges[i + 1] - edges[i]; };
    const auto integral = [&] {
        double sum = 0;
        for (int i = 0; i < m; ++i) sum += density[i] * width(i);
        return sum;
    };
    // n equal shares of (INT density / n)^(2p-1) each. A density raised to even out the sizes needs more elements,
    // but costs no accuracy: count from the raw one.
    const double needed = std::pow(std::pow(integral(), exponent) / target, 1.0 / (exponent - 1));
    const double scale = std::max(needed, 1.0) / integral();
    for (double& d : density) d = std::max(d * scale, fewest / space.cell().length());
    const auto limit = [&](int i, int from) {  // size(i) <= size(from) + growth * distance
        const double distance = (width(i) + width(from)) / 2;
        density[i] = std::max(density[i], 1 / (1 / density[from] + growth * distance));
    };
    for (int sweep = 0; sweep < (space.cell().mirror ? 1 : 2); ++sweep) {
        for (int i = 0; i < m; ++i)
            if (i > 0 || !space.cell().mirror) limit(i, i > 0 ? i - 1 : m - 1);
        for (int i = m - 1; i >= 0; --i)
            if (i + 1 < m || !space.cell().mirror) limit(i, i + 1 < m ? i + 1 : 0);
    }
    const int elements = std::max(fewest, static_cast<int>(std::ceil(integral())));
    std::vector<double> breaks{space.cell().z0};
    double sum = 0, share = integral() / elements;
    for (int i = 0; i < m; ++i) {
        const double here = density[i] * width(i);
        while (static_cast<int>(breaks.size()) < elements && sum + here >= share * breaks.size())
            breaks.push_back(edges[i] + width(i) * (share * breaks.size() - sum) / here);
        sum += here;
    }
    breaks.push_back(space.cell().z1);
    return breaks;
}

}  // namespace tubule::axisym
