#include "axisym/splines/arc_length.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tubule::axisym {

Curve scaled(const Curve& meridian, double factor) {
    Curve m = meridian;
    m.length *= factor;
    m.at = [at = meridian.at, factor](double t) {
        auto p = at(t);
        for (double& value : p) value *= factor;
        return p;
    };
    return m;
}

Curve meridian(const CurveSpace& space, const Eigen::VectorXd& x) {
    Curve m{space.topology(), space.length(x.data()), [space, x](double t) {
                const CurveSample p = space.evaluate(x, t);
                return std::array{p.r, p.r1, p.z, p.z1};
            }};
    const std::vector<double>& breaks = space.splines().breaks();
    if (space.splines().smoothness() < 3) m.seams.assign(breaks.begin() + 1, breaks.end() - 1);
    return m;
}

Curve half(const Curve& whole) {
    const bool cell = whole.topology == Topology::cell;
    if (!cell && whole.topology != Topology::tube) throw std::invalid_argument("the curve is already one half");
    const double shift = whole.at(cell ? 0.5 : 0)[2];
    Curve out = whole;
    out.topology = cell ? Topology::half_cell : Topology::half_tube;
    out.seams.clear();
    for (double t : whole.seams)
        if (t < 0.5) out.seams.push_back(2 * t);
    out.at = [at = whole.at, shift](double t) {
        const auto [r, r1, z, z1] = at(t / 2);
        return std::array{r, r1 / 2, z - shift, z1 / 2};
    };
    for (int i = 1; i < 16; ++i) {
        const auto a = whole.at(i / 32.0), b = whole.at(1 - i / 32.0);
        const double plane = cell ? shift : shift + whole.length / 2;
        const double size = std::abs(a[0]) + std::abs(a[2] - plane);
        if (std::abs(a[0] - b[0]) + std::abs(a[2] + b[2] - 2 * plane) > 1e-6 * size)
            throw std::invalid_argument("the curve is not symmetric about the middle of its parameter range");
    }
    return out;
}

namespace {

const GaussRule& panel_rule() {
    static const GaussRule rule = gauss_rule(8);
    return rule;
}

}  // namespace

ArcLength::ArcLength(Curve meridian) : meridian_(std::move(meridian)) {
    constexpr int panels = 200;  // 8 points on each: lengths to rounding for anything resolved by 100 elements
    std::vector<double> edges{0};
    edges.insert(edges.end(), meridian_.seams.begin(), meridian_.seams.end());
    edges.push_back(1);
    t_ = sum_ = {0};
    for (std::size_t k = 0; k + 1 < edges.size(); ++k) {
        const double width = edges[k + 1] - edges[k];
        const int n = std::max(1, static_cast<int>(std::ceil(panels * width)));
        for (int i = 1; i <= n; ++i) {
            t_.push_back(i < n ? edges[k] + width * i / n : edges[k + 1]);
            sum_.push_back(sum_.back() + integral(t_[t_.size() - 2], t_.back()));
        }
    }
}

double ArcLength::speed(double t) const {
    const auto p = meridian_.at(t);
    return std::hypot(p[1], p[3]);
}

double ArcLength::integral(double from, double to) const {
    const GaussRule& rule = panel_rule();
    double sum = 0;
    for (std::size_t i = 0; i < rule.nodes.size(); ++i)
        sum += rule.weights[i] * speed(from + (to - from) * rule.nodes[i]);
    return (to - from) * sum;
}

double ArcLength::fraction(double t) const {
    const auto above = std::upper_bound(t_.begin() + 1, t_.end() - 1, t);
    const std::size_t i = above - t_.begin() - 1;
    return (sum_[i] + integral(t_[i], t)) / total();
}

double ArcLength::parameter(double fraction) const {
    const double wanted = fraction * total();
    const auto above = std::upper_bound(sum_.begin() + 1, sum_.end() - 1, wanted);
    const std::size_t i = above - sum_.begin() - 1;
    double t = t_[i] + (t_[i + 1] - t_[i]) * (wanted - sum_[i]) / (sum_[i + 1] - sum_[i]);
    for (int k = 0; k < 20; ++k) {
        const double step = (wanted - sum_[i] - integral(t_[i], t)) / speed(t);
        t = std::clamp(t + step, t_[i], t_[i + 1]);
        if (std::abs(step) < 1e-15) break;
    }
    return t;
}

std::array<double, 2> ArcLength::point(double fraction) const {
    const auto p = meridian_.at(parameter(fraction));
    return {p[0], p[2]};
}

std::vector<double> ArcLength::seams() const {
    std::vector<double> out;
    for (double t : meridian_.seams) out.push_back(fraction(t));
    return out;
}

Eigen::VectorXd fit(const CurveSpace& space, const ArcLength& curve) {
    if (curve.meridian().topology != space.topology() || curve.meridian().length != space.length())
        throw std::invalid_argument("the curve does not have the topology or the period of its space");
    return space.project([&](double s) { return curve.point(s); });
}

Eigen::VectorXd fit(const CurveSpace& space, const Curve& meridian) {
    return fit(space, ArcLength(meridian));
}

}  // namespace tubule::axisym
