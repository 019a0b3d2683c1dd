// Area-difference elasticity, alpha/2 (M - M0)^2 with M = INT H dS, of surfaces: forces, steps, runs.
#include <gtest/gtest.h>

#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "common/shapes/ellipsoid.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/motion/motion_forms.hpp"
#include "tests/support/message_of.hpp"
#include "tests/surface3d/motion.hpp"
#include "tests/surface3d/run_case.hpp"
#include "tests/surface3d/smooth_field.hpp"

namespace tubule::surface3d::area_difference_test {

Bending with_alpha(double alpha, double M0) {
    Bending out{.k = {0.5, 0.03, 0.1}, .H0 = -0.6};
    out.alpha = alpha, out.M0 = M0;
    return out;
}

TEST(AreaDifference, MOfExactShapes) {
    // Exact: -8 pi R of a sphere; of a prolate spheroid -4 pi (c + a^2 arcosh(c/a)/sqrt(c^2 - a^2)); -2 pi L of a tube.
    const Bending bending = with_alpha(0.4, -29);
    const double a = 0.8, c = 1.3, of_spheroid = -4 * pi * (c + a * a * std::acosh(c / a) / std::sqrt(c * c - a * a));
    for (const auto& [mesh, M] : {std::pair{mesh_of(Sphere{1.2, {}}, icosphere(4), 4), -8 * pi * 1.2},
                                  {mesh_of(Ellipsoid{a, a, c}, icosphere(4), 4), of_spheroid},
                                  {tube_mesh({.radius = 0.7, .length = 3, .modes = {}}, 6, 12, 4), -6 * pi}}) {
        const Observables o = observed(mesh, bending);
        EXPECT_NEAR(o.M, M, 1e-4);
        EXPECT_NEAR(o.energy_alpha, 0.2 * (o.M + 29) * (o.M + 29), 1e-12);
        EXPECT_NEAR(o.energy, o.energy_alpha + o.energy_term[0] + o.energy_term[1] + o.energy_term[2], 1e-12);
        EXPECT_NEAR(integral(SurfaceSpace(mesh), mesh, fields_of(mesh).H), o.M, 1e-12 * std::abs(M));
    }
}

TEST(AreaDifference, theForceApproachesTheRateOfTheEnergy) {
    // theory.md (2.20): minus the power of the force is the rate of E, and the row of M is that of M, up to the
    // error of the fields.
    const Bending bending = with_alpha(0.4, -20);
    const Sphere wavy{.radius = 1, .modes = {{0.15, 2, 1}, {0.1, 3, 2}}};
    const MotionLaw law = motion_law({.kind = ModelKind::fluid, .Re = 2, .gamma = 0.5, .keeps_volume = {}});
    double of_energy[2], of_M[2];
    for (const int i : {0, 1}) {
        const CurvedMesh mesh = mesh_of(wavy, icosphere(2 << i), 4);
        const VectorField v = smooth_at(mesh);
        const Eigen::VectorXd flat = Eigen::MatrixXd(v.transpose()).reshaped();
        const StepSystem system = system_at_rest(mesh, bending, law);
        const double energy = rate_of(mesh, v, [&](const CurvedMesh&m) { return observed(m, bending).energy; }),
                     M = rate_of(mesh, v, [&](const CurvedMesh&m) { return observed(m, bending).M; });
        of_energy[i] = std::abs(system.force.head(flat.size()).dot(flat) + energy) / std::abs(energy);
        of_M[i] = std::abs(system.turning.head(flat.size()).dot(flat) - M) / std::abs(M);
    }
    EXPECT_GT(std::log2(of_energy[0] / of_energy[1]), 3);
    EXPECT_GT(std::log2(of_M[0] / of_M[1]), 3);
    EXPECT_LT(of_energy[1], 3e-4);
    EXPECT_LT(of_M[1], 3e-4);
}

TEST(AreaDifference, theForceOnAPeriodIsARate) {
    // theory.md (3.19): of the energy with the mesh stretched along the axis, as far as the mesh resolves it.
    const Bending bending = with_alpha(0.4, -20);
    Model open{.keeps_volume = false, .area = AreaRule::fixed};
    open.free_period = true;
    double error[2];
    for (const int i : {0, 1}) {
        const CurvedMesh mesh =
            tube_mesh({.radius = 1, .length = 4, .modes = {{0.2, 1, 0}, {0.1, 1, 2}}}, 6 << i, 8 << i, 4);
        const auto rate = [&](const auto& quantity) {
            return rate_along([&](double s) { return stretched_mesh(mesh, s); },
                              [&](const CurvedMesh& m) { return quantity(observed(m, bending)); });
        };
        const double energy = rate([](const Observables&o) { return o.energy; }),
                     M = rate([](const Observables&o) { return o.M; });
        const double force = Motion(mesh, {}, bending).measures().force,
                     of_M = system_at_rest(mesh, bending, motion_law(open)).stretch.M;
        error[i] = std::max(std::abs(force / (energy / mesh.period) - 1), std::abs(of_M / M - 1));
    }
    EXPECT_LT(error[1], 1e-3);
    EXPECT_GT(error[0] / error[1], 4);
}

// dR/dt of a sphere in gradient flow, A R_t = -dE/dR.
double radius_rate(const Bending& b, double R) {
    const CurvatureJet<double> f = density(with_M(b, -8 * pi * R), -2 / R, 1 / (R * R));
    return -2 / R * (f.f + f.H / R - f.K / (R * R));
}

TEST(AreaDifference, aSphereFollowsTheEquationOfItsRadius) {
    // By the classical method of Runge and Kutta. The order of every scheme holds in steps in which the term alone
    // would change the radius by as much as it is off: alpha (M - M0) is that of the end of a step.
    const Bending bending = with_alpha(2, -26);
    const double start = 1.1, end = 0.05, h = end / 2000;
    double R = start;
    for (int i = 0; i < 2000; ++i) {
        const double a = radius_rate(bending, R), b = radius_rate(bending, R + h / 2 * a),
                     c = radius_rate(bending, R + h / 2 * b), d = radius_rate(bending, R + h * c);
        R += h / 6 * (a + 2 * b + 2 * c + d);
    }
    EXPECT_GT(std::abs(R - start), 0.05);
    for (const auto& [scheme, order, most] : {std::tuple{scheme_named("euler"), 1, 2e-2},
                                              {scheme_named("bdf2"), 2, 1e-2},
                                              {scheme_named("alpha"), 2, 1e-2},
                                              {scheme_named("bdf"), 2, 1e-2}}) {
        SCOPED_TRACE(static_cast<int>(scheme));
        double error[2];
        for (const int i : {0, 1}) {
            Motion motion(mesh_of(Sphere{.radius = start, .modes = {}}, icosphere(3), 4),
                          {.keeps_volume = false, .area = AreaRule::free}, bending, {}, scheme);
            motion.until(end, 4 << i);
            error[i] = std::abs(motion.measures().r_max - R);
        }
        EXPECT_LT(error[1], most * std::abs(R - start));
        EXPECT_GT(std::log2(error[0] / error[1]), order - 0.4);
    }
}

TEST(AreaDifference, aLargeAlphaHoldsM) {
    // M - M0 = mu/alpha, where mu balances what else acts on the sphere. Steps of any length: the radius would change
    // at 16 pi alpha/R^2, here 500 times in a step.
    Motion motion(mesh_of(Sphere{.radius = 1.1, .modes = {}}, icosphere(2), 4),
                  {.keeps_volume = false, .area = AreaRule::free}, with_alpha(1000, -28));
    motion.steps(0.0125, 20);
    const double R = motion.measures().r_max, mu = 1000 * (motion.measures().bending.M + 28);
    EXPECT_NEAR(motion.measures().bending.M, -28, 0.02);
    // theory.md (2.13) with f + mu H: f + f_H/R - f_K/R^2 = mu/R.
    const Bending bending{.k = {0.5, 0.03, 0.1}, .H0 = -0.6};
    const CurvatureJet<double> f = density(bending, -2 / R, 1 / (R * R));
    EXPECT_NEAR(mu, R * (f.f + f.H / R - f.K / (R * R)), 0.02 * std::abs(mu));
}

TEST(AreaDifference, thePapersSchemeRefusesIt) {
    EXPECT_EQ(test::message_of<std::invalid_argument>([] {
                  Motion(mesh_of(Sphere{}, icosphere(2), 4), {.kind = ModelKind::overdamped, .keeps_volume = {}},
                         with_alpha(0.4, -29), {}, scheme_named("paper"));
              }),
              "the paper's scheme has k20, k40 and k42, no energy.alpha");
}

TEST(AreaDifference, aStraightTubeFollowsItsForce) {
    // Area kept, M = -2 pi L: theory.md (3.17) and (3.19) in closed form, with -2 pi alpha (M - M0) in the force.
    const double R0 = 0.8, L0 = 2, pressure = 0.2, force = 6, end = 0.3;
    const Bending bending = with_alpha(0.1, -10);
    const auto rate = [&](double R) {
        const double L = R0 * L0 / R, mu = 0.1 * (-2 * pi * L + 10);
        Bending local = bending;
        local.alpha.reset();
        const CurvatureJet<double> f = density(local, -1 / R, 0.0);
        const double sigma = (force + 2 * pi * mu + pi * R * R * pressure) / (2 * pi * R) - f.f;
        return pressure - (f.f + f.H / R + sigma) / R;
    };
    double R = R0;
    const double h = end / 2000;
    for (int i = 0; i < 2000; ++i) {
        const double a = rate(R), b = rate(R + h / 2 * a), c = rate(R + h / 2 * b), d = rate(R + h * c);
        R += h / 6 * (a + 2 * b + 2 * c + d);
    }
    const double L = R0 * L0 / R;
    EXPECT_GT(std::abs(L / L0 - 1), 0.01);
    Model model{.keeps_volume = false, .area = AreaRule::fixed, .pressure = pressure};
    model.free_period = true, model.force = force;
    for (const Scheme scheme : {scheme_named("bdf2"), scheme_named("bdf")}) {
        double error[2];
        for (const int i : {0, 1}) {
            Motion motion(tube_mesh({.radius = R0, .length = L0, .modes = {}}, 4, 8, 4), model, bending, {}, scheme);
            motion.until(end, 10 << i);
            error[i] = std::abs(motion.state.period - L);
        }
        EXPECT_GT(std::log2(error[0] / error[1]), 1.4);
        EXPECT_LT(error[1], 1e-3 * L);
    }
}

const std::string spheroid = R"case(
energy = {k20 = 0.5, H0 = -0.3, alpha = 0.4, M0 = -29}
shape = {kind = "ellipsoid", a = 0.8, b = 0.8, c = 1.3}
discretisation = {elements = 80}
accuracy = {energy = 1e-2}
time = {end = 0.05}
)case";

