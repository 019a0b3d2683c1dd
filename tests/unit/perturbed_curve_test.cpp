// Surfaces of revolution from points of their profile, against closed forms: position, H and K, at poles too.
#include "common/shapes/perturbed_curve.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/message_of.hpp"

namespace tubule::profile_curve_test {

// Parameters 0 ... 1 as tier axisym samples them: six equal steps an element, elements of lengths 1 and 2 in turn.
std::vector<double> uneven(int elements) {
    std::vector<double> t{0};
    for (int e = 0; e < elements; ++e)
        for (int i = 0; i < 6; ++i) t.push_back(t.back() + (e % 2 ? 2 : 1));
    const double total = t.back();
    for (double& value : t) value /= total;
    return t;
}

template <class R, class Z>
PerturbedCurve sampled(int elements, double length, const R& r, const Z& z) {
    std::vector<double> rs, zs;
    for (const double t : uneven(elements)) rs.push_back(r(t)), zs.push_back(z(t));
    return curve_through(rs, zs, length);
}

SurfacePoint<double> point(const PerturbedCurve& curve, const Eigen::Vector3d& p, const Torus& base = {}) {
    const Eigen::Vector3d any = Eigen::Vector3d(0.3, -0.8, 0.6).cross(p).normalized();
    const Eigen::Vector3d first = std::abs(p[2]) < 1e-12 ? Eigen::Vector3d(Eigen::Vector3d::UnitZ().cross(p)) : any;
    return point_of_map<double>([&](const auto& q) { return position(curve, base, q); }, p, first, p.cross(first));
}

struct Errors {
    double position = 0, H = 0, K = 0;
};

// The spheroid x^2 + y^2 + z^2/c^2 = 1; H and K of an ellipsoid in closed form by the position.
constexpr double half_axis = 0.6;
PerturbedCurve spheroid(int elements) {
    return sampled(
        elements, 0, [](double t) { return t == 0 || t == 1 ? 0 : std::sin(pi * t); },
        [](double t) { return -half_axis * std::cos(pi * t); });
}
Errors spheroid_errors(int elements) {
    const PerturbedCurve curve = spheroid(elements);
    Errors worst;
    for (int i = 0; i <= 400; ++i) {
        const double angle = pi * i / 400;
        const auto p = point(curve, Eigen::Vector3d(2 * std::sin(angle), 0, -2 * std::cos(angle)));
        const double c2 = half_axis * half_axis, x2 = p.x[0] * p.x[0] + p.x[1] * p.x[1], z2 = p.x[2] * p.x[2];
        const double q = x2 + z2 / (c2 * c2);
        worst.position = std::max(worst.position, std::abs(x2 + z2 / c2 - 1));
        worst.H = std::max(worst.H, std::abs(p.H - (x2 + z2 - 2 - c2) / (c2 * std::pow(q, 1.5))));
        worst.K = std::max(worst.K, std::abs(p.K - 1 / (c2 * q * q)));
    }
    return worst;
}

TEST(PerturbedCurve, CellIsSmoothAtThePoles) {
    const Errors coarse = spheroid_errors(10), fine = spheroid_errors(20);
    // |H| and |K| are up to 3.8 and 2.8. Polynomials of degree 6: order 7, and 5 in second derivatives.
    EXPECT_LT(fine.position, 1e-9);
    EXPECT_LT(fine.H, 1.5e-5);
    EXPECT_LT(fine.K, 1.5e-5);
    EXPECT_GT(std::log2(coarse.position / fine.position), 5.5);
    EXPECT_GT(std::log2(coarse.H / fine.H), 4.5);
    EXPECT_GT(std::log2(coarse.K / fine.K), 4.5);
}

TEST(PerturbedCurve, TubeThatOverhangs) {
    // z' = 2 + 1.2 pi cos(2 pi t) < 0 about t = 1/2. At its points, curvatures are those of the curve: theory.md (4.5).
    const double length = 2;
    const auto r = [](double t) { return 1 + 0.4 * std::cos(2 * pi * t); };
    const auto z = [&](double t) { return length * t + 0.6 * std::sin(2 * pi * t); };
    const PerturbedCurve curve = sampled(30, length, r, z);
    EXPECT_EQ(curve.topology, Topology::tube);
    const std::vector<double> t = uneven(30);
    for (std::size_t i = 0; i + 1 < t.size(); ++i) {
        const Eigen::Vector3d base(0, 1.5, length * curve.functions.x[i]);
        const auto p = point(curve, base);
        EXPECT_NEAR(p.x[1], r(t[i]), 1e-13);
        EXPECT_NEAR(p.x[2], z(t[i]), 1e-13);
        const double w = 2 * pi, c = std::cos(w * t[i]), s = std::sin(w * t[i]);
        const auto exact =
            profile_point(r(t[i]), -0.4 * w * s, -0.4 * w * w * c, length + 0.6 * w * c, -0.6 * w * w * s);
        EXPECT_NEAR(p.H, exact.H, 1e-3 * std::abs(exact.H) + 1e-3) << t[i];
        EXPECT_NEAR(p.K, exact.K, 1e-3 * std::abs(exact.K) + 1e-3) << t[i];
        const auto above = point(curve, base + 3 * length * Eigen::Vector3d::UnitZ());
        EXPECT_NEAR((above.x - p.x)[2], 3 * length, 1e-12);
        EXPECT_NEAR(above.H, p.H, 1e-6 * std::abs(p.H));
    }
}

TEST(PerturbedCurve, RingIsATorus) {
    const double tube = 0.5, radius = 1.5;  // begins on the outside and goes up
    const PerturbedCurve curve = sampled(
        20, 0, [&](double t) { return radius + tube * std::cos(2 * pi * t); },
        [&](double t) { return tube * std::sin(2 * pi * t); });
    EXPECT_TRUE(curve.is_ring());
    EXPECT_NEAR(curve.arc_length, 2 * pi * tube, 1e-9);
    EXPECT_NEAR(curve.mean_radius, radius, 1e-9);
    const Torus base{1.2, 0.4};
    for (int i = 0; i < 100; ++i) {
        const double angle = 2 * pi * i / 100, cosine = std::cos(angle);
        const Eigen::Vector3d on_base(1.2 + 0.4 * cosine, 0, 0.4 * std::sin(angle));
        const auto p =
            point_of_map<double>([&](const auto& q) { return position(curve, base, q); }, on_base,
                                 Eigen::Vector3d::UnitY(), Eigen::Vector3d(std::sin(angle), 0, -std::cos(angle)));
        EXPECT_NEAR(p.x[0], radius + tube * cosine, 1e-8);
        EXPECT_NEAR(p.x[2], tube * std::sin(angle), 1e-8);
        EXPECT_NEAR(p.K, cosine / (tube * (radius + tube * cosine)), 1e-4);
        EXPECT_NEAR(std::abs(p.H), std::abs(1 / tube + cosine / (radius + tube * cosine)), 1e-4);
    }
}

TEST(PerturbedCurve, OfASpline) {
    // A cubic spline with all its knots at the ends is a Bezier curve: r = 1 + z/2 on [0, 2] from these coefficients.
    const PerturbedCurve cone = spline_curve(3, 2, {0, 0, 0, 0, 2, 2, 2, 2}, {1, 4. / 3, 5. / 3, 2});
    EXPECT_EQ(cone.topology, Topology::tube);
    EXPECT_NEAR(cone.arc_length, std::sqrt(5), 1e-13);
    EXPECT_NEAR(cone.mean_radius, 1.5, 1e-13);
    using J = Jet<double, 1, 2>;
    for (const double z : {0.0, 0.5, 1.9, 2.5}) {  // periodic
        const auto x = position(cone, Torus{}, Vector3<J>(J(0.6), J(0.8), J::variable(z, 0)));
        EXPECT_NEAR(std::hypot(x[0].v, x[1].v), 1 + std::fmod(z, 2) / 2, 1e-14);
        EXPECT_NEAR(x[0].d[0], 0.3, 1e-13);
        EXPECT_NEAR(x[0].dd[0], 0, 1e-10);
        EXPECT_NEAR(x[2].v, z, 1e-14);
    }
    EXPECT_THROW(spline_curve(3, 2, {0, 0, 2, 2}, {1, 2}), std::invalid_argument);
}

TEST(PerturbedCurve, Refusals) {
    const auto refusal = [](std::vector<double> r, std::vector<double> z, double length = 0) -> std::string {
        return test::message_of<std::invalid_argument>([&] { curve_through(r, z, length); });
    };
    std::vector<double> r, z;
    for (int i = 0; i <= 12; ++i) r.push_back(std::sin(pi * i / 12)), z.push_back(-std::cos(pi * i / 12));
    r.back() = 0;
    EXPECT_EQ(refusal(r, z), "accepted");
    EXPECT_EQ(refusal({0, 1, 0}, {-1, 0, 1}), "a profile needs r and z of at least 9 points");
    EXPECT_EQ(refusal({r.rbegin(), r.rend()}, {z.rbegin(), z.rend()}),
              "a profile must be oriented with the outside to its right");
    std::vector<double> other = r;
    other[5] = 0;
    EXPECT_EQ(refusal(other, z), "r of a profile must be positive between its ends");
    other = r, other.back() = 0.1;
    EXPECT_EQ(refusal(other, z), "a profile must run from pole to pole, over one period, once around, or from a ring");
    EXPECT_EQ(refusal(r, z, 2), "a profile must run from pole to pole, over one period, once around, or from a ring");
    std::vector<double> doubled_r = r, doubled_z = z;
    doubled_r[4] = doubled_r[5], doubled_z[4] = doubled_z[5];
    EXPECT_EQ(refusal(doubled_r, doubled_z), "two neighbouring points of a profile coincide");
}

}  // namespace tubule::profile_curve_test
