#include "axisym/splines/breaks.hpp"

#include <algorithm>
#include <cmath>

namespace tubule::axisym {

std::vector<double> equal_breaks(int n, const Cell& cell) {
    std::vector<double> breaks(n + 1);
    for (int i = 0; i <= n; ++i) breaks[i] = cell.z0 + cell.length() * i / n;
    breaks.back() = cell.z1;
    return breaks;
}

std::vector<double> equal_shares(const std::vector<double>& places, const std::vector<double>& count, int n) {
    std::vector<double> breaks{places.front()};
    for (int i = 1, j = 0; i < n; ++i) {
        const double wanted = count.back() * i / n;
        while (count[j + 1] < wanted) ++j;
        breaks.push_back(places[j] + (places[j + 1] - places[j]) * (wanted - count[j]) / (count[j + 1] - count[j]));
    }
    breaks.push_back(places.back());
    return breaks;
}

std::vector<double> regraded(const std::vector<double>& breaks, int elements) {
    const int n = static_cast<int>(breaks.size()) - 1;
    std::vector<double> out(elements + 1);
    for (int i = 0; i <= elements; ++i) {
        const double at = static_cast<double>(i) * n / elements;
        const int e = std::min(static_cast<int>(at), n - 1);
        out[i] = breaks[e] + (at - e) * (breaks[e + 1] - breaks[e]);
    }
    out.back() = 1;
    return out;
}

std::vector<double> graded_breaks(const std::vector<double>& seams, double largest, double smallest, double growth) {
    std::vector<double> edges{0}, breaks{0};
    edges.insert(edges.end(), seams.begin(), seams.end());
    edges.push_back(1);
    const auto distance = [&](double s) {
        double d = 1;
        for (double seam : seams) d = std::min(d, std::abs(s - seam));
        return d;
    };
    for (std::size_t k = 0; k + 1 < edges.size(); ++k) {
        // Elements needed up to a point, by steps of a tenth of an element, and equal shares of that.
        std::vector<double> at{edges[k]}, count{0};
        const double middle = (edges[k] + edges[k + 1]) / 2;
        while (at.back() < edges[k + 1]) {
            const auto size = [&](double s) { return std::min(largest, smallest + growth * distance(s)); };
            const double here = size(at.back()) / 10;
            // Towards a seam the size shrinks: step by that of the far end.
            const double step = at.back() < middle ? here : std::min(here, size(at.back() + here) / 10);
            const double next = std::min(at.back() + step, edges[k + 1]);
            count.push_back(count.back() + (next - at.back()) / size((next + at.back()) / 2));
            at.push_back(next);
        }
        const int n = std::max(1, static_cast<int>(std::ceil(count.back() - 0.01)));
        const std::vector<double> shares = equal_shares(at, count, n);
        breaks.insert(breaks.end(), shares.begin() + 1, shares.end());
    }
    return breaks;
}

}  // namespace tubule::axisym