TEST(AreaDifference, runsLoseWhatTheyDissipate) {
    // theory.md (3.12), (3.13), (3.14).
    for (const std::string kind : {"gradient-flow", "overdamped", "stokes", "fluid"}) {
        SCOPED_TRACE(kind);
        const Outcome o = run_case(spheroid, {"model.kind=" + kind, "accuracy.estimate=false"});
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        for (const double defect : o.series("identity_defect"))
            EXPECT_LT(std::abs(defect), 1e-2 * o.summary.reference_energy);
        EXPECT_LT(o.series("energy").back(), 0.999 * o.series("energy").front());
        EXPECT_NEAR(o.last("energy_alpha"), 0.2 * std::pow(o.last("M") + 29, 2), 1e-10);
    }
}

TEST(AreaDifference, ofASurfaceAtRest) {
    // Exact: M of a sphere, and the energy of its density.
    const Outcome o = run_case(
        "[energy]\nk20 = 0.5\nalpha = 0.4\nM0 = -29\n[shape]\nkind = \"sphere\"\nradius = 1.2\n[accuracy]\nenergy = "
        "1e-4\n");
    const double M = -8 * pi * 1.2;
    EXPECT_NEAR(o.last("M"), M, 1e-3);
    EXPECT_NEAR(o.last("energy"), 8 * pi + 0.2 * (M + 29) * (M + 29), 1e-2);
}

}  // namespace tubule::surface3d::area_difference_test
