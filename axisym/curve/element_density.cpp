#include "axisym/curve/element_density.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "axisym/splines/breaks.hpp"

namespace tubule::axisym {
namespace {

constexpr int parts = 256;
constexpr double equal = 0.5;        // share of elements that does not follow the wish
constexpr double growth = 0.4;       // of sizes per distance, as at seams
constexpr double most_change = 0.3;  // from part to part

// 1/density, in proportion to sizes, grows by no more than `growth` per distance.
void limit_growth(ElementDensity& density, int elements) {
    const int n = static_cast<int>(density.size());
    const double rise = growth * elements / n;
    const auto limit = [&](int i, int from) {
        density[i] = std::max(density[i], density[from] / (1 + std::min(rise * density[from], most_change)));
    };
    for (int i = 1; i < n; ++i) limit(i, i - 1);
    for (int i = n - 2; i >= 0; --i) limit(i, i + 1);
}

}  // namespace

void MeshNeed::add(const SplineSpace& space, const std::vector<double>& mesh_loss) {
    lost = std::max(lost, std::accumulate(mesh_loss.begin(), mesh_loss.end(), 0.0));
    wanted.resize(parts, 0);
    const std::vector<double>& breaks = space.breaks();
    const double begin = breaks.front(), width = (breaks.back() - begin) / parts;
    for (int i = 0, e = 0; i < parts; ++i) {
        while (e + 1 < space.elements() && breaks[e + 1] <= begin + (i + 0.5) * width) ++e;
        const double size = breaks[e + 1] - breaks[e];
        wanted[i] = std::max(wanted[i], std::pow(mesh_loss[e] / size, 0.5 / (space.degree() - 1)) / size);
    }
}

ElementDensity MeshNeed::density() const {
    const double mean = std::accumulate(wanted.begin(), wanted.end(), 0.0) / parts;
    if (!(mean > 0) || !std::isfinite(mean)) return {};
    ElementDensity out = wanted;
    for (double& value : out) value = equal + (1 - equal) * value / mean;
    return out;
}

std::vector<double> breaks_of(ElementDensity density, int elements) {
    limit_growth(density, elements);
    std::vector<double> count{0};
    for (const double value : density) count.push_back(count.back() + value);
    return equal_shares(equal_breaks(static_cast<int>(density.size())), count, elements);
}

}  // namespace tubule::axisym
