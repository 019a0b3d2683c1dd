#include "common/theory/growth_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace tubule::theory {

namespace {

constexpr int fewest = 6, most_points = 200;
constexpr double rounding = 1e-9;  // relative error bars below this count as equal

struct Point {
    double t, log_a;
};

struct Line {
    double slope = 0, standard_error = 0;
};

// Least squares through points[from, to).
Line line_through(const std::vector<Point>& points, int from, int to) {
    const int n = to - from;
    double t = 0, y = 0;
    for (int i = from; i < to; ++i) t += points[i].t / n, y += points[i].log_a / n;
    double tt = 0, ty = 0, yy = 0;
    for (int i = from; i < to; ++i) {
        const double dt = points[i].t - t, dy = points[i].log_a - y;
        tt += dt * dt, ty += dt * dy, yy += dy * dy;
    }
    Line line{ty / tt, 0};
    if (n > 2) {
        double squares = 0;
        for (int i = from; i < to; ++i) {
            const double rest = points[i].log_a - y - line.slope * (points[i].t - t);
            squares += rest * rest;
        }
        line.standard_error = std::sqrt(squares / (n - 2) / tt);
    }
    return line;
}

GrowthFit fitted(const std::vector<Point>& points, int from, int to) {
    const Line whole = line_through(points, from, to);
    // Slopes of the three thirds, which share a point with their neighbours. Two halves could agree by symmetry.
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (int third = 0; third < 3; ++third) {
        const int last = to - from - 1;
        const Line part = line_through(points, from + third * last / 3, from + (third + 1) * last / 3 + 1);
        least = std::min(least, part.slope), most = std::max(most, part.slope);
    }
    return {whole.slope, whole.standard_error + 2 * (most - least), points[from].t, points[to - 1].t, to - from};
}

std::vector<Point> usable(const std::vector<double>& times, const std::vector<double>& amplitudes, double noise) {
    std::vector<Point> points;
    for (std::size_t i = 0; i < times.size(); ++i) {
        if (!(amplitudes[i] > noise) || !(amplitudes[i] > 0)) continue;
        if (points.empty() || times[i] > points.back().t) points.push_back({times[i], std::log(amplitudes[i])});
    }
    const int n = static_cast<int>(points.size());
    if (n < fewest)
        throw std::invalid_argument(
            fmt::format("a growth rate needs amplitudes at {} or more times, not {}; each time in time.output adds one",
                        fewest, n));
    if (n <= most_points) return points;
    std::vector<Point> some;
    for (int i = 0; i < most_points; ++i) some.push_back(points[static_cast<long>(i) * (n - 1) / (most_points - 1)]);
    return some;
}

}  // namespace

GrowthFit fit_growth(const std::vector<double>& times, const std::vector<double>& amplitudes, double noise) {
    const std::vector<Point> points = usable(times, amplitudes, noise);
    const int n = static_cast<int>(points.size());
    const auto [low, high] = std::minmax_element(points.begin(), points.end(),
                                                 [](const Point& a, const Point& b) { return a.log_a < b.log_a; });
    const double least_change = std::min(1.0, (high->log_a - low->log_a) / 3);
    struct Stretch {
        GrowthFit fit;
        double change;
    };
    std::vector<Stretch> stretches;
    double smallest = std::numeric_limits<double>::infinity();
    for (int from = 0; from + fewest <= n; ++from)
        for (int to = from + fewest; to <= n; ++to) {
            // Along the line: two points of a floor of noise may differ as much.
            const GrowthFit fit = fitted(points, from, to);
            const double change = std::abs(fit.rate) * (fit.to - fit.from);
            if (change < least_change) continue;
            stretches.push_back({fit, change});
            smallest = std::min(smallest, stretches.back().fit.error);
        }
    if (stretches.empty()) return fitted(points, 0, n);  // log a oscillates: no stretch changes that much
    const Stretch* best = nullptr;
    for (const Stretch& stretch : stretches)
        if (stretch.fit.error <= std::max(2 * smallest, rounding * std::abs(stretch.fit.rate)) &&
            (!best || stretch.change > best->change))
            best = &stretch;
    return best->fit;
}

}  // namespace tubule::theory
