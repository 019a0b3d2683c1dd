// Curvatures of curves of revolution, and the jets that carry their derivatives.
#include <gtest/gtest.h>

#include <cmath>

#include "common/energy/bending.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::geometry_test {

struct Curve {
    double r, r1, r2, z1, z2;
};

ProfilePoint<double> at(const Curve& c) {
    return profile_point(c.r, c.r1, c.r2, c.z1, c.z2);
}

TEST(ProfilePoint, sphereInAParameterThatIsNoArcLength) {
    // Exact: H = -2/R, K = 1/R^2. Angle w(s) = s + 0.3 sin(s), running up the z axis.
    const double R = 1.7;
    for (double s : {0.4, 1.0, 1.9, 2.5}) {
        const double w = s + 0.3 * std::sin(s), w1 = 1 + 0.3 * std::cos(s), w2 = -0.3 * std::sin(s);
        const auto p = at({R * std::sin(w), R * std::cos(w) * w1, R * (std::cos(w) * w2 - std::sin(w) * w1 * w1),
                           R * std::sin(w) * w1, R * (std::sin(w) * w2 + std::cos(w) * w1 * w1)});
        EXPECT_NEAR(p.H, -2 / R, 1e-14);
        EXPECT_NEAR(p.K, 1 / (R * R), 1e-14);
        EXPECT_NEAR(p.inverse_speed, 1 / (R * w1), 1e-14);
        EXPECT_NEAR(p.area, 2 * pi * R * std::sin(w) * R * w1, 1e-13);
    }
}

TEST(ProfilePoint, torusAllRound) {
    // Exact: kappa_s = -1/a, kappa_theta = -cos(phi)/(c + a cos(phi)), on the inner side too, where z runs backwards.
    const double a = 0.6, c = 1.5;
    for (double phi = -3; phi < 3.2; phi += 0.4) {
        const double co = std::cos(phi), si = std::sin(phi);
        const auto p = at({c + a * co, -a * si, -a * co, a * co, -a * si});
        EXPECT_NEAR(p.kappa_s, -1 / a, 1e-13);
        EXPECT_NEAR(p.kappa_theta, -co / (c + a * co), 1e-13);
        EXPECT_NEAR(p.H, -1 / a - co / (c + a * co), 1e-13);
        EXPECT_NEAR(p.K, co / (a * (c + a * co)), 1e-13);
    }
}

TEST(ProfilePoint, torusIntegrals) {
    // Exact: INT H^2 = 4 pi^2 c^2/(a q), INT K^2 = (4 pi^2 c/a^3)(c/q - 1), q = sqrt(c^2 - a^2), INT K = 0,
    // area 4 pi^2 a c. The trapezoidal rule is exact to rounding for periodic analytic functions.
    const double a = 0.6, c = 1.5, q = std::sqrt(c * c - a * a);
    const int n = 200;
    double H2 = 0, K2 = 0, K = 0, area = 0;
    for (int i = 0; i < n; ++i) {
        const double phi = 2 * pi * i / n, co = std::cos(phi), si = std::sin(phi);
        const auto p = at({c + a * co, -a * si, -a * co, a * co, -a * si});
        const double dS = p.area * 2 * pi / n;
        H2 += p.H * p.H * dS, K2 += p.K * p.K * dS, K += p.K * dS, area += dS;
    }
    EXPECT_NEAR(H2, 4 * pi * pi * c * c / (a * q), 1e-11);
    EXPECT_NEAR(K2, 4 * pi * pi * c / (a * a * a) * (c / q - 1), 1e-11);
    EXPECT_NEAR(K, 0, 1e-12);
    EXPECT_NEAR(area, 4 * pi * pi * a * c, 1e-12);
}

TEST(ProfilePoint, catenoidIsMinimal) {
    // Exact: r = c cosh(z/c) has H = 0 and K = -1/(c^2 cosh^4(z/c)).
    const double c = 0.7;
    for (double z : {-1.0, -0.2, 0.0, 0.5}) {
        const double co = std::cosh(z / c), si = std::sinh(z / c);
        const auto p = graph_point(c * co, si, co / c);
        EXPECT_NEAR(p.H, 0, 1e-14);
        EXPECT_NEAR(p.K, -1 / (c * c * std::pow(co, 4)), 1e-14);
    }
}

TEST(ProfilePoint, tubePointsOutward) {
    // Exact: a tube of radius r has H = -1/r, K = 0.
    const auto p = graph_point(0.8, 0.0, 0.0);
    EXPECT_DOUBLE_EQ(p.H, -1.25);
    EXPECT_DOUBLE_EQ(p.K, 0);
    EXPECT_DOUBLE_EQ(p.area, 2 * pi * 0.8);
}

