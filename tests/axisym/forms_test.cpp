// The discrete energy and its derivatives, and what they converge to.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "axisym/graph/graph_derivatives.hpp"
#include "axisym/graph/graph_forms.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/geometry/profile_point.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/axisym/series.hpp"
#include "tests/support/message_of.hpp"
#include "tests/support/random_vector.hpp"

namespace tubule::axisym::forms_test {

using Vector = Eigen::VectorXd;

const Cell whole{0, 2, false, 1}, half{0, 1, true, 1};

// A profile between 0.4 and 1.6 with no smoothness beyond that of its space.
Vector rough(int n, unsigned seed = 5) {
    return test::uniform_vector(n, 0.4, 1.6, seed);
}

TEST(Forms, gradientAndHessianOfEachTermAndOfAll) {
    // Theorem: Taylor remainders fall with the second power of the step (common/solve/derivative_check.hpp).
    for (int degree : {3, 5, 7})
        for (const Cell& cell : {whole, half})
            for (const Bending& material : {bending(0.2, -2, 0.03, 0.06), bending(1, 0.7, 0.2, -0.4)}) {
                const SplineSpace space(cell, equal_breaks(7, cell), degree, degree - 1);
                const Forms forms(space, material, {.tension = 0.7, .pressure = -1.3});
                const Vector x = rough(space.size());
                const auto checks = check_terms(forms, x);
                ASSERT_EQ(checks.size(), 3u);
                for (const auto& [key, check] : checks) {
                    EXPECT_TRUE(check.pass()) << key << ", degree " << degree << "\n" << check.text();
                    EXPECT_FALSE(std::isnan(check.gradient.slope)) << key;
                }
                const auto all = check_derivatives(
                    [&](const Vector& y) { return forms.free_energy(y); },
                    [&](const Vector& y) { return forms.gradient(y); },
                    [&](const Vector& y, const Vector& w) -> Vector { return forms.hessian(y) * w; }, x);
                EXPECT_TRUE(all.pass()) << all.text();
            }
}

TEST(Forms, refusesEvenDegrees) {
    const SplineSpace space(whole, equal_breaks(5, whole), 4, 3);
    EXPECT_EQ(test::message_of<std::invalid_argument>([&] { Forms(space, bending(1)); }),
              "spline degree must be 3, 5 or 7");
}

TEST(Forms, derivativesOfACase) {
    Case c = tube_case(bending(0.2, -2, 0, 0.06), 1, 2, {{0.4, 1}, {0.1, 3, 0, 0.3}}, 1);
    const auto checks = check_terms(c);
    ASSERT_EQ(checks.size(), 2u);  // k40 = 0 is not in use
    EXPECT_EQ(checks[0].key, "k20");
    EXPECT_EQ(checks[1].key, "k42");
    for (const auto& check : checks) EXPECT_TRUE(check.check.pass()) << check.check.text();
}

TEST(Forms, jacobianIsThatOfTheResidual) {
    // Expected: central differences of the residual in x and v.
    std::mt19937 engine(3);
    std::normal_distribution<double> normal;
    for (int degree : {3, 5, 7})
        for (const Cell& cell : {whole, half}) {
            const SplineSpace space(cell, equal_breaks(6, cell), degree, degree - 1);
            const Forms forms(space, bending(0.2, -2, 0.03, 0.06));
            const int n = space.size();
            const Vector x = rough(n);
            Vector v(n), w(n), plus(n), minus(n);
            for (int i = 0; i < n; ++i) v[i] = 50 * normal(engine), w[i] = normal(engine);
            const double cj = 1e4, h = 1e-6;
            Eigen::SparseMatrix<double> J = forms.pattern();
            forms.jacobian(x.data(), v.data(), cj, J.valuePtr());
            const Vector xp = x + h * w, xm = x - h * w, vp = v + cj * h * w, vm = v - cj * h * w;
            ASSERT_TRUE(forms.residual(xp.data(), vp.data(), plus.data()));
            ASSERT_TRUE(forms.residual(xm.data(), vm.data(), minus.data()));
            const Vector Jw = J * w;
            EXPECT_LT((Jw - (plus - minus) / (2 * h)).norm(), 1e-6 * Jw.norm()) << degree;
            // Each part by itself: mass, and what the drag adds to the Hessian.
            forms.residual(x.data(), vp.data(), plus.data());
            forms.residual(x.data(), vm.data(), minus.data());
            EXPECT_LT((forms.mass(x) * w - (plus - minus) / (2 * cj * h)).norm(), 1e-8 * w.norm()) << degree;
            forms.jacobian(x.data(), v.data(), 0, J.valuePtr());
            const auto drag = [&](const Vector& y) -> Vector { return forms.mass(y) * v; };
            const Vector expected = forms.hessian(x) * w + (drag(xp) - drag(xm)) / (2 * h);
            EXPECT_LT((J * w - expected).norm(), 1e-7 * expected.norm()) << degree;
        }
}

TEST(Forms, residualTellsWhenTheRadiusIsNotPositive) {
    const SplineSpace space(whole, equal_breaks(6, whole), 5, 4);
    const Forms forms(space, bending(0.2, -2));
    Vector F(space.size()), rest = Vector::Zero(space.size());
    Vector x = Vector::Ones(space.size());
    EXPECT_TRUE(forms.residual(x.data(), rest.data(), F.data()));
    x = space.project([](double z) { return 0.5 + 0.6 * std::cos(pi * z); });
    EXPECT_FALSE(forms.residual(x.data(), rest.data(), F.data()));
}

TEST(Forms, uniformTubeIsExact) {
    // Exact: a tube of radius R and length L has H = -1/R, K = 0, area 2 pi R L, volume pi R^2 L; its rate is
    // dR/dt = -(f + f_H/R)/R, theory.md (5.3); E_ref = area (k20 (H^2 + H0^2) + k40 (H - H0)^4).
    const double R = 0.8, L = 2, k20 = 0.2, H0 = -2, k40 = 0.03, h = -1 / R - H0;
    const double f = k20 * h * h + k40 * h * h * h * h, fH = 2 * k20 * h + 4 * k40 * h * h * h;
    for (int degree : {3, 5, 7})
        for (const Cell& cell : {whole, half, Cell{0, 0.5, true, 2}}) {
            const SplineSpace space(cell, equal_breaks(5, cell), degree, degree - 1);
            const Forms forms(space, bending(k20, H0, k40, 0.06));
            const Vector x = Vector::Constant(space.size(), R), v = forms.rate(x);
            const Observation o = forms.observe(x.data(), v.data());
            const double area = 2 * pi * R * L, rate = -(f + fH / R) / R;
            EXPECT_NEAR(o.area, area, 1e-13);
            EXPECT_NEAR(o.volume, pi * R * R * L, 1e-13);
            EXPECT_NEAR(o.energy, f * area, 1e-12);
            EXPECT_NEAR(o.energy_term[0], k20 * h * h * area, 1e-12);
            EXPECT_NEAR(o.energy_term[1], k40 * h * h * h * h * area, 1e-12);
            EXPECT_NEAR(o.energy_term[2], 0, 1e-13);
            EXPECT_LT((v.array() - rate).abs().maxCoeff(), 1e-10) << degree;
            EXPECT_NEAR(o.dissipation, area * rate * rate, 1e-10);
            EXPECT_NEAR(o.r_min, R, 1e-14);
            EXPECT_NEAR(o.r_max, R, 1e-14);
            EXPECT_NEAR(o.symbol, 2 * k20 + 12 * k40 * h * h + 2 * 0.06 / (R * R), 1e-12);  // x = kappa_theta = -1/R
            EXPECT_NEAR(o.symbol_3d, 2 * k20 + 12 * k40 * h * h, 1e-12);                    // x = 0
            EXPECT_NEAR(forms.reference_energy(x), area * (k20 * (1 / (R * R) + H0 * H0) + k40 * h * h * h * h), 1e-12);
            EXPECT_NEAR(forms.mode(0)[0].dot(x), R, 1e-14);
        }
}

TEST(Forms, integralsAgainstDenseQuadrature) {
    // Expected: the trapezoidal rule with 4096 points, exact to rounding for periodic analytic functions.
    const auto r = [](double z) { return 1 + 0.3 * std::cos(pi * z) + 0.05 * std::cos(3 * pi * z + 0.7); };
    const double k20 = 0.2, H0 = -2, k40 = 0.03, k42 = 0.06;
    double area = 0, volume = 0, e20 = 0, e40 = 0, e42 = 0, reference = 0, r_min = 9, r_max = 0;
    const int n = 4096;
    for (int i = 0; i < n; ++i) {
        const double z = 2.0 * i / n;
        const double r1 = -0.3 * pi * std::sin(pi * z) - 0.15 * pi * std::sin(3 * pi * z + 0.7);
        const double r2 = -0.3 * pi * pi * std::cos(pi * z) - 0.45 * pi * pi * std::cos(3 * pi * z + 0.7);
        const double g = std::sqrt(1 + r1 * r1), H = (r2 / (g * g) - 1 / r(z)) / g, K = -r2 / (r(z) * std::pow(g, 4));
        const double dS = 2 * pi * r(z) * g * 2 / n;
        area += dS, volume += pi * r(z) * r(z) * 2 / n;
        e20 += k20 * std::pow(H - H0, 2) * dS, e40 += k40 * std::pow(H - H0, 4) * dS, e42 += k42 * K * K * dS;
        reference += (k20 * (H * H + H0 * H0) + k40 * std::pow(H - H0, 4) + k42 * K * K) * dS;
        r_min = std::min(r_min, r(z)), r_max = std::max(r_max, r(z));
    }
    for (int degree : {5, 7}) {
        const SplineSpace space(whole, equal_breaks(80, whole), degree, degree - 1);
        const Forms forms(space, bending(k20, H0, k40, k42));
        const Vector x = space.project(r), rest = Vector::Zero(x.size());
        const Observation o = forms.observe(x.data(), rest.data());
        EXPECT_NEAR(o.area, area, 1e-11);
        EXPECT_NEAR(o.volume, volume, 1e-11);
        EXPECT_NEAR(o.energy_term[0], e20, 1e-9);
        EXPECT_NEAR(o.energy_term[1], e40, 1e-8);
        EXPECT_NEAR(o.energy_term[2], e42, 1e-9);
        EXPECT_NEAR(o.energy, e20 + e40 + e42, 1e-8);
        EXPECT_NEAR(forms.reference_energy(x), reference, 1e-8);
        EXPECT_NEAR(o.r_min, r_min, 1e-3);  // at quadrature points only
        EXPECT_NEAR(o.r_max, r_max, 1e-3);
        EXPECT_GE(o.r_min, r_min - 1e-9);
        EXPECT_LE(o.r_max, r_max + 1e-9);
        const auto amplitude = [&](int m) { return std::hypot(forms.mode(m)[0].dot(x), forms.mode(m)[1].dot(x)); };
        EXPECT_NEAR(amplitude(0), 1, 1e-10);
        EXPECT_NEAR(amplitude(1), 0.3, 1e-10);
        EXPECT_NEAR(amplitude(2), 0, 1e-10);
        EXPECT_NEAR(amplitude(3), 0.05, 1e-10);
    }
}

TEST(Forms, rateDissipatesTheDiscreteEnergy) {
    // Theorem: M v = -grad E gives dE/dt = -v.M v, the observed dissipation; at any state, however rough.
    const SplineSpace space(whole, equal_breaks(8, whole), 5, 4);
    const Forms forms(space, bending(0.2, -2, 0.03, 0.06));
    const Vector x = rough(space.size()), v = forms.rate(x);
    const double change = forms.gradient(x).dot(v), dissipation = forms.observe(x.data(), v.data()).dissipation;
    EXPECT_NEAR(change, -dissipation, 1e-10 * dissipation);
}

TEST(StrongForce, vanishesOnTheCliffordTorus) {
    // Exact: b20 = 0 pointwise on the torus c = sqrt2 a for H0 = 0, and not for others.
    const auto b20 = [](double a, double c, double z) {
        Series s;
        s.c[0] = a * a - z * z, s.c[1] = -2 * z, s.c[2] = -1;
        return strong_force(power(s, 0.5) + c, 0).b20;
    };
    for (double z : {-0.5, 0.0, 0.3}) {
        EXPECT_NEAR(b20(1, std::sqrt(2.0), z), 0, 1e-13);
        EXPECT_GT(std::abs(b20(1, 1.6, z)), 1e-2);
    }
}

TEST(StrongForce, ofSphereAndTube) {
    // Exact: dE/dt = -INT b^2 with E = 4 pi R^2 f gives b = -(2/R)(f + f_H/R - k42/R^4) for spheres, theory.md (6.2)
    // (in f without k42), b = -(f + f_H/R)/R for tubes, theory.md (5.3).
    const double R = 1.3, H0 = -0.6;
    for (double z : {0.0, 0.4}) {
        Series s;
        s.c[0] = R * R - z * z, s.c[1] = -2 * z, s.c[2] = -1;
        const auto b = strong_force(power(s, 0.5), H0);
        const double h = -2 / R - H0;
        EXPECT_NEAR(b.b20, -2 / R * (h * h + 2 * h / R), 1e-12);
        EXPECT_NEAR(b.b40, -2 / R * (std::pow(h, 4) + 4 * std::pow(h, 3) / R), 1e-12);
        EXPECT_NEAR(b.b42, 2 / std::pow(R, 5), 1e-12);
    }
    Series tube;
    tube.c[0] = R;
    const auto b = strong_force(tube, H0);
    const double h = -1 / R - H0;
    EXPECT_NEAR(b.b20, -(h * h + 2 * h / R) / R, 1e-13);
    EXPECT_NEAR(b.b40, -(std::pow(h, 4) + 4 * std::pow(h, 3) / R) / R, 1e-13);
    EXPECT_NEAR(b.b42, 0, 1e-15);
}

// Largest defect of grad E_h . w = -INT 2 pi r b w dz over some smooth w, for one modulus of 1 alone.
double force_error(int term, double H0, int degree, int elements) {
    const SplineSpace space(whole, equal_breaks(elements, whole), degree, degree - 1);
    Bending material{.k = {}, .H0 = H0};
    material.k[term] = 1;
    const Forms forms(space, material);
    const auto profile = [](double z) {
        Series r = cosine(0.25, pi, 0.3, z) + cosine(0.08, 2 * pi, -1, z);
        return r + 1.0;
    };
    const auto force = [&](double z) {
        const StrongForce b = strong_force(profile(z), H0);
        return term == 0 ? b.b20 : term == 1 ? b.b40 : b.b42;
    };
    const Vector gradient = forms.gradient(space.project([&](double z) { return profile(z).value(); }));
    double largest = 0;
    for (int n = 0; n <= 3; ++n)
        for (double phase : {0.0, 1.1}) {
            const auto w = [&](double z) { return std::cos(n * pi * z + phase); };
            double expected = 0, size = 0;  // trapezoidal rule: exact to rounding here
            const int points = 1024;
            for (int i = 0; i < points; ++i) {
                const double z = 2.0 * i / points, density = 2 * pi * profile(z).value() * force(z) * w(z) * 2 / points;
                expected -= density, size += std::abs(density);
            }
            largest = std::max(largest, std::abs(gradient.dot(space.project(w)) - expected) / size);
        }
    return largest;
}

TEST(WeakForce, convergesToTheStrongForceOfThePaper) {
    // Oracle: b20, b40, b42 in closed form, differentiated as power series. Superconvergence: order 2 (p - 1) of
    // the energy also holds for smooth test functions.
    for (int term = 0; term < 3; ++term)
        for (double H0 : {0.0, -2.0}) {
            struct Expected {
                int degree, elements;
                double order, error;
            };
            for (const auto& [degree, elements, order, error] :
                 {Expected{3, 32, 3.7, 1e-3}, Expected{5, 20, 7.0, 1e-5}, Expected{7, 14, 10.0, 1e-6}}) {
                const double coarse = force_error(term, H0, degree, elements),
                             fine = force_error(term, H0, degree, 2 * elements);
                EXPECT_GT(std::log2(coarse / fine), order) << "term " << term << ", degree " << degree << ", H0 " << H0
                                                           << ", errors " << coarse << " " << fine;
                EXPECT_LT(fine, error) << "term " << term << ", degree " << degree << ", H0 " << H0;
            }
        }
}

}  // namespace tubule::axisym::forms_test
