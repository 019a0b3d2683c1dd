#include "common/shapes/perturbed_curve.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <memory>
#include <stdexcept>

namespace tubule {

namespace {

using Pair = std::array<double, 2>;                                    // two values of x
using Polynomial = std::array<double, CurveFunctions::terms>;          // of w
constexpr int nearest = 7;                                             // points that a polynomial goes through
constexpr int fewest_intervals = 400, fewest_intervals_of_a_span = 4;  // of the curve of a spline

void require(bool condition, const char* message) {
    if (!condition) throw std::invalid_argument(message);
}

// (a + b w) p(w), p being of less than the largest degree.
Polynomial times(double a, double b, const Polynomial& p) {
    Polynomial out;
    for (std::size_t k = 0; k < p.size(); ++k) out[k] = a * p[k] + (k > 0 ? b * p[k - 1] : 0);
    return out;
}

Polynomial difference(const Polynomial& p, const Polynomial& q) {
    Polynomial out;
    for (std::size_t k = 0; k < p.size(); ++k) out[k] = p[k] - q[k];
    return out;
}

// Newton's polynomials through the values nearest to a point; periodic: the last point is the first one, of x greater
// by 1.
struct LocalFit {
    std::array<double, nearest> x;
    std::array<std::array<double, nearest>, 2> divided;  // differences

