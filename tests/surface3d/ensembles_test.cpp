// Moving surfaces at given tension and pressure, at fixed area, and fed by a reservoir: exact states, growth rates of
// small waves (theory.md 5, theory.md 6), what is kept, and the balance of the free energy.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <complex>

#include "common/theory/dispersion.hpp"
#include "tests/surface3d/motion.hpp"

namespace tubule::surface3d {
namespace {

const Bending all_terms{.k = {0.5, 0.03, 0.1}, .H0 = -0.6};
constexpr ModelKind kinds[] = {ModelKind::gradient_flow, ModelKind::overdamped, ModelKind::stokes, ModelKind::fluid};

// The volume free at a pressure, the area free or fed at a tension.
Model open_model(ModelKind kind, const Ramp& tension, const Ramp& pressure) {
    const bool extensible = kind == ModelKind::gradient_flow;
    return {.kind = kind,
            .Re = 2,
            .gamma = 0.3,
            .keeps_volume = false,
            .area = extensible ? AreaRule::free : AreaRule::reservoir,
            .tension = tension,
            .pressure = pressure};
}

// theory.md (3.21), (3.23)
double pressure_of_tube(const Bending& energy, double R, double tension) {
    const CurvatureJet<double> f = density(energy, -1 / R, 0.0);
    return (f.f + f.H / R + tension) / R;
}
double force_of_tube(const Bending& energy, double R, double tension, double pressure) {
    return 2 * pi * R * (density(energy, -1 / R, 0.0).f + tension) - pi * R * R * pressure;
}
double pressure_of_sphere(const Bending& energy, double R, double tension) {
    const CurvatureJet<double> f = density(energy, -2 / R, 1 / (R * R));
    return 2 * (f.f + tension) / R + 2 * f.H / (R * R) - 2 * f.K / (R * R * R);
}

TEST(Ensembles, ATubeRestsAtItsTensionAndPressure) {
    const double R = 0.8, tension = 0.4, pressure = pressure_of_tube(all_terms, R, tension);
    for (const ModelKind kind : kinds) {
        SCOPED_TRACE(static_cast<int>(kind));
        Motion motion(tube_mesh({.radius = R, .length = 2, .modes = {}}, 4, 8, 4),
                      open_model(kind, tension, pressure), all_terms);
        motion.until(0.2, 20);
        const MotionMeasures m = motion.measures();
        EXPECT_NEAR(m.r_min, R, 2e-5);
        EXPECT_NEAR(m.r_max, R, 2e-5);
        EXPECT_NEAR(m.force, force_of_tube(all_terms, R, tension, pressure), 2e-4);
        // What holds the area or the volume there, where they are kept.
        Model kept = open_model(kind, {}, pressure);
        kept.area = AreaRule::fixed;
        Motion other(motion.mesh(), kept, all_terms);
        other.until(0.1, 10);
        EXPECT_NEAR(other.measures().tension, tension, 1e-4);
        kept = open_model(kind, tension, {});
        kept.keeps_volume = true;
        Motion third(motion.mesh(), kept, all_terms);
        third.until(0.1, 10);
        EXPECT_NEAR(third.measures().pressure, pressure, 1e-4);
    }
}

TEST(Ensembles, ASphereRestsAtItsTensionAndPressure) {
    const double R = 1.2, tension = 0.3, pressure = pressure_of_sphere(all_terms, R, tension);
    for (const ModelKind kind : kinds) {
        SCOPED_TRACE(static_cast<int>(kind));
        Motion motion(mesh_of(Sphere{.radius = R, .modes = {}}, icosphere(3), 4),
                      open_model(kind, tension, pressure), all_terms);
        motion.until(0.2, 20);
        const MotionMeasures m = motion.measures();
        EXPECT_NEAR(m.r_min, R, 2e-5);
        EXPECT_NEAR(m.r_max, R, 2e-5);
        EXPECT_EQ(m.force, 0);
    }
}

// a(t)/a(0) of a wave that begins at rest: theory.md (5.12) with inertia, of which (5.18) at a given tension has the
// same roots.
double amplitude_at(double t, const theory::UniformTube& tube, const MotionLaw& law, double q, int m) {
    const theory::Growth growth = theory::growth(tube, law, q, m);
    if (law.inertia == 0) return std::exp(growth.rate() * t);
    const auto n = static_cast<Eigen::Index>(growth.roots.size());
    Eigen::MatrixXcd powers(n, n);
    Eigen::VectorXcd start = Eigen::VectorXcd::Zero(n);
    start[0] = 1;
    if (n > 2) start[2] = -theory::mobility(tube, law, q, m) * theory::stiffness(tube, m)(q);
    for (Eigen::Index j = 0; j < n; ++j)
        for (Eigen::Index i = 0; i < n; ++i) powers(i, j) = std::pow(growth.roots[j], static_cast<double>(i));
    const Eigen::VectorXcd part = powers.lu().solve(start);
    std::complex<double> sum = 0;
    for (Eigen::Index j = 0; j < n; ++j) sum += part[j] * std::exp(growth.roots[j] * t);
    return sum.real();
}

struct Wave {
    double tension;
    int m;
    double length;
    int n_z, n_theta;
};

TEST(Ensembles, WavesGrowOrDecayAtTheirRates) {
    // A single wave, which area and volume would freeze: theory.md (5.6), (5.9), (5.10), (5.12), below and above the
    // thresholds of pearling and buckling. Log-amplitudes to a thousandth of the rate, the error of the mesh.
    const double R = 1, a0 = 1e-4;
    for (const ModelKind kind : kinds)
        for (const auto& [tension, m, length, n_z, n_theta] :
             {Wave{-1.5, 0, 5, 8, 6}, {4.5, 0, 8, 10, 8}, {-4, 1, 5, 8, 12}, {2, 2, 5, 6, 12}}) {
            const double q = 2 * pi / length;
            const Model model = open_model(kind, tension, pressure_of_tube(all_terms, R, tension));
            const MotionLaw law = motion_law(model);
            const theory::UniformTube tube{all_terms, R, tension};
            const double fastest = std::abs(theory::growth(tube, law, q, m).roots.front());
            const double end = 0.5 / fastest;
            Motion motion(tube_mesh({.radius = R, .length = length, .modes = {{a0, 1, m}}}, n_z, n_theta, 4), model,
                          all_terms);
            const double start = tube_wave(motion.mesh(), 1, m);
            motion.until(end, 24);
            const double found = tube_wave(motion.mesh(), 1, m) / start, exact = amplitude_at(end, tube, law, q, m);
            EXPECT_NEAR(std::log(found) / end, std::log(exact) / end, 1e-3 * fastest)
                << static_cast<int>(kind) << ' ' << tension << ' ' << m;
        }
}

}  // namespace
}  // namespace tubule::surface3d
