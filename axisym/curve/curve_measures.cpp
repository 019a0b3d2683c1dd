#include "axisym/curve/curve_measures.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

// Smallest f on [low, high], one minimum being inside: golden section.
template <class F>
double minimum(F&& f, double low, double high) {
    constexpr double ratio = 0.6180339887498949;
    double a = high - ratio * (high - low), b = low + ratio * (high - low), fa = f(a), fb = f(b);
    for (int k = 0; k < 45; ++k)
        if (fa < fb)
            high = b, b = a, fb = fa, a = high - ratio * (high - low), fa = f(a);
        else
            low = a, a = b, fa = fb, b = low + ratio * (high - low), fb = f(b);
    return std::min(fa, fb);
}

}  // namespace

ShapeMeasures measures(const CurveSpace& space, const Eigen::VectorXd& x) {
    const auto at = [&](double s) { return space.evaluate(x, s); };
    const CurveSample south = at(0), north = at(1), middle = at(space.images() == 2 ? 1 : 0.5);
    ShapeMeasures m;
    m.height = space.closed() || space.is_patch() ? space.images() * (north.z - south.z) : space.length(x.data());
    m.r_middle = middle.r;
    if (space.closed()) m.pole_curvature = -south.z2 / (south.r1 * south.r1);
    if (space.topology() == Topology::cap) m.pole_curvature = north.z2 / (north.r1 * north.r1);
    const int n = 4 * space.splines().elements();
    int widest = 0;
    for (int i = 0; i <= n; ++i) {
        const double s = static_cast<double>(i) / n;
        if (at(s).r > at(static_cast<double>(widest) / n).r) widest = i;
        if (space.topology() == Topology::cell) {
            const CurveSample a = at(s), b = at(1 - s);
            m.asymmetry = std::max({m.asymmetry, std::abs(a.r - b.r), std::abs(a.z + b.z - 2 * middle.z)});
        }
    }
    m.r_max = -minimum([&](double s) { return -at(s).r; }, std::max(0.0, (widest - 1.0) / n),
                       std::min(1.0, (widest + 1.0) / n));
    return m;
}

std::optional<std::array<double, 2>> self_intersection(const CurveSpace& space, const Eigen::VectorXd& x) {
    const auto& breaks = space.splines().breaks();
    constexpr int chords = 8;
    std::vector<double> s;
    for (std::size_t e = 0; e + 1 < breaks.size(); ++e)
        for (int i = 0; i < chords; ++i) s.push_back(breaks[e] + (breaks[e + 1] - breaks[e]) * i / chords);
    s.push_back(1);
    const int n = static_cast<int>(s.size());
    std::vector<Eigen::Vector2d> p;
    for (double t : s) {
        const CurveSample at = space.evaluate(x, t);
        p.emplace_back(at.r, at.z);
    }
    const int first = space.begins_at_pole() ? 1 : 0, last = space.ends_at_pole() ? n - 2 : n - 1;
    for (int i = first; i <= last; ++i)
        if (!(p[i][0] > 0)) return std::array{s[i], s[i]};
    // A half that crosses a plane of symmetry away from its ends meets its mirror image there.
    const bool half_cell = space.topology() == Topology::half_cell,
               half_tube = space.topology() == Topology::half_tube && space.rise() > 0;
    for (int i = half_tube ? 1 : 0; i + 1 < n && (half_cell || half_tube); ++i)
        if (half_cell ? p[i][1] > 0 : p[i][1] < 0 || p[i][1] > space.rise(x.data())) return std::array{s[i], s[i]};
    const auto side = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    };
    const bool torus = space.topology() == Topology::tube && space.rise() == 0;  // the last chord ends on the first
    for (int i = 0; i + 1 < n; ++i) {
        const double bottom = std::min(p[i][1], p[i + 1][1]), top = std::max(p[i][1], p[i + 1][1]);
        for (int j = i + 2; j + 1 < n; ++j) {
            if (torus && i == 0 && j + 2 == n) continue;
            if (std::max(p[j][1], p[j + 1][1]) < bottom || std::min(p[j][1], p[j + 1][1]) > top) continue;
            if (side(p[i], p[i + 1], p[j]) * side(p[i], p[i + 1], p[j + 1]) < 0 &&
                side(p[j], p[j + 1], p[i]) * side(p[j], p[j + 1], p[i + 1]) < 0)
                return std::array{s[i], s[j]};
        }
    }
    return std::nullopt;
}

namespace {

// A sampled profile; halves are completed by their mirror image, which does not change the distance.
struct Sampled {
    ArcLength arc;
    std::vector<Eigen::Vector2d> points;
    int images;
    explicit Sampled(const Curve& m) : arc(m), images(m.images()) {
        constexpr int samples = 400;
        for (int i = 0; i <= samples; ++i) points.push_back(at(static_cast<double>(i) / samples));
    }
    int last() const { return static_cast<int>(points.size()) - 1; }
    Eigen::Vector2d at(double fraction) const {
        double sign = 1;
        if (images == 2) {
            fraction *= 2;
            if (fraction > 1) fraction = 2 - fraction, sign = -1;
        }
        const auto p = arc.point(fraction);
        return {p[0], sign * p[1]};
    }
    // Distance of a point from the curve.
    double distance(const Eigen::Vector2d& p) const {
        int nearest = 0;
        for (int i = 1; i <= last(); ++i)
            if ((points[i] - p).squaredNorm() < (points[nearest] - p).squaredNorm()) nearest = i;
        const double low = std::max(nearest - 1, 0), high = std::min(nearest + 1, last());
        return minimum([&](double t) { return (at(t) - p).norm(); }, low / last(), high / last());
    }
    // The largest distance of a point of this curve from the other.
    double farthest_from(const Sampled& other) const {
        int best = 0;
        double largest = 0;
        for (int i = 0; i <= last(); ++i) {
            double coarse = std::numeric_limits<double>::infinity();
            for (const auto& q : other.points) coarse = std::min(coarse, (points[i] - q).squaredNorm());
            if (coarse > largest) largest = coarse, best = i;
        }
        const double low = std::max(best - 2, 0), high = std::min(best + 2, last());
        return -minimum([&](double t) { return -other.distance(at(t)); }, low / last(), high / last());
    }
};

}  // namespace

double hausdorff_distance(const Curve& a, const Curve& b) {
    const Sampled A(a), B(b);
    return std::max(A.farthest_from(B), B.farthest_from(A));
}

}  // namespace tubule::axisym