    // On [from, from + h].
    Polynomial on(double from, double h, int f) const {
        Polynomial out{divided[f][nearest - 1]};
        for (int k = nearest - 1; k-- > 0;) out = times(from - x[k], h, out), out[0] += divided[f][k];
        return out;
    }
};
LocalFit local_fit(const std::vector<double>& x, const std::vector<Pair>& values, bool periodic, int i) {
    const int n = static_cast<int>(x.size());
    int first = i - nearest / 2;
    if (!periodic) first = std::clamp(first, 0, n - nearest);
    LocalFit out;
    for (int k = 0; k < nearest; ++k) {
        const int index = first + k, turn = index < 0 ? -1 : index > n - 1 ? 1 : 0;
        const int point = index - turn * (n - 1);
        out.x[k] = x[point] + turn;
        for (int f = 0; f < 2; ++f) out.divided[f][k] = values[point][f];
    }
    for (auto& d : out.divided)
        for (int level = 1; level < nearest; ++level)
            for (int k = nearest - 1; k >= level; --k) d[k] = (d[k] - d[k - 1]) / (out.x[k] - out.x[k - level]);
    return out;
}

CurveFunctions blended(const std::vector<double>& x, const std::vector<Pair>& values, bool periodic) {
    CurveFunctions out{x, {}};
    LocalFit low = local_fit(x, values, periodic, 0);
    for (std::size_t i = 0; i + 1 < x.size(); ++i) {
        const LocalFit high = local_fit(x, values, periodic, static_cast<int>(i) + 1);
        const double h = x[i + 1] - x[i];
        auto& both = out.polynomial.emplace_back();
        for (int f = 0; f < 2; ++f) {
            const Polynomial start = low.on(x[i], h, f), end = high.on(x[i], h, f);
            // They agree in value at the points, and the blend 3 w^2 - 2 w^3 is flat there: second derivatives join.
            const Polynomial turn = times(0, 1, times(0, 1, times(3, -2, difference(end, start))));
            for (std::size_t k = 0; k < turn.size(); ++k) both[f][k] = start[k] + turn[k];
        }
        low = high;
    }
    return out;
}

// At `at`, the polynomial through seven values.
double extrapolated(const double* x, const double* values, double at) {
    double sum = 0;
    for (int i = 0; i < nearest; ++i) {
        double weight = values[i];
        for (int j = 0; j < nearest; ++j)
            if (j != i) weight *= (at - x[j]) / (x[i] - x[j]);
        sum += weight;
    }
    return sum;
}

// Two functions from their values at these s, as PerturbedCurve has them: of a cell the first one over sin(pi s), as
// functions of c.
CurveFunctions functions_of(const PerturbedCurve& curve, const std::vector<double>& first,
                            const std::vector<double>& second, const std::vector<double>& s) {
    const std::size_t n = s.size();
    std::vector<Pair> values(n);
    if (!curve.is_cell()) {
        for (std::size_t i = 0; i < n; ++i) values[i] = {first[i], second[i]};
        return blended(s, values, curve.topology == Topology::tube);
    }
    std::vector<double> c(n), scale(n);
    for (std::size_t i = 0; i < n; ++i) c[i] = -std::cos(pi * s[i]), scale[i] = first[i] / std::sin(pi * s[i]);
    c.front() = -1, c.back() = 1;
    scale.front() = extrapolated(&c[1], &scale[1], -1);  // it is 0/0 at the poles
    scale.back() = extrapolated(&c[n - 1 - nearest], &scale[n - 1 - nearest], 1);
    for (std::size_t i = 0; i < n; ++i) values[i] = {scale[i], second[i]};
    return blended(c, values, false);
}

struct Moments {
    double length = 0, radius = 0, volume = 0;  // INT ds, INT r ds, INT pi r^2 dz
};
Moments moments(const PerturbedCurve& curve, double from, double to) {
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

// Sets the length and the mean radius of the curve, by the pieces between these s; the length until each of them.
std::vector<double> measure(PerturbedCurve& curve, const std::vector<double>& s) {
    Moments total;
    std::vector<double> until{0};
    for (std::size_t i = 1; i < s.size(); ++i) {
        const Moments piece = moments(curve, s[i - 1], s[i]);
        until.push_back(until.back() + piece.length);
        total.radius += piece.radius, total.volume += piece.volume;
    }
    require(total.volume > 0 || is_patch(curve.topology), "a profile must be oriented with the outside to its right");
    curve.arc_length = until.back();
    curve.mean_radius = total.radius / until.back();
    return until;
}

Topology topology_of(const std::vector<double>& r, const std::vector<double>& z, double length) {
    require(r.size() == z.size() && r.size() >= nearest + 2, "a profile needs r and z of at least 9 points");
    const std::size_t last = r.size() - 1;
    double size = length;
    for (double value : r) size = std::max(size, std::abs(value));
    for (std::size_t i = 1; i < last; ++i) require(r[i] > 0, "r of a profile must be positive between its ends");
    const auto close = [&](double a, double b) { return std::abs(a - b) < 1e-9 * size; };
    if (length == 0 && close(r[0], 0) && close(r[last], 0)) return Topology::cell;
    const bool around = r[0] > 0 && close(r[last], r[0]) && close(z[last], z[0] + length);
    if (!around && length == 0 && r[0] > 0 && !(r[last] < 0))
        return close(r[last], 0) ? Topology::cap : Topology::strip;
    require(around, "a profile must run from pole to pole, over one period, once around, or from a ring");
    return Topology::tube;
}

// The spline on [from, to], within the span that begins with this knot: de Boor.
Polynomial spline_on(double from, double to, int degree, int span, const std::vector<double>& knots,
                     const std::vector<double>& coefficients) {
    std::array<Polynomial, 8> d{};
    for (int j = 0; j <= degree; ++j) d[j][0] = coefficients[span - degree + j];
    for (int level = 1; level <= degree; ++level)
        for (int j = degree; j >= level; --j) {
            const double low = knots[span - degree + j], width = knots[span + 1 + j - level] - low;
            const Polynomial turn = times((from - low) / width, (to - from) / width, difference(d[j], d[j - 1]));
            for (std::size_t k = 0; k < turn.size(); ++k) d[j][k] = d[j - 1][k] + turn[k];
        }
    return d[degree];
}

}  // namespace

PerturbedCurve curve_through(const std::vector<double>& r, const std::vector<double>& z, double length) {
    PerturbedCurve curve;
    curve.topology = topology_of(r, z, length);
    curve.length = length;
    const std::size_t n = r.size();
    std::vector<double> s(n, 0.0);  // by chords first
    for (std::size_t i = 1; i < n; ++i) {
        const double chord = std::hypot(r[i] - r[i - 1], z[i] - z[i - 1]);
        require(chord > 0, "two neighbouring points of a profile coincide");
        s[i] = s[i - 1] + chord;
    }
    for (int round = 0;; ++round) {
        for (double& value : s) value /= s.back();
        std::vector<double> level = z;
        for (std::size_t i = 0; i < n; ++i) level[i] -= length * s[i];
        curve.functions = functions_of(curve, r, level, s);
        if (round == 3) return curve;  // each gains two orders in the distance of the points; the fit has seven
        s = measure(curve, s);
    }
}

PerturbedCurve spline_curve(int degree, double length, const std::vector<double>& knots,
                            const std::vector<double>& coefficients) {
    const int n = static_cast<int>(coefficients.size());
    require(degree >= 1 && degree <= 7 && length > 0 && n > degree && knots.size() == coefficients.size() + degree + 1,
            "it is damaged: degree, length, knots and coefficients do not define a spline");
    PerturbedCurve curve;
    curve.topology = Topology::tube;
    curve.length = length;
    for (int span = degree; span < n; ++span) {
        const double from = std::max(knots[span], 0.0), width = std::min(knots[span + 1], length) - from;
        if (!(width > 1e-12 * length)) continue;
        const int parts =
            std::max(fewest_intervals_of_a_span, static_cast<int>(std::ceil(fewest_intervals * width / length)));
        for (int i = 0; i < parts; ++i) {
            const double low = from + width * i / parts, high = from + width * (i + 1) / parts;
            curve.functions.x.push_back(low / length);
            curve.functions.polynomial.push_back({spline_on(low, high, degree, span, knots, coefficients), {}});
        }
    }
    require(!curve.functions.x.empty(), "it is damaged: the knots of its spline do not cover its length");
    curve.functions.x.front() = 0;
    curve.functions.x.push_back(1);
    measure(curve, curve.functions.x);
    return curve;
}

CurveFunctions functions_along(const PerturbedCurve& curve, const std::vector<double>& first,
                               const std::vector<double>& second) {
    std::vector<double> s = curve.functions.x;
    require(first.size() == s.size() && second.size() == s.size(),
            "values on a profile: one is needed for each of its points");
    if (curve.is_cell())
        for (double& c : s) c = std::acos(-std::clamp(c, -1.0, 1.0)) / pi;
    return functions_of(curve, first, second, s);
}

namespace {

// Unit tangent (r, z) at s.
std::array<double, 2> tangent(const PerturbedCurve& curve, double s) {
    const auto [r, z] = profile_at(curve, Jet<double, 1, 1>::variable(s, 0));
    const double speed = std::hypot(r.d[0], z.d[0]);
    return {r.d[0] / speed, z.d[0] / speed};
}

// The sum over terms, times weights, that is nearest to the values at s.
std::array<double, CurveMode::terms> fitted(const PerturbedCurve& curve, const std::vector<double>& s,
                                            const std::vector<double>& values, int power_of_sine, double tolerance) {
    const auto n = static_cast<Eigen::Index>(s.size());
    Eigen::MatrixXd functions(n, CurveMode::terms);
    Eigen::VectorXd right(n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const double weight = curve.is_cell() ? std::pow(std::sin(pi * s[i]), power_of_sine) : 1;
        const auto f = mode_functions(curve, curve.is_cell() ? -std::cos(pi * s[i]) : s[i]);
        for (int k = 0; k < CurveMode::terms; ++k) functions(i, k) = weight * f[k];
        right[i] = values[i];
    }
    const Eigen::VectorXd coefficients =
        Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(functions).solve(right);
    if ((functions * coefficients - right).lpNorm<Eigen::Infinity>() > tolerance)
        throw std::invalid_argument(fmt::format(
            "a mode varies too fast along the profile for {} functions: take a slower one", CurveMode::terms));
    std::array<double, CurveMode::terms> out;
    for (int k = 0; k < CurveMode::terms; ++k) out[k] = coefficients[k];
    return out;
}

// The surface as it is disturbed must keep off the axis but at poles.
void require_radius(const PerturbedCurve& curve) {
    constexpr int along = 400, around = 32;
    for (int i = curve.is_cell() ? 1 : 0; i < along; ++i)
        for (int j = 0; j < around; ++j) {
            const double s = double(i) / along, phi = 2 * pi * j / around;
            const Eigen::Vector3d x = position(curve, Torus{2, 1}, base_point(curve, s, phi));
            if (!(x[0] * std::cos(phi) + x[1] * std::sin(phi) > 0))
                throw std::invalid_argument(fmt::format("moves the surface across its axis at z = {:.4g}", x[2]));
        }
}

}  // namespace

CurveMode normal_mode(const PerturbedCurve& curve, int m, const std::vector<double>& w) {
    if (m < 1 || w.size() < CurveMode::terms) throw std::invalid_argument("a mode needs m >= 1 and enough values");
    std::vector<double> s, radial, axial;
    for (std::size_t i = 0; i < w.size(); ++i) {
        s.push_back(static_cast<double>(i) / static_cast<double>(w.size() - 1));
        const bool pole = curve.is_cell() && (i == 0 || i + 1 == w.size());  // there all functions vanish
        const auto [t_r, t_z] = pole ? std::array{0.0, 0.0} : tangent(curve, s.back());
        radial.push_back(w[i] * t_z), axial.push_back(-w[i] * t_r);
    }
    double largest = 0;
    for (const double value : w) largest = std::max(largest, std::abs(value));
    return {m, fitted(curve, s, radial, m + 1, 0.01 * largest), fitted(curve, s, axial, m, 0.01 * largest)};
}

PerturbedCurve disturbed(PerturbedCurve curve, const ResultFrame& frame) {
    require(!is_patch(curve.topology), "must be absent: modes and noise are those of closed cells, tubes and rings");
    const bool cell = curve.is_cell();
    const double radius = cell ? std::sqrt(curve.mean_radius * curve.arc_length / 2) : curve.mean_radius;
    const std::size_t n = curve.functions.x.size();
    const VelocityAtPoints outward{std::vector<double>(n, 1), std::vector<double>(n, 0), {}};
    curve.along_normal = NormalModes{disturbed_shape(frame, cell, radius, curve.length > 0 ? curve.length : 1),
                                     curve_velocity(curve, outward).meridional};
    require_radius(curve);
    return curve;
}

CurveVelocity curve_velocity(const PerturbedCurve& curve, const VelocityAtPoints& points) {
    const std::vector<double>& x = curve.functions.x;
    std::vector<double> radial, axial, around = points.around;
    for (std::size_t i = 0; i < x.size(); ++i) {
        // At a pole the profile is perpendicular to the axis.
        const bool south = curve.is_cell() && i == 0, north = curve.is_cell() && i + 1 == x.size();
        const double s = curve.is_cell() ? std::acos(-std::clamp(x[i], -1.0, 1.0)) / pi : x[i];
        const auto [t_r, t_z] = south ? std::array{1.0, 0.0} : north ? std::array{-1.0, 0.0} : tangent(curve, s);
        radial.push_back(points.normal[i] * t_z + points.along[i] * t_r);
        axial.push_back(-points.normal[i] * t_r + points.along[i] * t_z);
    }
    around.resize(x.size(), 0);
    return {functions_along(curve, radial, axial), functions_along(curve, around, std::vector<double>(x.size(), 0)),
            !points.around.empty()};
}

Vector3<double> velocity(const PerturbedCurve& curve, const Torus& base, const Vector3<double>& p) {
    const auto at = place_of(curve, base, p);
    const auto [radial, axial] = value_at(curve.velocity->meridional, at.along);
    const double swirl = value_at(curve.velocity->around, at.along)[0];
    return {radial * at.x - swirl * at.y, radial * at.y + swirl * at.x, axial};
}

Curve meridian(const PerturbedCurve& curve) {
    return curve_of(curve.topology, curve.length, [of = std::make_shared<const PerturbedCurve>(curve)](const auto& s) {
        if (!of->along_normal) return profile_at(*of, s);
        const auto x = position(*of, Torus{2, 1}, base_point(*of, s, 0));
        return std::array{x[0], x[2]};
    });
}

}  // namespace tubule
