// Exact solutions: tubes that drift, and small waves on them, which grow or decay at the dispersion rate.
#include <gtest/gtest.h>

#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "common/theory/dispersion.hpp"
#include "tests/axisym/runs.hpp"

namespace tubule::axisym::growth_test {

struct Material {
    double k20, H0, k40, k42;
    Bending bending() const { return axisym::bending(k20, H0, k40, k42); }
};

// Energy density on the tube of radius R and its derivatives with respect to H.
struct Density {
    double f, F1, F2;
    Density(const Material& m, double R) {
        const double h = -1 / R - m.H0;
        f = m.k20 * h * h + m.k40 * h * h * h * h;
        F1 = 2 * m.k20 * h + 4 * m.k40 * h * h * h;
        F2 = 2 * m.k20 + 12 * m.k40 * h * h;
    }
};

// theory.md (5.3): dR/dt of the tube
double drift(const Material& m, double R) {
    const Density d(m, R);
    return -(d.f + d.F1 / R) / R;
}

// theory.md (5.6), m = 0: growth rate of exp(i q z)
double growth(const Material& m, double R, double q) {
    const Density d(m, R);
    const double Z = q * q - 1 / (R * R);
    return -(d.F2 * Z * Z + (d.f + d.F1 / R) * Z - 2 * d.F1 * q * q / R + 2 * m.k42 * std::pow(q, 4) / (R * R));
}

struct Base {
    double R, log_growth;
};

// The radius at t and INT growth dt, by the classical Runge-Kutta method with steps far below any required error.
// rate(R): how fast both change.
template <class Rate>
Base base_at(const Rate& rate, double R0, double t) {
    Base y{R0, 0};
    const int n = 20000;
    const double h = t / n;
    for (int i = 0; i < n; ++i) {
        const Base a = rate(y.R), b = rate(y.R + h / 2 * a.R), c = rate(y.R + h / 2 * b.R), d = rate(y.R + h * c.R);
        y.R += h / 6 * (a.R + 2 * b.R + 2 * c.R + d.R);
        y.log_growth += h / 6 * (a.log_growth + 2 * b.log_growth + 2 * c.log_growth + d.log_growth);
    }
    return y;
}
Base base_at(const Material& m, double R0, double q, double t) {
    return base_at([&](double R) { return Base{drift(m, R), growth(m, R, q)}; }, R0, t);
}

TEST(Growth, wavesFollowTheDispersionRelation) {
    struct Wave {
        Material material;
        double R, length;
        int n;
        double end;
    };
    const Wave waves[] = {
        {{0.2, -1, 0, 0}, 1, 2 * pi, 1, 2},          // q = 1/R, stationary base
        {{0.2, -1, 0, 0}, 1, 10, 1, 3},              // long wave on it
        {{0.2, -1, 0, 0.06}, 1, 2, 1, 0.05},         // k42 stiffens
        {{0.2, -2, 0, 0}, 1, 2, 1, 0.1},             // shrinking to 1/2
        {{0.2, -2, 0, 0.12}, 1, 2, 2, 0.003},        // the figure's material
        {{0.2, 0, 0, 0}, 1, 7, 1, 2},                // widening, Rayleigh-like
        {{0.2, 1.5, 0, 0}, 1, 8, 1, 1},              // spontaneous curvature of the other sign
        {{0.2, -2, 0, 0}, 1, 5, 1, 0.4},             // grows while the tube shrinks
        {{0.1, -1.2, 0.03, 0}, 0.9, 3, 1, 0.3},      // k40
        {{0.1, 0.5, 0.02, 0.05}, 1.1, 6, 1, 0.5},    // all terms
        {{0.3, -2.5, 0.01, -0.05}, 1.3, 5, 2, 0.2},  // negative k42, still well-posed
    };
    bool grows = false, decays = false;
    for (const Wave& w : waves) {
        const double q = 2 * pi * w.n / w.length, amplitude = 1e-5;
        const Base exact = base_at(w.material, w.R, q, w.end);
        const double factor = std::exp(exact.log_growth);
        ASSERT_GT(factor, 1e-3);  // else its amplitude drowns in rounding
        (factor > 1 ? grows : decays) = true;
        Case c = tube_case(w.material.bending(), w.R, w.length, {{amplitude, w.n, 0, 0.3}}, w.end);
        explicitly(c, 24 * w.n, 1e-13, 7);
        const Outcome o = run_case(c);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        const double measured = o.last("mode_" + std::to_string(w.n)) / amplitude;
        // Nonlinear terms change it by about (amplitude/R)^2 = 1e-10.
        EXPECT_NEAR(measured / factor, 1, 1e-6)
            << "q = " << q << ", k20 " << w.material.k20 << ", H0 " << w.material.H0 << ", k40 " << w.material.k40
            << ", k42 " << w.material.k42 << ", factor " << factor;
        EXPECT_NEAR(o.last("r_min") + measured * amplitude, exact.R, 1e-8);
    }
    EXPECT_TRUE(grows);
    EXPECT_TRUE(decays);
}

TEST(Growth, wavesOfTermsThatACaseAddsFollowTheDispersionRelation) {
    // theory.md (5.3), (5.6) for any density, as common/theory has them.
    const Bending definite =
        with_terms(bending(0.2, -0.5), {powers(0.02, 6, 0), powers(0.03, 4, 2), powers(0.1, 2, 2)});
    const Bending indefinite = with_terms(bending(0.2, -0.5), {powers(0.05, 2, 1), powers(-0.03, 1, 1)});
    const Bending odd = with_terms(bending(0.2, -0.5), {powers(0.03, 3, 0), powers(-0.02, 1, 2), powers(0.01, 0, 3)});
    const Bending general = with_terms(bending(0.2, -0.5), {formula(0.1, "sqrt(1 + (H - H0)^2 + K^2) + 0.3*H*K")});
    for (const Bending& energy : {definite, indefinite, odd, general}) {
        const double amplitude = 1e-5, R0 = 0.8, length = 2, end = 0.02, q = 2 * pi / length;
        const auto rate = [&](double R) {
            const theory::UniformTube tube{energy, R, 0};
            return Base{theory::radius_rate(tube), -theory::stiffness(tube, 0)(q)};
        };
        const Base exact = base_at(rate, R0, end);
        ASSERT_GT(std::abs(exact.log_growth), 0.01);
        Case c = tube_case(energy, R0, length, {{amplitude, 1, 0, 0.3}}, end);
        explicitly(c, 24, 1e-13, 7);
        const Outcome o = run_case(c);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        const double measured = o.last("mode_1") / amplitude;
        // Nonlinear terms change it by about (amplitude/R)^2 = 1e-10.
        EXPECT_NEAR(std::log(measured) / exact.log_growth, 1, 1e-6);
        EXPECT_NEAR(o.last("r_min") + measured * amplitude, exact.R, 1e-8);
    }
}

// Energy of the exact tube of length L
double tube_energy(const Material& m, double R, double L) {
    return 2 * pi * R * L * Density(m, R).f;
}

void expect_radius(const Material& m, double R0, double end, double R_end) {
    SCOPED_TRACE(testing::Message() << "k20 " << m.k20 << ", H0 " << m.H0 << ", k40 " << m.k40 << ", end " << end);
    const double L = 3;
    for (double asked : {1e-4, 1e-6, 1e-9}) {
        Case c = tube_case(m.bending(), R0, L, {}, end);
        c.accuracy.energy = asked;
        const Outcome o = run_case(c);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        const double error = std::abs(o.last("energy") - tube_energy(m, R_end, L)) / o.summary.reference_energy;
        EXPECT_LE(error, asked);
        EXPECT_LE(o.summary.estimated_error, asked);
        EXPECT_NEAR(o.last("r_min"), o.last("r_max"), 1e-9);
    }
    Case c = tube_case(m.bending(), R0, L, {}, end);
    explicitly(c, 4, 1e-12);
    const Outcome o = run_case(c);
    EXPECT_NEAR(o.last("r_min"), R_end, 1e-9);
    EXPECT_NEAR(o.last("energy"), tube_energy(m, R_end, L), 1e-8);
}

TEST(Drift, withoutSpontaneousCurvature) {
    // theory.md (7.12): R^4 = R0^4 + 4 k20 t
    expect_radius({0.2, 0, 0, 0.1}, 1, 1.5, std::pow(1 + 4 * 0.2 * 1.5, 0.25));
    expect_radius({0.2, 0, 0, 0}, 0.3, 20, std::pow(std::pow(0.3, 4) + 4 * 0.2 * 20, 0.25));
}

TEST(Drift, withSpontaneousCurvature) {
    // theory.md (7.11): v - ln|v| = 2 k20 H0^4 t + const with v = 1 - H0^2 R^2, solved for R by bisection.
    const auto radius_at = [](double k20, double H0, double R0, double t) {
        const auto F = [&](double R) {
            const double v = 1 - H0 * H0 * R * R;
            return v - std::log(std::abs(v));
        };
        const double target = F(R0) + 2 * k20 * std::pow(H0, 4) * t, still = 1 / std::abs(H0);
        double far = R0, near = still;  // F grows without bound towards the stationary radius
        for (int i = 0; i < 200; ++i) {
            const double middle = (far + near) / 2;
            (F(middle) < target ? far : near) = middle;
        }
        return far;
    };
    expect_radius({0.2, -2, 0, 0.06}, 1, 0.5, radius_at(0.2, -2, 1, 0.5));
    expect_radius({0.2, 1, 0, 0}, 0.4, 1, radius_at(0.2, 1, 0.4, 1));
    expect_radius({0.5, -0.8, 0, 0}, 2, 3, radius_at(0.5, -0.8, 2, 3));
}

TEST(Drift, withFourthOrderTerm) {
    // k20 = 0 = H0: f = k40/R^4, dR/dt = 3 k40/R^5, so theory.md (7.13) holds: R^6 = R0^6 + 18 k40 t; else
    // the ODE theory.md (5.3).
    expect_radius({0, 0, 0.05, 0}, 0.8, 2, std::pow(std::pow(0.8, 6) + 18 * 0.05 * 2, 1.0 / 6));
    const Material m{0.1, -1.5, 0.04, 0};
    expect_radius(m, 1, 1, base_at(m, 1, 1, 1).R);
}

}  // namespace tubule::axisym::growth_test
