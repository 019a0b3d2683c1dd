// Linear theory of tubes and spheres (common/theory): against second derivatives of the energy by automatic
// differentiation, against the linearised equations of motion, and between models in their limits.
#include "common/theory/dispersion.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/SVD>
#include <array>
#include <cmath>
#include <random>

#include "common/geometry/profile_point.hpp"
#include "common/shapes/sphere.hpp"
#include "common/theory/waves.hpp"

namespace tubule::theory::dispersion_test {

using Complex = std::complex<double>;
using J = Jet<double, 1, 2>;

Bending bending(double k20, double H0 = 0, double k40 = 0, double k42 = 0) {
    return {.k = {k20, k40, k42}, .H0 = H0};
}
MotionLaw law_of(ModelKind kind, double Re = 1, std::optional<double> gamma = {}) {
    return motion_law({.kind = kind, .Re = Re, .gamma = gamma, .keeps_volume = {}});
}
const ModelKind all_models[] = {ModelKind::gradient_flow, ModelKind::overdamped, ModelKind::stokes, ModelKind::fluid};

UniformTube some_tube() {
    return {bending(0.3, -0.4, 0.02, 0.15), 0.8, 0.7};
}

// The density as a function of a Jet of (H, K).
J density_of(const Bending& energy, const J& H, const J& K) {
    const auto f = density(energy, H.v, K.v);
    return chain(H, K, f.f, f.H, f.K, f.HH, f.HK, f.KK);
}

// Density per theta and z of the surface r(theta, z), from its fundamental forms.
J tube_density(const Bending& energy, double tension, const J& r, const J& r_t, const J& r_z, const J& r_tt,
               const J& r_tz, const J& r_zz) {
    // In the frame (e_r, e_theta, e_z): X_theta = (r_t, r, 0), X_z = (r_z, 0, 1), normal X_theta x X_z = (r, -r_t, -r
    // r_z).
    const J E = r_t * r_t + r * r, F = r_t * r_z, G = r_z * r_z + 1.0, square = E * G - F * F;
    const J inverse_area = inverse_sqrt(square), inverse_square = inverse_area * inverse_area;
    const J L = (r_tt - r) * r - 2.0 * (r_t * r_t), M = r_tz * r - r_z * r_t, N = r_zz * r;
    const J H = (L * G - 2.0 * (M * F) + N * E) * (inverse_square * inverse_area);
    const J K = (L * N - M * M) * (inverse_square * inverse_square);
    return square * inverse_area * (density_of(energy, H, K) + tension);
}

TEST(Dispersion, stiffnessIsTheSecondVariationOfTheEnergy) {
    // Theorem, theory.md (5.13): along straight normals E'' = (G - b0/R) INT w^2, w = cos(q z)
    // cos(m theta), and E' = -b0 INT 1 dS for w = 1. Trapezoids integrate periodic functions exactly.
    std::mt19937 random(1);
    std::uniform_real_distribution<double> number(-1, 1);
    for (int trial = 0; trial < 12; ++trial) {
        UniformTube tube{bending(number(random), 2 * number(random), 0.1 * number(random), 0.3 * number(random)),
                         1 + 0.5 * number(random), trial % 3 == 0 ? 0 : number(random)};
        const int m = trial % 4;
        const double q = trial % 5 == 0 ? 0 : 1.5 + number(random), R = tube.radius;
        double second = 0, first = 0, square = 0;
        const int points = 24;
        for (int i = 0; i < points; ++i)
            for (int j = 0; j < points; ++j) {
                const double theta = 2 * pi * i / points, phase = 2 * pi * j / points;
                const double c = std::cos(phase), s = std::sin(phase), ct = std::cos(m * theta),
                             st = std::sin(m * theta);
                const J eps = J::variable(0, 0);
                J r = eps * (c * ct);
                r.v += R;
                second += tube_density(tube.energy, tube.tension, r, eps * (-m * c * st), eps * (-q * s * ct),
                                       eps * (-m * m * c * ct), eps * (m * q * s * st), eps * (-q * q * c * ct))
                              .dd[0];
                J wide = eps;
                wide.v += R;
                first += tube_density(tube.energy, tube.tension, wide, 0.0, 0.0, 0.0, 0.0, 0.0).d[0];
                square += R * c * c * ct * ct;
            }
        const double b0 = -first / (points * points * R);
        EXPECT_NEAR(b0, radius_rate(UniformTube{tube.energy, R, 0}) - tube.tension / R, 1e-12);
        EXPECT_NEAR(stiffness(tube, m)(q), second / square + b0 / R, 1e-9 * (1 + std::abs(second / square)))
            << "m " << m << " q " << q;
    }
}

TEST(Dispersion, theSameForSpheres) {
    // E'' = (G + b0 H) INT w^2, w = P_l, H = -2/R (as for tubes); E' = -b0 A.
    std::mt19937 random(2);
    std::uniform_real_distribution<double> number(-1, 1);
    for (int l = 0; l <= 5; ++l) {
        const UniformSphere sphere{bending(number(random), 2 * number(random), 0.1 * number(random), number(random)),
                                   1 + 0.4 * number(random), number(random)};
        const double R = sphere.radius;
        double second = 0, first = 0, square = 0;
        const int points = 100000;  // midpoints; the sums below converge as h^2, with a small factor
        for (int i = 0; i < points; ++i) {
            const double t = pi * (i + 0.5) / points, c = std::cos(t), s = std::sin(t);
            // P_l and its derivatives in t, from those in c.
            double p = 1, before = 0, d = 0, d_before = 0, dd = 0, dd_before = 0;
            for (int k = 0; k < l; ++k) {
                const double a = (2 * k + 1.0) / (k + 1), b = k / (k + 1.0);
                const double p1 = a * c * p - b * before, d1 = a * (p + c * d) - b * d_before,
                             dd1 = a * (2 * d + c * dd) - b * dd_before;
                before = p, d_before = d, dd_before = dd;
                p = p1, d = d1, dd = dd1;
            }
            const double w[3] = {p, -s * d, s * s * dd - c * d};
            const J eps = J::variable(0, 0);
            const auto density_at = [&](const double(&w)[3]) {
                J rho = eps * w[0];
                rho.v += R;
                const J d1 = eps * w[1], d2 = eps * w[2];
                // r = rho sin t, z = -rho cos t runs upwards.
                const J r = rho * s, r1 = d1 * s + rho * c, r2 = d2 * s + 2.0 * (d1 * c) - rho * s;
                const J z1 = rho * s - d1 * c, z2 = 2.0 * (d1 * s) + rho * c - d2 * c;
                const auto at = profile_point(r, r1, r2, z1, z2);
                return at.area * (density_of(sphere.energy, at.H, at.K) + sphere.tension);
            };
            second += density_at(w).dd[0] * pi / points;
            first += density_at({1, 0, 0}).d[0] * pi / points;
            square += 2 * pi * R * R * s * p * p * pi / points;
        }
        const double b0 = -first / (4 * pi * R * R);
        EXPECT_NEAR(b0, radius_rate(UniformSphere{sphere.energy, R, 0}) - 2 * sphere.tension / R, 1e-8);
        EXPECT_NEAR(stiffness(sphere, l), second / square + 2 * b0 / R, 1e-7 * (1 + std::abs(second / square)))
            << "l " << l;
    }
}

// The linearised equations theory.md (3.1), (3.2) for (w, u_z, u_theta, p, a) on a tube unrolled to y = R theta, all
// going with exp(i q z + i m theta + s t): K - s M. B = -1/R in the direction of theta, so that sigma_thth = d_y
// u_theta + w/R, and the viscous force has the normal part 2 mu B:sigma = -2 mu sigma_thth/R.
Eigen::Matrix<Complex, 5, 5> equations(const UniformTube& tube, const MotionLaw& law, double q, int m, Complex s) {
    const double R = tube.radius, mu = law.viscosity, gamma = law.friction;
    const Complex i(0, 1), z = i * q, y = i * (m / R), inertia = law.inertia * s + gamma;
    Eigen::Matrix<Complex, 5, 5> A = Eigen::Matrix<Complex, 5, 5>::Zero();
    // p0 Z a and omega_a a together are -G a, G with the tension.
    A.row(0) << -inertia - 2 * mu / (R * R), 0, -2 * mu / R * y, 1 / R, -stiffness(tube, m)(q);
    A.row(1) << 0, -inertia + 2 * mu * z * z + mu * y * y, mu * y * z, -z, 0;
    A.row(2) << 2 * mu / R * y, mu * y * z, -inertia + 2 * mu * y * y + mu * z * z, -y, 0;
    A.row(3) << 1 / R, z, y, 0, 0;
    A.row(4) << 1, 0, 0, 0, -s;
    return A;
}

TEST(Dispersion, ratesSolveTheLinearisedEquations) {
    // The matrix is singular at each rate, by its condition number, and not beside it.
    const UniformTube tube = some_tube();
    for (const ModelKind kind : {ModelKind::overdamped, ModelKind::stokes, ModelKind::fluid})
        for (const auto& [Re, gamma] : {std::pair{2.0, 0.3}, {20.0, 0.1}, {0.5, 0.0}})
            for (int m = 0; m <= 3; ++m)
                for (const double q : {0.0, 0.4, 1.3, 3.0}) {
                    if (gamma == 0 && (q == 0 || kind == ModelKind::overdamped)) continue;
                    if (q == 0 && m < 2) continue;
                    const MotionLaw law = law_of(kind, Re, gamma);
                    const Growth found = growth(tube, law, q, m);
                    EXPECT_EQ(found.roots.size(), kind != ModelKind::fluid ? 1u : m == 0 || q == 0 ? 2u : 3u);
                    const auto singular = [&](Complex s) {
                        const Eigen::MatrixXcd A = equations(tube, law, q, m, s);
                        const double inverse = A.partialPivLu().inverse().norm();  // not finite if a pivot is 0
                        return std::isfinite(inverse) ? 1 / (A.norm() * inverse) : 0;
                    };
                    for (const Complex& s : found.roots) {
                        EXPECT_LT(singular(s), 1e-3 * singular(s * 1.0001 + 1e-4)) << "m " << m << " q " << q;
                        EXPECT_LT(singular(s), 1e-13);
                        EXPECT_LE(s.real(), found.rate());
                    }
                }
}

TEST(Dispersion, modelsAgreeInTheirLimits) {
    UniformTube tube = some_tube();
    tube.tension = 3;  // some waves grow
    bool grows = false, decays = false;
    for (int m = 0; m <= 2; ++m)
        for (const double q : {0.5, 1.0, 2.0}) {
            // Much viscosity or friction: inertia does not matter, and a fluid is a Stokes flow, to the order Re^2.
            const double stokes = growth(tube, law_of(ModelKind::stokes, 1e-7, 0), q, m).rate(),
                         fluid = growth(tube, law_of(ModelKind::fluid, 1e-7, 0), q, m).rate();
            EXPECT_NEAR(fluid / stokes, 1, 1e-5) << m << " " << q;
            // Friction 1 alone: the overdamped model.
            const double overdamped = growth(tube, law_of(ModelKind::overdamped), q, m).rate();
            EXPECT_NEAR(growth(tube, law_of(ModelKind::stokes, 1e10, 1), q, m).rate() / overdamped, 1, 1e-8);
            EXPECT_NEAR(growth(tube, law_of(ModelKind::fluid, 1e12, 1e4), q, m).rate() * 1e4 / overdamped, 1, 1e-5);
            // A wave grows in every model or in none.
            (overdamped > 0 ? grows : decays) = true;
            for (const ModelKind kind : all_models)
                EXPECT_EQ(growth(tube, law_of(kind, 2, 0.3), q, m).rate() > 0, stiffness(tube, m)(q) < 0);
        }
    EXPECT_TRUE(grows);
    EXPECT_TRUE(decays);
    for (const ModelKind kind : all_models) {
        const Growth one = growth(tube, law_of(kind, 2, 0.3), 0.7, 1),
                     other = growth(tube, law_of(kind, 2, 0.3), 0.7, -1);
        for (std::size_t i = 0; i < one.roots.size(); ++i) EXPECT_EQ(one.roots[i], other.roots[i]);
    }
    // theory.md (5.11): m = 0, gamma = 0: omega = -Re R^2 G/4.
    EXPECT_NEAR(growth(tube, law_of(ModelKind::stokes, 2, 0), 0.7, 0).rate(),
                -2 * 0.8 * 0.8 / 4 * stiffness(tube, 0)(0.7), 1e-12);
    // A ring wave is not sheared: without friction nothing resists it.
    EXPECT_EQ(growth(tube, law_of(ModelKind::stokes, 2, 0), 0, 2).rate(), -std::numeric_limits<double>::infinity());
    EXPECT_EQ(growth(tube, law_of(ModelKind::fluid, 2, 0), 0, 1).rate(), 0);
    // theory.md (6.7): the sphere's fluid is its Stokes flow where that is slow, and one with friction 1 the
    // overdamped.
    const UniformSphere sphere{bending(0.3, -0.4, 0.02, 0.15), 1.2, 0.7};
    for (int l = 2; l <= 5; ++l) {
        const double stokes = growth(sphere, law_of(ModelKind::stokes, 1e-4, 0), l).rate();
        EXPECT_NEAR(growth(sphere, law_of(ModelKind::fluid, 1e-4, 0), l).rate() / stokes, 1, 1e-5);
        EXPECT_NEAR(growth(sphere, law_of(ModelKind::stokes, 1e12, 1), l).rate() /
                        growth(sphere, law_of(ModelKind::overdamped), l).rate(),
                    1, 1e-9);
    }
    EXPECT_NEAR(toroidal_rate(sphere, law_of(ModelKind::fluid, 2, 0.3), 1), -0.3, 1e-15);  // a rotation: friction alone
}

// ---- thresholds, for k40 = 0, in the reduced tension, c = H0 R, beta = k42/(k20 R^2): theory.md (5.20) and after

UniformTube tube_of(double Sigma, double c, double beta, double k20 = 0.4, double R = 1.3) {
    return {bending(k20, c / R, 0, beta * k20 * R * R), R, (Sigma - (c * c - 1) / 2) * 2 * k20 / (R * R)};
}
double tension_of(double Sigma, double c, double k20 = 0.4, double R = 1.3) {
    return (Sigma - (c * c - 1) / 2) * 2 * k20 / (R * R);
}

TEST(Thresholds, pearling) {
    for (const double c : {-2.6, -1.5, -1.0, -0.6, 0.0, 0.8})
        for (const double beta : {-0.4, 0.0, 0.3, 2.0})
            for (double Sigma = -2.05; Sigma < 1.9; Sigma += 0.1) {
                const UniformTube tube = tube_of(Sigma, c, beta);
                EXPECT_NEAR(reduced_tension(tube), Sigma, 1e-12);
                const bool long_waves = Sigma > 1,
                           finite = Sigma < 1 && Sigma + 2 * c < 0 &&
                                    beta < (Sigma + 2 * c) * (Sigma + 2 * c) / (4 * (1 - Sigma)) - 1;
                EXPECT_EQ(!growing_bands(tube, 0).empty(), long_waves || finite) << Sigma << " " << c << " " << beta;
                const auto stable = stable_tensions(tube, 0);
                EXPECT_EQ(stable && stable->lowest < tube.tension && tube.tension < stable->highest,
                          !long_waves && !finite)
                    << Sigma << " " << c << " " << beta;
                const auto least = least_f_KK(tube);
                ASSERT_EQ(least.has_value(), !long_waves);
                if (least) {
                    const double bound =
                        Sigma + 2 * c < 0 ? (Sigma + 2 * c) * (Sigma + 2 * c) / (4 * (1 - Sigma)) - 1 : -1;
                    EXPECT_NEAR(*least, 2 * bound * 0.4 * 1.3 * 1.3, 1e-11);
                }
            }
    // H0 = 0: sigma0 R^2/(2 k20) = 3/2, long waves (Sigma = sigma0 R^2/(2 k20) - 1/2 = 1).
    const auto stable = stable_tensions(tube_of(0, 0, 0), 0);
    ASSERT_TRUE(stable);
    EXPECT_NEAR(stable->highest * 1.3 * 1.3 / (2 * 0.4), 1.5, 1e-12);
    EXPECT_EQ(stable->q_highest, 0);
}

TEST(Thresholds, withTheGradientTerm) {
    // theory.md (5.28) by samples: no wave grows between the two tensions, some wave does at each side of them; and
    // none is given where every tension lets some wave grow.
    const auto grows = [](UniformTube tube, int m, double tension) {
        tube.tension = tension;
        const Stiffness G = stiffness(tube, m);
        for (double q = m == 0 ? 1e-3 : 0; q < 20; q += 1e-3)
            if (G(q) < -1e-9) return true;
        return false;
    };
    int windows = 0, none = 0;
    for (const double k20 : {-0.5, 0.3})
        for (const double k42 : {-0.4, 0.0, 0.2})
            for (const double kg : {0.02, 0.3})
                for (int m = 0; m <= 2; ++m) {
                    UniformTube tube{bending(k20, -1, 0.02, k42), 0.9, 0};
                    tube.energy.kg = kg;
                    const auto stable = stable_tensions(tube, m);
                    if (!stable) {
                        ++none;
                        for (double T = -30; T < 30; T += 0.25) EXPECT_TRUE(grows(tube, m, T)) << T << " " << m;
                        continue;
                    }
                    ++windows;
                    EXPECT_TRUE(grows(tube, m, stable->lowest - 1e-3)) << m << " " << k20 << " " << k42 << " " << kg;
                    EXPECT_FALSE(grows(tube, m, stable->lowest + 1e-4)) << m << " " << k20 << " " << k42 << " " << kg;
                    if (std::isfinite(stable->highest)) {
                        EXPECT_TRUE(grows(tube, m, stable->highest + 1e-3));
                    }
                }
    EXPECT_GT(windows, 10);
    EXPECT_GT(none, 1);
}

TEST(Thresholds, tubeAtItsPreferredRadius) {
    // H0 = -1/R: without k42 the wave q R = 1 is neutral; k42 > 0 lifts it, k42 < 0 lets it grow. The gradient flow is
    // sigma0 = 0, Sigma = 0.
    const UniformTube neutral = tube_of(0, -1, 0);
    EXPECT_NEAR(neutral.tension, 0, 1e-15);
    EXPECT_NEAR(stiffness(neutral, 0)(1 / neutral.radius), 0, 1e-15);
    EXPECT_GT(stiffness(tube_of(0, -1, 0.01), 0)(1 / neutral.radius), 0);
    EXPECT_TRUE(growing_bands(tube_of(0, -1, 0.01), 0).empty());
    // theory.md (5.27): omega = -(2 k20/R^4)[(1 + beta) x^2 - 2 x + 1], largest at x = 1/(1 + beta).
    const UniformTube grows = tube_of(0, -1, -0.2);
    ASSERT_EQ(growing_bands(grows, 0).size(), 1u);
    const auto fastest = fastest_wave(grows, law_of(ModelKind::gradient_flow), 0);
    ASSERT_TRUE(fastest);
    EXPECT_NEAR(fastest->q * 1.3, std::sqrt(1 / 0.8), 1e-7);
    EXPECT_NEAR(fastest->rate, 0.8 / std::pow(1.3, 4) * (1 / 0.8 - 1), 1e-14);
    // The stable window 0 <= Sigma <= 2 (sqrt(beta^2 + beta) - beta), of all m: a point without k42, empty below.
    for (const double beta : {0.05, 0.5, 3.0}) {
        const auto stable = common_stable_tensions(tube_of(0, -1, beta), 4);
        ASSERT_TRUE(stable);
        EXPECT_NEAR(stable->lowest, 0, 1e-13);
        EXPECT_NEAR(stable->highest, tension_of(2 * (std::sqrt(beta * beta + beta) - beta), -1), 1e-13);
        EXPECT_GT(stable->q_highest, 0);
    }
    EXPECT_FALSE(common_stable_tensions(tube_of(0, -1, -0.05), 4));
    const auto none = common_stable_tensions(tube_of(0, -1, 1e-12), 4);
    ASSERT_TRUE(none);
    EXPECT_NEAR(none->highest, none->lowest, 2e-6);
}

TEST(Thresholds, bucklingAndRings) {
    for (const double c : {-2.0, -1.0, 0.0, 0.7})
        for (const double beta : {-0.3, 0.0, 1.0}) {
            // Buckling: Sigma < -2 (1 + c). Ring: Sigma < -3, where no helix grows before it (c > -5/2).
            const UniformTube tube = tube_of(0.2, c, beta);
            EXPECT_NEAR(stable_tensions(tube, 1)->lowest, tension_of(-2 * (1 + c), c), 1e-13);
            EXPECT_NEAR(stable_tensions(tube, 2)->lowest, tension_of(-3, c), 1e-13);
            for (int m = 1; m <= 3; ++m)
                for (const double by : {-1e-6, 1e-6}) {
                    UniformTube near = tube;
                    near.tension = stable_tensions(tube, m)->lowest + by;
                    EXPECT_EQ(growing_bands(near, m).empty(), by > 0) << m << " " << c << " " << beta;
                }
        }
    // For c < -5/2 a wave of q > 0 comes before the ring. By theory.md (5.24), with k42 = 0 and y = q^2 R^2 + 3, it
    // grows below Sigma = -y - 2 (1 + c) + 6 (1 + c)/y, which is largest at y^2 = -6 (1 + c), here 12.
    const auto wavy = stable_tensions(tube_of(0, -3, 0), 2);
    EXPECT_NEAR(wavy->lowest, tension_of(4 - 4 * std::sqrt(3.0), -3), 1e-12);
    EXPECT_NEAR(wavy->q_lowest * 1.3, std::sqrt(std::sqrt(12.0) - 3), 1e-7);
    // The same with k42: growing bands begin there.
    const UniformTube tube = tube_of(0, -4, 0.1);
    const auto stable = stable_tensions(tube, 2);
    EXPECT_GT(stable->lowest, tension_of(-3, -4) + 0.1);
    EXPECT_GT(stable->q_lowest, 0.1);
    for (const double by : {-1e-6, 1e-6}) {
        UniformTube near = tube;
        near.tension = stable->lowest + by;
        EXPECT_EQ(growing_bands(near, 2).empty(), by > 0);
    }
}

TEST(Thresholds, illPosed) {
    // kappa <= -1 along the axis; around it k20 + 6 k40 h^2 <= 0.
    EXPECT_FALSE(ill_posed_along(tube_of(0, -0.5, -0.999)));
    EXPECT_TRUE(ill_posed_along(tube_of(0, -0.5, -1.001)));
    EXPECT_FALSE(stable_tensions(tube_of(0, -0.5, -1.001), 0));
    EXPECT_EQ(growing_bands(tube_of(0, -0.5, -1.001), 0).back().to, std::numeric_limits<double>::infinity());
    EXPECT_FALSE(fastest_wave(tube_of(0, -0.5, -1.001), law_of(ModelKind::gradient_flow), 0));
    // Buckling in Stokes flow without friction: nothing resists long waves, and rates grow like 1/q^2.
    UniformTube buckles{bending(1), 1, -6};
    EXPECT_FALSE(fastest_wave(buckles, law_of(ModelKind::stokes, 1, 0), 1));
    EXPECT_TRUE(fastest_wave(buckles, law_of(ModelKind::stokes, 1, 1), 1));
    EXPECT_FALSE(ill_posed_around({bending(0.6, 0, -0.0999), 1}));
    EXPECT_TRUE(ill_posed_around({bending(0.6, 0, -0.1001), 1}));
}

TEST(Thresholds, theFastestWaveIsTheFastest) {
    // No wave of a fine grid is faster, and the rate there is stationary in q or at the end of the band.
    UniformTube tube = some_tube();
    for (const double tension : {-3.0, 4.0}) {
        tube.tension = tension;
        for (int m = 0; m <= 2; ++m)
            for (const ModelKind kind : all_models) {
                const MotionLaw law = law_of(kind, 2, 0.3);
                const auto fastest = fastest_wave(tube, law, m);
                ASSERT_EQ(fastest.has_value(), !growing_bands(tube, m).empty());
                if (!fastest) continue;
                for (double q = 0; q < 6; q += 0.01) {
                    EXPECT_LE(growth(tube, law, q, m).rate(), fastest->rate + 1e-13) << q;
                }
                EXPECT_EQ(growth(tube, law, fastest->q, m).rate(), fastest->rate);
            }
        // The best of all that fit.
        const MotionLaw law = law_of(ModelKind::fluid, 2, 0.3);
        theory::FittingWave best;
        for (int m = 0; m <= 2; ++m)
            for (int n = m < 2 ? 1 : 0; n < 10; ++n) {
                const double q = 2 * pi * n / 17, rate = growth(tube, law, q, m).rate();
                if (rate > best.rate) best = {n, m, q, rate};
            }
        const auto found = fastest_fitting_wave(tube, law, 17, 2);
        ASSERT_TRUE(found);
        EXPECT_EQ(found->n, best.n);
        EXPECT_EQ(found->m, best.m);
        EXPECT_EQ(found->rate, best.rate);
        EXPECT_FALSE(fastest_fitting_wave(tube, law, 0.5, 1));
    }
}

// ---- in time

// F = 2 pi R L (f + tension) - pressure pi R^2 L - force L is stationary in R and L: theory.md (3.21), (3.22).
TEST(Ensembles, tubesAndSpheresRestWhereFIsStationary) {
    const UniformTube tube = some_tube();
    const double R = tube.radius, L = 3, h = 1e-4, P = pressure_at_rest(tube), N = axial_force(tube, P);
    const auto F = [&](double r) {
        const double f = density(tube.energy, -1 / r, 0.0).f;
        return 2 * pi * r * L * (f + tube.tension) - P * pi * r * r * L - N * L;
    };
    EXPECT_NEAR((F(R + h) - F(R - h)) / (2 * h), 0, 1e-6);
    EXPECT_NEAR(F(R), 0, 1e-12);  // it is linear in L
    MotionLaw pulled = law_of(ModelKind::stokes);
    pulled.free_period = true, pulled.force = N;
    EXPECT_NEAR(*theory::tension_of(pulled, tube.energy, R), tube.tension, 1e-12);
    pulled.keeps_volume = false, pulled.pressure = P;
    EXPECT_NEAR(*theory::tension_of(pulled, tube.energy, R), tube.tension, 1e-12);

    const UniformSphere sphere{tube.energy, R, tube.tension};
    const double p = pressure_at_rest(sphere);
    const auto of_sphere = [&](double r) {
        return 4 * pi * r * r * (density(sphere.energy, -2 / r, 1 / (r * r)).f + sphere.tension) -
               p * 4 * pi / 3 * r * r * r;
    };
    EXPECT_NEAR((of_sphere(R + h) - of_sphere(R - h)) / (2 * h), 0, 1e-6);
}

TEST(Ensembles, tellTheTensionAndWhereARadiusGoes) {
    const UniformTube tube = some_tube();
    MotionLaw law = law_of(ModelKind::gradient_flow);
    law.tension = 0.7;
    EXPECT_EQ(theory::tension_of(law, tube.energy, tube.radius), 0.7);
    law.keeps_area = true, law.tension = 0, law.pressure = 0.2;
    EXPECT_NEAR(*theory::tension_of(law, tube.energy, tube.radius),
                tension_of_free_volume(tube.energy, 0.8) + 0.8 * 0.2, 1e-14);
    EXPECT_FALSE(theory::tension_of(law_of(ModelKind::fluid), tube.energy, tube.radius));
    // pressure R^3 - tension R^2 + k20 = 0, by bisection elsewhere; the same for whatever resists.
    for (const ModelKind kind : {ModelKind::gradient_flow, ModelKind::stokes}) {
        MotionLaw swelling = law_of(kind);
        swelling.reservoir = swelling.inextensible, swelling.keeps_volume = false, swelling.pressure = 0.3;
        for (const double start : {0.9, 1.5})
            EXPECT_NEAR(radius_at_rest(swelling, {bending(1), start, 1}).value_or(0), 1.2714840414931645, 1e-12);
        swelling.pressure = 0.5;  // more than any radius can hold
        EXPECT_FALSE(radius_at_rest(swelling, {bending(1), 1, 1}));
    }
    EXPECT_EQ(radius_rate_of(law_of(ModelKind::fluid), tube), 0);
}

TEST(Waves, aDriftingTube) {
    // theory.md (7.12): R^4 = R0^4 + 4 k20 t for H0 = 0. The amplitude: omega = -(k20/R^4)[2 (x - 1)^2 - (x - 1) + 4
    // x], x = q^2 R^2, by Simpson's rule over the exact R(t).
    const UniformTube tube{bending(0.2), 1};
    const double length = 7, end = 2, q = 2 * pi / length;
    const auto radius = [](double t) { return std::pow(1 + 0.8 * t, 0.25); };
    const auto rate = [&](double t) {
        const double x = q * q * radius(t) * radius(t);
        return -0.2 / std::pow(radius(t), 4) * (2 * (x - 1) * (x - 1) - (x - 1) + 4 * x);
    };
    double integral = 0;
    const int n = 2000;
    for (int i = 0; i <= n; ++i)
        integral += (i == 0 || i == n ? 1 : i % 2 == 1 ? 4 : 2) * rate(end * i / n) * end / n / 3;
    const auto states = waves_in_time(tube, law_of(ModelKind::gradient_flow), length, {{1, 0, 1e-3}}, {0, 1, end});
    ASSERT_EQ(states.size(), 3u);
    EXPECT_EQ(states[0].amplitudes[0], 1e-3);
    EXPECT_NEAR(states[0].rates[0], 1e-3 * rate(0), 1e-15);
    EXPECT_NEAR(states[2].radius, radius(end), 1e-10);
    EXPECT_NEAR(states[2].amplitudes[0] / 1e-3 / std::exp(integral), 1, 1e-9);
    // At a radius that is kept: the exponential.
    MotionLaw fixed = law_of(ModelKind::gradient_flow);
    fixed.keeps_volume = true;
    EXPECT_NEAR(waves_in_time(tube, fixed, length, {{1, 2, 1e-3}}, {end})[0].amplitudes[0],
                1e-3 * std::exp(end * growth(tube, fixed, q, 2).rate()), 1e-13);
}

TEST(Waves, meetTheReferenceRunsOnceSmall) {
    // Independent nonlinear runs of the figure (k20 = 0.2, H0 = -2, L = 2) from t = 0.2, where waves are small, to 0.5:
    // r_min, r_max and mode 1 there. What is left out goes with (a/R)^2: 4e-6 and 2e-8, times some dozen. The
    // reference's modes end in noise of 5e-14 (it has that at t = 1.4, where the wave is gone).
    struct Run {
        double k42, r_min, r_max, mode, r_min_end, r_max_end, mode_end;
    };
    for (const Run& run : {Run{0, 0.8723241046390244, 0.8757917975851919, 0.0017338484568305064, 0.6945517096341042,
                               0.6945545585803669, 1.4244731301314578e-06},
                           Run{0.06, 0.8838568455555245, 0.8840842908078685, 0.00011372262691308577, 0.7035518268561033,
                               0.7035518274564397, 3.001695680452704e-10}}) {
        const UniformTube tube{bending(0.2, -2, 0, run.k42), (run.r_min + run.r_max) / 2};
        const auto end = waves_in_time(tube, law_of(ModelKind::gradient_flow), 2, {{1, 0, run.mode}}, {0.3})[0];
        const double squares = run.mode * run.mode;
        EXPECT_NEAR(end.radius, (run.r_min_end + run.r_max_end) / 2, squares + 1e-9);
        EXPECT_NEAR(end.amplitudes[0] / run.mode_end, 1, 60 * squares + 1e-13 / run.mode_end);
    }
}

TEST(Waves, areConservedTogether) {
    // theory.md (5.14), (5.15): SUM Z a^2 stays, so a single wave is frozen; its tension is -G/Z.
    const UniformTube tube{bending(1, 0, 0, 0.1), 1};
    const double length = 6;
    for (const ModelKind kind : {ModelKind::overdamped, ModelKind::stokes, ModelKind::fluid}) {
        const MotionLaw law = law_of(kind, 2, 0.3);
        const std::vector<Wave> waves{{1, 0, 1e-3}, {2, 0, 5e-4}, {1, 1, 2e-4}, {0, 2, 3e-4}};
        const auto states = waves_in_time(tube, law, length, waves, {0, 0.2, 1});
        const auto sum = [&](const WaveState& state) {
            double total = 0;
            for (std::size_t k = 0; k < waves.size(); ++k)
                total += (std::pow(2 * pi * waves[k].n / length, 2) + waves[k].m * waves[k].m - 1) *
                         state.amplitudes[k] * state.amplitudes[k];
            return total;
        };
        EXPECT_NEAR(sum(states[2]) / sum(states[0]), 1, 1e-9);
        EXPECT_GT(std::abs(states[2].amplitudes[0] - states[0].amplitudes[0]), 1e-5);
        EXPECT_NE(states[2].tension, states[0].tension);
        const auto frozen = waves_in_time(tube, law, length, {{2, 0, 5e-4}}, {1})[0];
        EXPECT_NEAR(frozen.amplitudes[0], 5e-4, 1e-14);
        const double Z = std::pow(4 * pi / length, 2) - 1;
        EXPECT_NEAR(frozen.tension, -stiffness(tube, 0)(4 * pi / length) / Z, 1e-9);
        EXPECT_NEAR(frozen.tension, tension_of_waves(tube, law, length, {{2, 0, 5e-4}}), 1e-11);
        // Its rate is none: what rounding leaves of it is no growth.
        UniformTube held = tube;
        held.tension = tension_of_waves(tube, law, length, {{2, 0, 5e-4}});
        EXPECT_EQ(growth(held, law, 4 * pi / length, 0).rate(), 0);
        held.tension *= 1 + 1e-9;
        EXPECT_NE(growth(held, law, 4 * pi / length, 0).rate(), 0);
    }
}

TEST(Waves, ofAFluidFollowTheCubic) {
    // With the volume free the tension is constant, and a(t) is a sum of exponentials of the roots: that which has a,
    // a' = 0 and a'' = -M G a at the start, as the swirl is at rest.
    const UniformTube tube{bending(1, -0.3, 0, 0.1), 1.1};
    MotionLaw law = law_of(ModelKind::fluid, 2, 0.3);
    law.keeps_volume = false;
    const double length = 6, t = 1.5;
    UniformTube held = tube;
    held.tension = tension_of_free_volume(tube.energy, tube.radius);
    EXPECT_NEAR(reduced_tension(held), 0, 1e-14);
    for (const auto& [n, m] : {std::pair{1, 0}, {1, 1}, {2, 3}, {0, 2}}) {
        const double q = 2 * pi * n / length;
        const Growth exact = growth(held, law, q, m);
        const Eigen::Index roots = static_cast<Eigen::Index>(exact.roots.size());
        Eigen::MatrixXcd A(roots, roots);
        for (Eigen::Index i = 0; i < roots; ++i)
            for (Eigen::Index j = 0; j < roots; ++j) A(i, j) = std::pow(exact.roots[j], static_cast<int>(i));
        Eigen::VectorXcd start = Eigen::VectorXcd::Zero(roots);
        start[0] = 1;
        if (roots == 3) start[2] = -mobility(held, law, q, m) * stiffness(held, m)(q);
        const Eigen::VectorXcd parts = A.partialPivLu().solve(start);
        Complex expected = 0;
        for (Eigen::Index i = 0; i < roots; ++i) expected += parts[i] * std::exp(exact.roots[i] * t);
        const auto state = waves_in_time(tube, law, length, {{n, m, 1e-3}}, {t})[0];
        EXPECT_NEAR(state.amplitudes[0] / 1e-3, expected.real(), 1e-9) << n << " " << m;
        EXPECT_EQ(state.tension, held.tension);
    }
}

TEST(Waves, meaninglessOnesAreRefused) {
    const UniformTube tube{bending(1), 1};
    const MotionLaw fluid = law_of(ModelKind::fluid, 1, 0);
    EXPECT_THROW(waves_in_time(tube, fluid, 6, {{0, 0, 1e-3}}, {1}), std::invalid_argument);
    EXPECT_THROW(waves_in_time(tube, fluid, 6, {{1, 0, 1e-3}, {1, 0, 1e-4}}, {1}), std::invalid_argument);
    EXPECT_THROW(waves_in_time(tube, fluid, 6, {{1, 0, 0}}, {1}), std::invalid_argument);
    EXPECT_THROW(waves_in_time(tube, law_of(ModelKind::stokes), 6, {{0, 2, 1e-3}}, {1}), std::invalid_argument);
    EXPECT_THROW(waves_in_time(tube, fluid, 6, {{1, 0, 1e-3}}, {1, 0.5}), std::invalid_argument);
}

}  // namespace tubule::theory::dispersion_test