TEST(ProfilePoint, graphIsTheCurveWithUnitZ1AndDoesNotDependOnTheParameter) {
    // Invariance: z = Z(s) with r(z) given: r1 = r' Z', r2 = r'' Z'^2 + r' Z''.
    const double r = 0.9, slope = -1.3, second = 4.1, z1 = 2.2, z2 = -0.7;
    const auto g = graph_point(r, slope, second);
    const auto same = profile_point(r, slope, second, 1.0, 0.0);
    const auto p = profile_point(r, slope * z1, second * z1 * z1 + slope * z2, z1, z2);
    EXPECT_DOUBLE_EQ(g.H, same.H);
    EXPECT_DOUBLE_EQ(g.K, same.K);
    EXPECT_NEAR(p.H, g.H, 1e-14);
    EXPECT_NEAR(p.K, g.K, 1e-14);
    EXPECT_NEAR(p.area, g.area * z1, 1e-13);
    // theory.md (4.1): g = sqrt(1 + r'^2), H = (r''/g^2 - 1/r)/g, K = -r''/(r g^4)
    const double speed = std::sqrt(1 + slope * slope);
    EXPECT_NEAR(g.H, (second / (speed * speed) - 1 / r) / speed, 1e-14);
    EXPECT_NEAR(g.K, -second / (r * std::pow(speed, 4)), 1e-14);
}

// Every quantity of a profile point, as a function of (r, r1, r2, z1, z2).
template <class S>
std::array<S, 6> quantities(const std::array<S, 5>& u) {
    const auto p = profile_point(u[0], u[1], u[2], u[3], u[4]);
    return {p.inverse_speed, p.kappa_s, p.kappa_theta, p.H, p.K, p.area};
}

TEST(Jet, derivativesAreThoseOfTheValue) {
    // Expected: central differences of the value, whose error is h^2 times a third (fourth) derivative.
    using J = Jet<double, 5, 2>;
    const std::array<double, 5> u0{0.9, -0.6, 1.4, 0.8, 0.5};
    std::array<J, 5> u;
    for (int i = 0; i < 5; ++i) u[i] = J::variable(u0[i], i);
    const auto jets = quantities(u);
    const auto value = [&](int q, int i, double hi, int j = 0, double hj = 0) {
        auto v = u0;
        v[i] += hi, v[j] += hj;
        return quantities(v)[q];
    };
    for (int q = 0; q < 6; ++q) {
        EXPECT_DOUBLE_EQ(jets[q].v, quantities(u0)[q]);
        for (int i = 0; i < 5; ++i) {
            const double h = 1e-5;
            EXPECT_NEAR(jets[q].d[i], (value(q, i, h) - value(q, i, -h)) / (2 * h), 2e-9) << q << " " << i;
            for (int j = i; j < 5; ++j) {
                const double k = 2e-4;
                const double second =
                    (value(q, i, k, j, k) - value(q, i, k, j, -k) - value(q, i, -k, j, k) + value(q, i, -k, j, -k)) /
                    (4 * k * k);
                EXPECT_NEAR(jets[q].dd[packed<5>(i, j)], second, 5e-6) << q << " " << i << " " << j;
                EXPECT_EQ(packed<5>(i, j), packed<5>(j, i));
            }
        }
    }
}

TEST(Jet, firstOrderIsThatOfSecondOrder) {
    const std::array<double, 5> u0{0.9, -0.6, 1.4, 0.8, 0.5};
    std::array<Jet<double, 5, 1>, 5> a;
    std::array<Jet<double, 5, 2>, 5> b;
    for (int i = 0; i < 5; ++i) a[i] = a[i].variable(u0[i], i), b[i] = b[i].variable(u0[i], i);
    const auto qa = quantities(a);
    const auto qb = quantities(b);
    for (int q = 0; q < 6; ++q)
        for (int i = 0; i < 5; ++i) EXPECT_DOUBLE_EQ(qa[q].d[i], qb[q].d[i]);
}

TEST(CurvatureJet, partialsOfEachTermInClosedForm) {
    // By hand, with u = H - H0: u^2, u^4, K^2.
    const double H0 = -2, H = -0.7, K = 0.9, u = H - H0;
    CurvatureJet<double> h, k;
    h.f = H, h.H = 1;
    k.f = K, k.K = 1;
    const double expected[3][6] = {
        {u * u, 2 * u, 0, 2, 0, 0}, {u * u * u * u, 4 * u * u * u, 0, 12 * u * u, 0, 0}, {K * K, 0, 2 * K, 0, 0, 2}};
    for_each_bending_term([&](std::size_t i, const auto& term) {
        if (i >= 3) return;
        const auto f = term.value(h, k, H0);
        const double got[6] = {f.f, f.H, f.K, f.HH, f.HK, f.KK};
        for (int j = 0; j < 6; ++j) EXPECT_NEAR(got[j], expected[i][j], 1e-14) << term.name << " " << j;
    });
}

TEST(CurvatureJet, productsMix) {
    // By hand: (H K)^2 has partials 2 H K^2, 2 H^2 K, 2 K^2, 4 H K, 2 H^2.
    CurvatureJet<double> h, k;
    h.f = 1.5, h.H = 1;
    k.f = -0.4, k.K = 1;
    const auto f = (h * k) * (h * k);
    EXPECT_NEAR(f.H, 2 * 1.5 * 0.16, 1e-15);
    EXPECT_NEAR(f.K, 2 * 2.25 * -0.4, 1e-15);
    EXPECT_NEAR(f.HH, 2 * 0.16, 1e-15);
    EXPECT_NEAR(f.HK, 4 * 1.5 * -0.4, 1e-15);
    EXPECT_NEAR(f.KK, 2 * 2.25, 1e-15);
    const auto g = 2.0 * h - k + 1.0;
    EXPECT_NEAR(g.f, 4.4, 1e-15);
    EXPECT_NEAR(g.H, 2, 1e-15);
    EXPECT_NEAR(g.K, -1, 1e-15);
}

}  // namespace tubule::geometry_test
