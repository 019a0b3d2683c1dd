// Area-difference elasticity, alpha/2 (M - M0)^2 with M = INT H dS: derivatives, equilibria, their second variation,
// closed forms of linear theory, and runs.
#include <gtest/gtest.h>

#include <cmath>

#include "axisym/curve/curve_measures.hpp"
#include "axisym/curve/vesicle_families.hpp"
#include "axisym/equilibrium/continuation.hpp"
#include "axisym/equilibrium/mode_stability.hpp"
#include "axisym/equilibrium/spectrum.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/solve/dense.hpp"
#include "common/solve/derivative_check.hpp"
#include "common/theory/waves.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/support/random_vector.hpp"

namespace tubule::axisym::area_difference_test {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

Bending with_alpha(Bending energy, double alpha, double M0) {
    energy.alpha = alpha, energy.M0 = M0;
    return energy;
}

const MotionLaw gradient_flow{.friction = 1, .inextensible = false, .keeps_volume = false};

TEST(AreaDifference, MOfExactShapes) {
    // Exact: -8 pi R of a sphere, -2 pi L of a tube, and of a prolate spheroid with half axes a, a, c, from its mean
    // width, -4 pi (c + a^2 arcosh(c/a)/sqrt(c^2 - a^2)).
    const double a = 0.8, c = 1.7, spheroid = -4 * pi * (c + a * a * std::acosh(c / a) / std::sqrt(c * c - a * a));
    const Bending energy = with_alpha(bending(0.5), 0.3, -20);
    for (const auto& [curve, M] : {std::pair{meridian(Sphere{1.3, {}}), -8 * pi * 1.3},
                                   {meridian(Tube{0.7, 3, {}}), -2 * pi * 3},
                                   {meridian(Ellipsoid{a, a, c}), spheroid}})
        for (const bool halved : {false, true}) {
            const Curve shape = halved ? half(curve) : curve;
            const CurveSpace space(shape.topology, equal_breaks(40), 7, 6, shape.length);
            const CurveForms forms(space, energy);
            const Vector x = fit(space, shape);
            const CurveObservation o = forms.observe(x);
            EXPECT_NEAR(o.M, M, 1e-8);
            EXPECT_NEAR(forms.M(x.data()), M, 1e-8);
            EXPECT_NEAR(o.energy_alpha, 0.15 * (M + 20) * (M + 20), 1e-6);
            EXPECT_NEAR(o.energy, o.energy_alpha + o.energy_term[0], 1e-12 * o.energy);
        }
}

TEST(AreaDifference, hasTheDerivativesOfTheWhole) {
    // Theorem: Taylor remainders of E, with the rank-one part of the Hessian, too.
    const Bending energy = with_alpha(bending(0.2, -2, 0.03, 0.06), 0.7, -15);
    for (const bool free_period : {false, true})
        for (const Topology topology : {Topology::cell, Topology::half_cell, Topology::tube, Topology::half_tube}) {
            const bool tube = topology == Topology::tube || topology == Topology::half_tube;
            if (free_period && topology != Topology::half_tube) continue;
            const CurveSpace space(topology, equal_breaks(7), 5, 4, tube ? 2.5 : 0, free_period);
            const CurveForms forms(space, energy);
            const Curve whole = tube ? meridian(Tube{1, 2.5, {{0.2, 1}}}) : meridian(Ellipsoid{1, 1, 1.5});
            const Vector x = fit(space, space.images() == 2 ? half(whole) : whole) +
                             test::random_vector(space.size(), free_period ? 0.002 : 0.02);
            const auto weights = [&](const Vector& y) {
                return Weights{.energy = 1, .M = area_difference_force(energy, forms.M(y.data()))};
            };
            const auto check =
                check_derivatives([&](const Vector& y) { return forms.observe(y).energy; },
                                  [&](const Vector& y) { return forms.gradient(weights(y), y); },
                                  [&](const Vector& y, const Vector& w) -> Vector {
                                      const Vector M = forms.gradient({.M = 1}, y);
                                      return forms.hessian(weights(y), y) * w + *energy.alpha * M.dot(w) * M;
                                  },
                                  x);
            EXPECT_TRUE(check.pass()) << static_cast<int>(topology) << "\n" << check.text();
        }
}

struct Found {
    StationaryProblem problem;
    Equilibrium shape;
};
// k20 = 1/2, H0 = -0.3, area 4 pi, reduced volume v.
Found vesicle(double v, double alpha, double M0, const Curve& start, double accuracy) {
    EquilibriumSettings settings;
    settings.accuracy = accuracy;
    const Bending energy = with_alpha(bending(0.5, -0.3), alpha, M0);
    Found out{{energy, {4 * pi, v * 4 * pi / 3, {}}}, {}};
    out.shape = find_equilibrium(out.problem, start, settings);
    return out;
}

TEST(AreaDifference, equilibriaAreThoseOfAnEffectiveSpontaneousCurvature) {
    // Theorem: k20 (H - H0)^2 + mu H = k20 (H - H0_eff)^2 + a constant, with H0_eff = H0 - mu/(2 k20), mu = alpha (M -
    // M0). The constant is a tension. On the same mesh both are the same shape to 1e-10, on others to their errors.
    for (const bool prolate : {true, false})
        for (const double alpha : {0.5, 4.0}) {
            const double M0 = prolate ? -30 : -27;
            const Found found = vesicle(0.8, alpha, M0, spheroid(0.8, prolate), 1e-11);
            const Equilibrium& e = found.shape;
            ASSERT_EQ(e.stop, Stop::finished) << e.message;
            const double mu = alpha * (e.observed.M - M0), H0 = -0.3 - mu, constant = 0.5 * (0.09 - H0 * H0);
            EXPECT_GT(std::abs(mu), 0.1);
            EXPECT_NEAR(e.mu, mu, 1e-9 * std::abs(mu));
            Found other{found.problem, e};
            other.problem.bending = bending(0.5, H0);
            other.shape.sigma += constant, other.shape.mu = 0;
            const StationarySystem system(e.space, other.problem, e.gauge);
            const Vector u = unknowns(other.problem, other.shape),
                         step = solve_dense(Matrix(system.jacobian(u)), system.residual(u));
            EXPECT_LT(step.head(e.x.size()).lpNorm<Eigen::Infinity>(), 1e-10);
            EquilibriumSettings settings;
            settings.accuracy = 1e-11, settings.descend = false;
            const Equilibrium effective = find_equilibrium(other.problem, other.shape, settings);
            ASSERT_EQ(effective.stop, Stop::finished) << effective.message;
            EXPECT_LT(hausdorff_distance(meridian(*effective.space, effective.x), meridian(*e.space, e.x)), 1e-6);
            EXPECT_NEAR(effective.observed.energy + constant * 4 * pi,
                        e.observed.energy - e.observed.energy_alpha + mu * e.observed.M, 1e-9 * e.reference_energy);
        }
}

TEST(AreaDifference, aLargeAlphaHoldsM) {
    // Definition of the bilayer couple: M -> M0, and alpha (M - M0) tends to the multiplier of M.
    double mu[2];
    for (const int i : {0, 1}) {
        const double alpha = i == 0 ? 1e3 : 1e5;
        const Found found = vesicle(0.8, alpha, -29.5, spheroid(0.8, true), 1e-9);
        ASSERT_EQ(found.shape.stop, Stop::finished) << found.shape.message;
        mu[i] = found.shape.mu;
        EXPECT_NEAR(found.shape.observed.M, -29.5, 10 / alpha);
    }
    EXPECT_NEAR(mu[0] / mu[1], 1, 1e-2);
}

TEST(AreaDifference, prolatesBecomePears) {
    // Independent computation: the shape equations and their odd linearisation as a boundary value problem
    // (tests/studies/command/budding_study.py): at reduced volume 0.8 H0_eff = -3.8547804 and M = -28.3310198, from
    // which M0 = M + H0_eff/alpha.
    StationaryProblem problem{with_alpha(bending(0.5), 2, -29.5), {4 * pi, 0.8 * 4 * pi / 3, {}}};
    const Equilibrium start = find_equilibrium(problem, spheroid(0.8, true), {.accuracy = 1e-9});
    ASSERT_EQ(start.stop, Stop::finished) << start.message;
    BranchSettings settings;
    settings.from = -29.5, settings.to = -30.8, settings.shapes.accuracy = 1e-9;
    const Branch branch = follow_branch(
        problem, start, [](StationaryProblem& p, double M0) { p.bending.M0 = M0; }, settings);
    ASSERT_EQ(branch.points.size(), 1u) << branch.message;
    EXPECT_EQ(branch.points[0].kind, PointKind::bifurcation);
    EXPECT_EQ(branch.points[0].index, 0);
    EXPECT_NEAR(branch.points[0].parameter, -30.2584100, 1e-5);
    EXPECT_NEAR(branch.points[0].shape.observed.M, -28.3310198, 1e-6);
}

TEST(AreaDifference, theSecondVariationIsTheDerivativeOfTheGradient) {
    // Definition, by central differences of the residual with the mu of each curve, on what the constraints leave.
    const double alpha = 0.8, M0 = -26.5;
    const auto space = std::make_shared<CurveSpace>(Topology::cell, equal_breaks(8), 5, 4);
    const StationaryProblem problem{with_alpha(bending(0.5, -0.3), alpha, M0), {4 * pi, 0.9 * 4 * pi / 3, {}}};
    const StationarySystem system(space, problem, 0.3);
    const int n = space->size();
    Vector u = Vector::Zero(system.unknowns());
    u.head(n) = fit(*space, spheroid(0.9, true)) + test::random_vector(n, 0.01);
    u[system.sigma()] = -0.7, u[system.lambda()] = 1.3;
    const auto gradient = [&](const Vector& x) {
        Vector at = u;
        at.head(n) = x;
        system.set_followers(at);
        return Vector(system.residual(at).head(n));
    };
    Matrix hessian(n, n);
    const double h = 1e-5;
    for (int i = 0; i < n; ++i)
        hessian.col(i) =
            (gradient(u.head(n) + h * Vector::Unit(n, i)) - gradient(u.head(n) - h * Vector::Unit(n, i))) / (2 * h);
    Matrix fixed(n, 3);
    const Vector x = u.head(n);
    Vector place = Vector::Zero(n);
    place.tail(space->z().size()) = space->z().mean();
    fixed << system.forms().gradient({.area = 1}, x), system.forms().gradient({.volume = 1}, x), place;
    const Matrix free = orthogonal_complement(fixed, 1e-12);
    const Matrix reduced = free.transpose() * hessian * free;
    const Vector expected = eigenpairs((reduced + reduced.transpose()) / 2, false).values;
    Vector settled = u;
    system.set_followers(settled);
    const Vector found = system.variation(settled).eigenvalues;
    ASSERT_EQ(found.size(), expected.size());
    EXPECT_LT((found - expected).lpNorm<Eigen::Infinity>(), 1e-6 * expected.lpNorm<Eigen::Infinity>());
    // The rank-one part matters here: without it the smallest ones differ.
    const Vector M = free.transpose() * system.forms().gradient({.M = 1}, x);
    EXPECT_GT(alpha * M.squaredNorm(), 1e-2 * expected.cwiseAbs().minCoeff());
}

// E + sigma A - pressure V of a sphere.
double free_energy_of_sphere(const Bending& b, double R, double sigma, double pressure) {
    const double h = -2 / R - b.H0, A = 4 * pi * R * R, M = -8 * pi * R;
    return (b.k[0] * h * h + b.k[2] / std::pow(R, 4) + sigma) * A + *b.alpha / 2 * (M - b.M0) * (M - b.M0) -
           pressure * 4 * pi / 3 * R * R * R;
}

TEST(AreaDifference, spheres) {
    // Exact: A R_t = -dF/dR of the sphere's F, so that l = 0 grows at -F''/A where F' = 0; l >= 2 by the density f + mu
    // H in theory.md (6.3), which is f of another H0 and tension. In closed form and numerically.
    const Bending energy = with_alpha(bending(0.5, -0.4, 0, 0.1), 0.3, -22);
    const double R = 1.2, sigma = 0.7, A = 4 * pi * R * R, h = 1e-4;
    const auto F = [&](double radius, double load) { return free_energy_of_sphere(energy, radius, sigma, load); };
    const double slope = (F(R + h, 0) - F(R - h, 0)) / (2 * h), pressure = slope / A;
    const theory::UniformSphere sphere{energy, R, sigma};
    EXPECT_NEAR(theory::pressure_at_rest(sphere), pressure, 1e-6);
    const double expected = -(F(R + h, pressure) - 2 * F(R, pressure) + F(R - h, pressure)) / (h * h * A);
    const double mu = 0.3 * (-8 * pi * R + 22), other_H0 = -0.4 - mu,
                 constant = 0.5 * (0.4 * 0.4 - other_H0 * other_H0);
    const theory::UniformSphere other{bending(0.5, other_H0, 0, 0.1), R, sigma + constant};
    Equilibrium e;
    e.space = std::make_shared<CurveSpace>(Topology::cell, equal_breaks(24), 5, 4);
    e.x = fit(*e.space, meridian(Sphere{R, {}}));
    e.sigma = sigma, e.lambda = -pressure;
    e.observed = CurveForms(*e.space, energy).observe(e.x);
    const ModeStability stability({energy, {}}, e);
    // The flow is linearised at the fixed loads: theory::growth of l = 0 has the radius move as the sphere's flow does,
    // with its pressure.
    const std::vector<double> m0 = stability.rates(0, gradient_flow, 3).rates;
    const double l2 = theory::growth(other, gradient_flow, 2).rate(),
                 l3 = theory::growth(other, gradient_flow, 3).rate();
    EXPECT_NEAR(theory::growth(sphere, gradient_flow, 2).rate(), l2, 1e-12 * std::abs(l2));
    EXPECT_NEAR(theory::growth(sphere, gradient_flow, 3).rate(), l3, 1e-12 * std::abs(l3));
    std::vector<double> all{expected, l2, l3};
    std::ranges::sort(all, std::greater<>());
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(m0[i], all[i], 1e-5 * std::abs(all[i])) << i;
    EXPECT_NEAR(stability.rates(1, gradient_flow, 1).rates[0], l2, 1e-6 * std::abs(l2));
    EXPECT_NEAR(stability.rates(2, gradient_flow, 1).rates[0], l2, 1e-6 * std::abs(l2));
}

TEST(AreaDifference, spheresFollowTheEquationOfTheirRadius) {
    // Exact: A R_t = -dF/dR, by the classical Runge-Kutta method. And of an early small change, theory.md (6.3) for l =
    // 0.
    const Bending energy = with_alpha(bending(0.5, -0.4, 0, 0.1), 0.05, -18);
    const auto rate = [&](double R) {
        const double h = 1e-5;
        return -(free_energy_of_sphere(energy, R + h, 0, 0) - free_energy_of_sphere(energy, R - h, 0, 0)) /
               (2 * h * 4 * pi * R * R);
    };
    const theory::UniformSphere sphere{energy, 1.1, 0};
    EXPECT_NEAR(theory::radius_rate(sphere), rate(1.1), 1e-7);
    EXPECT_NEAR(theory::growth(sphere, gradient_flow, 0).rate(), (rate(1.101) - rate(1.099)) / 0.002, 1e-5);
    double R = 1.1;
    const double end = 0.1, step = end / 1000;
    for (int i = 0; i < 1000; ++i) {
        const double a = rate(R), b = rate(R + step / 2 * a), c = rate(R + step / 2 * b), d = rate(R + step * c);
        R += step / 6 * (a + 2 * b + 2 * c + d);
    }
    EXPECT_GT(std::abs(R - 1.1), 0.01);
    Case c;
    c.energy = energy, c.shape = Sphere{1.1, {}};
    c.time.end = end, c.accuracy.energy = 1e-8;
    const Outcome o = run_case(c);
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    EXPECT_NEAR(o.last("r_max"), R, 1e-7);
    EXPECT_NEAR(o.last("M"), -8 * pi * R, 1e-5);
    EXPECT_NEAR(o.last("energy"), free_energy_of_sphere(energy, R, 0, 0), 1e-7 * o.last("energy"));
}

TEST(AreaDifference, wavesOfTubesFollowTheDispersionRelation) {
    // theory.md (5.6) with the density f + mu H, mu = alpha (-2 pi L - M0): that of common/theory, and, as k20 (H -
    // H0)^2 + mu H is the density of another H0 and a tension, that without alpha. The same of the numerical spectrum.
    const double length = 7, alpha = 0.02, M0 = -30, mu = alpha * (-2 * pi * length - M0), H0 = -1;
    const Bending energy = with_alpha(bending(0.2, H0, 0, 0.03), alpha, M0);
    const double other_H0 = H0 - mu / 0.4, tension = 0.2 * (H0 * H0 - other_H0 * other_H0);
    const theory::UniformTube other{bending(0.2, other_H0, 0, 0.03), 1, tension};
    Case c = tube_case(energy, 1, length, {{1e-5, 1}}, 0.5);
    explicitly(c, 24, 1e-13, 7);
    const auto start = theory::tube_start(c);
    ASSERT_TRUE(start);
    for (const int m : {0, 1, 2})
        for (const double q : {0.0, 0.5, 1.3})
            EXPECT_NEAR(theory::stiffness(start->tube, m)(q), theory::stiffness(other, m)(q), 1e-13);
    const Outcome o = run_case(c);
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    const double expected = *theory::mean_rate(c, 1, 0, 0, 0.5),
                 plain = -theory::stiffness(theory::UniformTube{bending(0.2, H0, 0, 0.03), 1, 0}, 0)(2 * pi / length);
    EXPECT_NEAR(std::log(o.last("mode_1") / 1e-5) / 0.5, expected, 1e-6 * std::abs(expected));
    EXPECT_GT(std::abs(expected - plain), 0.1 * std::abs(plain));
    // And in the other models, with membrane from a reservoir.
    for (const ModelKind kind : {ModelKind::overdamped, ModelKind::stokes}) {
        Case fed = c;
        fed.model = {
            .kind = kind, .Re = 2, .gamma = 0.5, .keeps_volume = true, .area = AreaRule::reservoir, .tension = 0.3};
        const Outcome run = run_case(fed);
        ASSERT_EQ(run.summary.stop.reason, Stop::finished) << run.summary.stop.message;
        const double rate = *theory::mean_rate(fed, 1, 0, 0, 0.5);
        EXPECT_NEAR(std::log(run.last("mode_1") / 1e-5) / 0.5, rate, 1e-5 * std::abs(rate)) << static_cast<int>(kind);
    }
    SpectrumSettings settings;
    settings.last = 2, settings.sigma = 0.3;
    const Spectrum found =
        spectrum(energy, {.friction = 1, .inextensible = false, .keeps_volume = false, .tension = 0.3}, Held::nothing,
                 meridian(Tube{1, length, {}}), settings);
    theory::UniformTube loaded = start->tube;
    loaded.tension = 0.3;
    std::vector<double> rates;
    for (int n = 1; n < 6; ++n) rates.push_back(-theory::stiffness(loaded, 1)(2 * pi * n / length));
    EXPECT_NEAR(found.modes[1].rates[0], *std::ranges::max_element(rates), 1e-5);
}

Case ellipsoid(const Model& model, double end, double accuracy) {
    Case c;
    c.energy = with_alpha(bending(0.5, -0.3), 0.4, -29);
    c.shape = Ellipsoid{0.8, 0.8, 1.3};
    c.model = model;
    c.time.end = end, c.accuracy.energy = accuracy;
    return c;
}

TEST(AreaDifference, runsLoseWhatTheyDissipate) {
    // theory.md (3.12), (3.13), (3.14), in every model; M and its energy are those of the last shape.
    for (const ModelKind kind :
         {ModelKind::gradient_flow, ModelKind::overdamped, ModelKind::stokes, ModelKind::fluid}) {
        SCOPED_TRACE(static_cast<int>(kind));
        const Case c = ellipsoid({.kind = kind, .Re = 2, .gamma = 0.3, .keeps_volume = true}, 0.2, 1e-6);
        const Outcome o = run_case(c);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        EXPECT_TRUE(o.summary.as_accurate_as_asked);
        for (const double defect : o["identity_defect"])
            EXPECT_LE(std::abs(defect), 20 * 1e-6 * o.summary.reference_energy);
        EXPECT_LT(o.last("energy"), 0.995 * o["energy"].front());
        EXPECT_NEAR(o.last("energy_alpha"), 0.2 * std::pow(o.last("M") + 29, 2), 1e-12);
        EXPECT_NEAR(o.last("energy"), o.last("energy_alpha") + o.last("energy_20"), 1e-10);
    }
}

TEST(AreaDifference, motionsEndAtEquilibria) {
    // Theorem: at the same area and volume, the minimum next to the start.
    const Case c = ellipsoid({.kind = ModelKind::overdamped, .keeps_volume = true}, 30, 1e-7);
    const Outcome o = run_case(c);
    ASSERT_EQ(exit_code(o.summary.stop.reason), 0) << o.summary.stop.message;
    const Equilibrium e = find_equilibrium({c.energy, {o["area"].front(), o["volume"].front(), {}}},
                                           meridian(std::get<Ellipsoid>(c.shape)), {.accuracy = 1e-10});
    ASSERT_EQ(e.stop, Stop::finished) << e.message;
    EXPECT_NEAR(o.last("energy"), e.observed.energy, 1e-6 * e.reference_energy);
    EXPECT_NEAR(o.last("M"), e.observed.M, 1e-4);
}

TEST(AreaDifference, aTubeFollowsItsForce) {
    // Exact, of a straight tube whose area is kept: F' = 0 for E + sigma A - pressure V - force L with M = -2 pi L,
    // where the force of theory.md (3.21) has the energy's -2 pi mu. It stays at rest; and the series says the same at
    // a fixed period.
    const double R = 0.8, L = 2, sigma = 0.3, alpha = 0.2, M0 = -10, mu = alpha * (-2 * pi * L - M0);
    const Bending energy = with_alpha(bending(0.5, -0.7, 0, 0.1), alpha, M0);
    const double h = -1 / R + 0.7, f = 0.5 * h * h, F1 = h, pressure = (f + F1 / R + sigma) / R,
                 force = 2 * pi * R * (f + sigma) - 2 * pi * mu - pi * R * R * pressure;
    for (const ModelKind kind : {ModelKind::gradient_flow, ModelKind::stokes}) {
        Model model{
            .kind = kind, .Re = 2, .gamma = 0.3, .keeps_volume = false, .area = AreaRule::fixed, .pressure = pressure};
        Case c = tube_case(energy, R, L, {}, 1);
        c.model = model;
        const Outcome fixed = run_case(c);
        EXPECT_NEAR(fixed.last("force"), force, 1e-6) << static_cast<int>(kind);
        c.model.free_period = true, c.model.force = force;
        const Outcome at_rest = run_case(c);
        EXPECT_NEAR(at_rest.last("height"), L, 1e-6) << static_cast<int>(kind);
        c.model.force = force + 0.3;
        c.accuracy.energy = 1e-7;
        const Outcome pulled = run_case(c);
        EXPECT_GT(pulled.last("height"), L + 1e-3) << static_cast<int>(kind);
        for (const double defect : pulled["identity_defect"])
            EXPECT_LE(std::abs(defect), 20 * 1e-7 * pulled.summary.reference_energy);
    }
}

}  // namespace tubule::axisym::area_difference_test
