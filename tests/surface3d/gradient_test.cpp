// The gradient term kg INT |grad H|^2 dS of surfaces: energies, forces, waves, runs.
#include <gtest/gtest.h>

#include <random>

#include "common/shapes/ellipsoid.hpp"
#include "common/shapes/torus.hpp"
#include "common/theory/dispersion.hpp"
#include "surface3d/curvature/bending_force.hpp"
#include "surface3d/motion/axial_force.hpp"
#include "tests/support/message_of.hpp"
#include "tests/surface3d/motion.hpp"
#include "tests/surface3d/run_case.hpp"
#include "tests/surface3d/smooth_field.hpp"

namespace tubule::surface3d::gradient_test {

Bending with_gradients(Bending energy, double kg) {
    energy.kg = kg;
    return energy;
}
const Bending mixed = with_gradients({.k = {0.3, 0.03, 0.1}, .H0 = -0.6}, 0.4);

// Along the angle t of an ellipsoid (sin t, z = c cos t) H = -c/g^3 - c/g, g^2 = cos^2 t + c^2 sin^2 t.
TEST(SurfaceGradients, energyOfAnEllipsoid) {
    constexpr int points = 2000;
    const double c = 1.4;
    double exact = 0;
    for (int i = 0; i < points; ++i) {
        const double t = pi * (i + 0.5) / points, s = std::sin(t), co = std::cos(t), g2 = co * co + c * c * s * s;
        const double H_t = c * (3 / (g2 * g2) + 1 / g2) * (c * c - 1) * s * co / std::sqrt(g2);
        exact += pi / points * 2 * pi * s * H_t * H_t / std::sqrt(g2);
    }
    const Outcome o = run_case(
        "[energy]\nkg = 2\nk20 = 1\n[shape]\nkind = \"ellipsoid\"\na = 1\nb = 1\nc = 1.4\n[discretisation]\nelements = "
        "720\n",
        {});
    EXPECT_NEAR(o.last("energy_kg") / (2 * exact), 1, 1e-5);
    // With the fields of motions, whose H sees every wave of the mesh.
    double error[2];
    for (const int k : {0, 1})
        error[k] = std::abs(observed(mesh_of(Ellipsoid{1, 1, c}, icosphere(3 << k), 4), with_gradients({}, 2)).energy /
                                (2 * exact) -
                            1);
    EXPECT_LT(error[1], 1e-3);
    EXPECT_GT(std::log2(error[0] / error[1]), 3);
}

template <class Moved>
double rate_of_energy(const Moved& moved) {
    return rate_along(moved, [](const CurvedMesh& mesh) { return observed(mesh, mixed).energy; });
}

// Minus the power of the force is the rate of the energy, up to the error of the fields; so is the force of a period.
TEST(SurfaceGradients, theForceApproachesTheRateOfTheEnergy) {
    const Sphere wavy{.radius = 1, .modes = {{0.1, 2, 1}, {0.05, 3, 2}}};
    const MotionLaw law = motion_law({.kind = ModelKind::fluid, .Re = 2, .gamma = 0.5, .keeps_volume = {}});
    double along[2], around[2];
    for (const int i : {0, 1}) {
        const CurvedMesh mesh = mesh_of(wavy, icosphere(3 << i), 4);
        const VectorField v = smooth_at(mesh);
        const Eigen::VectorXd flat = Eigen::MatrixXd(v.transpose()).reshaped();
        const StepSystem system = system_at_rest(mesh, mixed, law);
        const double energy = rate_of_energy([&](double s) { return moved_mesh(mesh, v, s); });
        around[i] = std::abs(system.force.head(flat.size()).dot(flat) + energy) / std::abs(energy);
        const CurvedMesh tube =
            tube_mesh({.radius = 1, .length = 4, .modes = {{0.2, 1, 0}, {0.1, 1, 2}}}, 6 << i, 8 << i, 4);
        const double stretched = rate_of_energy([&](double s) { return stretched_mesh(tube, s); });
        MovingSurface surface(tube, motion_law({.kind = ModelKind::gradient_flow, .keeps_volume = {}}), mixed, {});
        const MotionState state = surface.start(tube);
        const double force =
            axial_force(surface, state, surface.fields(tube), VectorField::Zero(3, tube.size()), 0, 0, 0);
        along[i] = std::abs(force * tube.period / stretched - 1);
    }
    EXPECT_LT(around[1], 1e-3);
    EXPECT_GT(std::log2(around[0] / around[1]), 2.5);
    EXPECT_LT(along[1], 5e-3);
    EXPECT_GT(std::log2(along[0] / along[1]), 2.5);
}

// Waves (n, m) on tubes at rest, of 8 random energies: theory.md (5.28), by one implicit step of Euler's method, which
// divides an amplitude by 1 - rate tau; and waves l of spheres, (6.11).
TEST(SurfaceGradients, wavesFollowTheDispersionRelation) {
    std::mt19937 random(3);
    const auto uniform = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
    const double amplitude = 1e-3;
    for (int i = 0; i < 8; ++i) {
        const double R = uniform(0.7, 1.3), length = uniform(3, 6);
        const int n = 1 + i % 2, m = i % 4;
        const Bending energy =
            with_gradients({.k = {uniform(-0.5, 0.5), uniform(0, 0.1), uniform(-0.2, 0.3)}, .H0 = uniform(-1.5, 0.5)},
                           uniform(0.05, 0.3));
        Model model{.kind = ModelKind::gradient_flow, .keeps_volume = {}};
        const theory::UniformTube tube{energy, R, uniform(-0.5, 0.5)};
        model.tension = Ramp(tube.tension), model.pressure = Ramp(theory::pressure_at_rest(tube));
        const double rate = -theory::stiffness(tube, m)(2 * pi * n / length), tau = 2e-4 / std::abs(rate);
        Motion motion(tube_mesh({.radius = R, .length = length, .modes = {{amplitude, n, m}}}, 10, 12, 4), model,
                      energy, {}, scheme_named("euler"));
        const double before = tube_wave(motion.mesh(), n, m);
        motion.steps(tau, 1);
        const double found = (1 - before / tube_wave(motion.mesh(), n, m)) / tau, q = 2 * pi * n / length;
        const double Q = q * q + m * m / (R * R),
                     of_gradients = 2 * energy.kg * Q * (Q - 1 / (R * R)) * (Q - 1 / (R * R));
        EXPECT_NEAR(found, rate, 1e-3 * (std::abs(rate) + of_gradients)) << i << ": n = " << n << ", m = " << m;
    }
    for (const int l : {2, 3}) {
        const theory::UniformSphere sphere{mixed, 1.1, 0.2};
        Model model{.kind = ModelKind::gradient_flow, .keeps_volume = {}};
        model.tension = Ramp(sphere.tension), model.pressure = Ramp(theory::pressure_at_rest(sphere));
        const double rate = -theory::stiffness(sphere, l), tau = 2e-4 / std::abs(rate);
        Motion motion(mesh_of(Sphere{1.1, {{amplitude, l, 1}}}, icosphere(4), 4), model, mixed, {},
                      scheme_named("euler"));
        const double before = sphere_wave(motion.mesh(), l, 1);
        motion.steps(tau, 1);
        EXPECT_NEAR((1 - before / sphere_wave(motion.mesh(), l, 1)) / tau / rate, 1, 1e-3) << l;
    }
}

const std::string cell =
    "[energy]\nk20 = -0.1\nk40 = 0.05\nkg = 0.3\n[shape]\nkind = \"ellipsoid\"\na = 1\nb = 1\nc = 1.3\n[time]\nend = "
    "0.05\n"
    "[accuracy]\nenergy = 1e-3\n";

// A fluid cell in both tiers: energies of tier axisym with accuracy.energy = 1e-8.
TEST(SurfaceGradients, aRunAgreesWithTierAxisym) {
    const Outcome o =
        run_case(cell + "[model]\nkind = \"fluid\"\n[discretisation]\nelements = 180\n", {"accuracy.estimate=false"});
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    EXPECT_LT(std::abs(o.last("identity_defect")), 5e-3 * o.summary.reference_energy);
    EXPECT_NEAR(o.last("energy"), 5.8282381362, 1e-4 * o.summary.reference_energy);
    EXPECT_NEAR(o.last("energy_kg"), 1.3865181470, 1e-4 * o.summary.reference_energy);
}

TEST(SurfaceGradients, unresolvedWavesStopARun) {
    const Outcome o = run_case(cell + "[discretisation]\nelements = 80\n", {"energy.k20=-3", "energy.kg=1e-3"});
    EXPECT_EQ(o.summary.stop.reason, Stop::resolution_lost);
    EXPECT_CONTAINS(o.summary.stop.message, "which only the gradient term damps waves");
}

}  // namespace tubule::surface3d::gradient_test
