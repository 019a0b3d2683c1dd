#include "common/shapes/profile_curve.hpp"

#include <Eigen/LU>
#include <cmath>
#include <stdexcept>

namespace tubule {

namespace {

using Pair = std::array<double, 2>;  // two values of x
constexpr int terms = BlendedCurve::terms;

// The polynomials through the values at x; periodic: the last point is the first one, of x greater by 1.
BlendedCurve blended(const std::vector<double>& x, const std::vector<Pair>& values, bool periodic) {
    const int n = static_cast<int>(x.size());
    BlendedCurve out{x, {}, {}};
    for (int i = 0; i < n; ++i) {
        int first = i - terms / 2;
        if (!periodic) first = std::clamp(first, 0, n - terms);
        std::array<double, terms> away;
        std::array<Pair, terms> value;
        double scale = 0;
        for (int k = 0; k < terms; ++k) {
            const int index = first + k, turn = index < 0 ? -1 : index > n - 1 ? 1 : 0;
            const int point = index - turn * (n - 1);
            away[k] = x[point] + turn - x[i];
            value[k] = values[point];
            scale = std::max(scale, std::abs(away[k]));
        }
        Eigen::Matrix<double, terms, terms> powers;
        Eigen::Matrix<double, terms, 2> right;
        for (int k = 0; k < terms; ++k) {
            for (int j = 0; j < terms; ++j) powers(k, j) = std::pow(away[k] / scale, j);
            right.row(k) << value[k][0], value[k][1];
        }
        const Eigen::Matrix<double, terms, 2> coefficients = powers.partialPivLu().solve(right);
        out.scale.push_back(scale);
        auto& polynomial = out.polynomial.emplace_back();
        for (int f = 0; f < 2; ++f)
            for (int j = 0; j < terms; ++j) polynomial[f][j] = coefficients(j, f);
    }
    return out;
}

// At `at`, the polynomial through seven values.
double extrapolated(const double* x, const double* values, double at) {
    double sum = 0;
    for (int i = 0; i < terms; ++i) {
        double weight = values[i];
        for (int j = 0; j < terms; ++j)
            if (j != i) weight *= (at - x[j]) / (x[i] - x[j]);
        sum += weight;
    }
    return sum;
}

// Two functions from their values at these fractions s of the arc length, as ProfileCurve has them: of a cell the first
// one over sin(pi s), as functions of c.
BlendedCurve functions_of(ProfileCurve::Kind kind, const std::vector<double>& first, const std::vector<double>& second,
                          const std::vector<double>& s) {
    const std::size_t n = s.size();
    std::vector<Pair> values(n);
    if (kind != ProfileCurve::Kind::cell) {
        for (std::size_t i = 0; i < n; ++i) values[i] = {first[i], second[i]};
        return blended(s, values, true);
    }
    std::vector<double> c(n), scale(n);
    for (std::size_t i = 0; i < n; ++i) c[i] = -std::cos(pi * s[i]), scale[i] = first[i] / std::sin(pi * s[i]);
    c.front() = -1, c.back() = 1;
    scale.front() = extrapolated(&c[1], &scale[1], -1);  // it is 0/0 at the poles
    scale.back() = extrapolated(&c[n - 1 - terms], &scale[n - 1 - terms], 1);
    for (std::size_t i = 0; i < n; ++i) values[i] = {scale[i], second[i]};
    return blended(c, values, false);
}

// The functions of the curve itself: of a tube z without its rise.
BlendedCurve functions_of(const ProfileCurve& curve, const std::vector<double>& r, const std::vector<double>& z,
                          const std::vector<double>& s) {
    std::vector<double> level = z;
    for (std::size_t i = 0; i < s.size(); ++i) level[i] -= curve.length * s[i];
    return functions_of(curve.kind, r, level, s);
}

struct Moments {
    double length = 0, radius = 0, volume = 0;  // INT ds, INT r ds, INT pi r^2 dz
};
Moments moments(const ProfileCurve& curve, double from, double to) {
    using S = Jet<double, 1, 1>;
    constexpr std::array<double, 2> node{0.33998104358485626, 0.86113631159405258};  // Gauss, four points
    constexpr std::array<double, 2> weight{0.65214515486254614, 0.34785484513745386};
    Moments out;
    for (int i = 0; i < 4; ++i) {
        const double x = (i < 2 ? -1 : 1) * node[i % 2], w = weight[i % 2] * (to - from) / 2;
        const auto [r, z] = profile_at(curve, S::variable((from + to) / 2 + x * (to - from) / 2, 0));
        const double length = w * std::hypot(r.d[0], z.d[0]);
        out.length += length;
        out.radius += length * r.v;
        out.volume += w * pi * r.v * r.v * z.d[0];
    }
    return out;
}

void require(bool condition, const char* message) {
    if (!condition) throw std::invalid_argument(message);
}

ProfileCurve::Kind kind_of(const std::vector<double>& r, const std::vector<double>& z, double length) {
    using enum ProfileCurve::Kind;
    require(r.size() == z.size() && r.size() >= terms + 2, "a profile needs r and z of at least 9 points");
    const std::size_t last = r.size() - 1;
    double size = length;
    for (double value : r) size = std::max(size, std::abs(value));
    for (std::size_t i = 1; i < last; ++i) require(r[i] > 0, "r of a profile must be positive between its ends");
    const auto close = [&](double a, double b) { return std::abs(a - b) < 1e-9 * size; };
    if (length == 0 && close(r[0], 0) && close(r[last], 0)) return cell;
    require(r[0] > 0 && close(r[last], r[0]) && close(z[last], z[0] + length),
            "a profile must run from pole to pole, over one period, or once around");
    return length > 0 ? tube : ring;
}

}  // namespace

ProfileCurve profile_curve(const std::vector<double>& r, const std::vector<double>& z, double length) {
    ProfileCurve curve;
    curve.kind = kind_of(r, z, length);
    curve.length = length;
    const std::size_t n = r.size();
    std::vector<double> s(n, 0.0);  // by chords first
    for (std::size_t i = 1; i < n; ++i) {
        const double chord = std::hypot(r[i] - r[i - 1], z[i] - z[i - 1]);
        require(chord > 0, "two neighbouring points of a profile coincide");
        s[i] = s[i - 1] + chord;
    }
    Moments total;
    for (int round = 0;; ++round) {
        for (double& value : s) value /= s.back();
        curve.functions = functions_of(curve, r, z, s);
        if (round == 3) break;  // each gains two orders in the distance of the points; the fit has seven
        total = {};
        std::vector<double> next(n, 0.0);
        for (std::size_t i = 1; i < n; ++i) {
            const Moments piece = moments(curve, s[i - 1], s[i]);
            next[i] = next[i - 1] + piece.length;
            total.length += piece.length, total.radius += piece.radius, total.volume += piece.volume;
        }
        s = next;
    }
    require(total.volume > 0, "a profile must be oriented with the outside to its right");
    curve.arc_length = total.length;
    curve.mean_radius = total.radius / total.length;
    return curve;
}

BlendedCurve along_curve(const ProfileCurve& curve, const std::vector<double>& first,
                         const std::vector<double>& second) {
    std::vector<double> s = curve.functions.x;
    require(first.size() == s.size() && second.size() == s.size(),
            "values on a profile: one is needed for each of its points");
    if (curve.kind == ProfileCurve::Kind::cell)
        for (double& c : s) c = std::acos(-std::clamp(c, -1.0, 1.0)) / pi;
    return functions_of(curve.kind, first, second, s);
}

}  // namespace tubule
