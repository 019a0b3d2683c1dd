// Moving surfaces at given tension and pressure, at fixed area, and fed by a reservoir: exact states, growth rates of
// small waves (theory.md 5, theory.md 6), what is kept, and the balance of the free energy.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <complex>

#include "common/theory/dispersion.hpp"
#include "surface3d/fem/projection.hpp"
#include "tests/surface3d/motion.hpp"

namespace tubule::surface3d::ensembles_test {

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
        Motion motion(tube_mesh({.radius = R, .length = 2, .modes = {}}, 4, 8, 4), open_model(kind, tension, pressure),
                      all_terms);
        motion.until(0.2, 8);
        const MotionMeasures m = motion.measures();
        EXPECT_NEAR(m.r_min, R, 2e-5);
        EXPECT_NEAR(m.r_max, R, 2e-5);
        EXPECT_NEAR(m.force, force_of_tube(all_terms, R, tension, pressure), 2e-4);
        // What holds the area or the volume there, where they are kept.
        Model kept = open_model(kind, {}, pressure);
        kept.area = AreaRule::fixed;
        Motion other(motion.mesh(), kept, all_terms);
        other.until(0.1, 4);
        EXPECT_NEAR(other.measures().tension, tension, 1e-4);
        kept = open_model(kind, tension, {});
        kept.keeps_volume = true;
        Motion third(motion.mesh(), kept, all_terms);
        third.until(0.1, 4);
        EXPECT_NEAR(third.measures().pressure, pressure, 1e-4);
    }
}

TEST(Ensembles, ASphereRestsAtItsTensionAndPressure) {
    const double R = 1.2, tension = 0.3, pressure = pressure_of_sphere(all_terms, R, tension);
    for (const ModelKind kind : kinds) {
        SCOPED_TRACE(static_cast<int>(kind));
        Motion motion(mesh_of(Sphere{.radius = R, .modes = {}}, icosphere(3), 4), open_model(kind, tension, pressure),
                      all_terms);
        motion.until(0.2, 5);
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

TEST(Ensembles, AReservoirFeedsUniformlyAndBringsMomentum) {
    // theory.md (3.18): div_P u is one number, up to what the elements resolve, and momentum grows with the area while
    // friction takes its part.
    const double end = 0.1;
    const Sphere wavy{.radius = 1, .modes = {{0.15, 2, 1}, {0.05, 3, 2}}};
    const Model model = open_model(ModelKind::fluid, -3, 1);
    Motion motion(mesh_of(wavy, icosphere(3), 4), model, all_terms);
    const int n = motion.mesh().size();
    motion.state.u.head(n).setConstant(0.2);
    const MotionMeasures start = motion.measures();
    motion.until(end, 10);
    const MotionMeasures now = motion.measures();
    const double factor = std::exp(-*model.gamma * end) * now.bending.area / start.bending.area;
    EXPECT_GT(now.bending.area, 1.01 * start.bending.area);
    EXPECT_LT((now.momentum - factor * start.momentum).norm(), 1e-8 * start.momentum.norm());
    const CurvedMesh mesh = motion.mesh();
    const SurfaceSpace space(mesh);
    double sum = 0, squares = 0, area = 0;
    for (int cell = 0; cell < space.cells(); ++cell)
        for (int q = 0; q < space.tabulation().points(); ++q) {
            const SurfacePoint<double> p = tangent_point(cell_nodes(mesh, cell), space.tabulation(), q);
            const double dS = space.tabulation().weight[q] * p.area,
                         rate =
                             gradients(p, space.tabulation(), q).cwiseProduct(space.gather(now.velocity, cell)).sum();
            sum += dS * rate, squares += dS * rate * rate, area += dS;
        }
    EXPECT_LT(std::sqrt(squares / area - sum * sum / (area * area)), 0.1 * std::abs(sum / area));
}

TEST(Ensembles, ASupplyKeepsAUniformTranslation) {
    // A vesicle that is fed while it moves keeps its velocity at every node, up to the tolerances of the linear
    // solvers. If the supply were at rest, it would lose half of the 1 % by which its area grows.
    Model model = open_model(ModelKind::fluid, -3, 1);
    model.gamma = 0;
    const CurvedMesh mesh = mesh_of(Sphere{.radius = 1, .modes = {{0.15, 2, 1}}}, icosphere(2), 3);
    const Eigen::Vector3d U(0.4, -0.7, 1.1);
    Motion moving(mesh, model, all_terms, {}, scheme_named("alpha")),
        resting(mesh, model, all_terms, {}, scheme_named("alpha"));
    const int n = mesh.size();
    VectorField translation = U.replicate(1, n);
    moving.state.u = translation.transpose().reshaped(), moving.state.w = translation;
    const double end = 0.1, area = resting.measures().bending.area;
    moving.until(end, 8), resting.until(end, 8);
    EXPECT_GT(resting.measures().bending.area, 1.01 * area);
    const VectorField left = (moving.state.u - resting.state.u).reshaped(n, 3).transpose();
    EXPECT_LT((left - translation).colwise().norm().maxCoeff(), 2e-6 * U.norm());
    EXPECT_LT((moving.state.X - resting.state.X - end * translation).colwise().norm().maxCoeff(), 2e-6);
}

TEST(Ensembles, AReservoirBringsMembraneThatMovesAlong) {
    // A sphere swells by inertia R'' = P - P(R) - (gamma + 4 mu/R^2) R', P(R) that of theory.md (3.23).
    const double tension = -0.3, pressure = 6, end = 0.4;
    const Model model = open_model(ModelKind::fluid, tension, pressure);
    double R = 1, V = 0;
    const int steps = 40000;
    const auto force = [&](double r, double v) {
        return pressure - pressure_of_sphere(all_terms, r, tension) - (*model.gamma + 4 / model.Re / (r * r)) * v;
    };
    for (int i = 0; i < steps; ++i) {
        const double h = end / steps, r = R + h / 2 * V, v = V + h / 2 * force(R, V);
        R += h * v, V += h * force(r, v);
    }
    Motion motion(mesh_of(Sphere{.radius = 1, .modes = {}}, icosphere(2), 4), model, all_terms, {},
                  scheme_named("alpha"));
    motion.until(end, 40);
    EXPECT_NEAR(motion.measures().r_max, R, 8e-4 * R);
    EXPECT_NEAR(motion.measures().speed, V, 8e-3 * V);
}

struct Wave {
    double tension;
    int m;
    double length;
    int n_z, n_theta, steps;
};

// Log-amplitudes of a single wave on a tube of radius 1, which area, volume and period together would freeze, to
// 0.4 % of its rate: theory.md (5.6), (5.9), (5.10), (5.12) at its tension.
void expect_rate(const Wave& wave, const Model& model) {
    const auto& [tension, m, length, n_z, n_theta, steps] = wave;
    const double q = 2 * pi / length;
    const theory::UniformTube tube{all_terms, 1, tension};
    const double fastest = std::abs(theory::growth(tube, motion_law(model), q, m).roots.front()), end = 0.5 / fastest;
    Motion motion(tube_mesh({.radius = 1, .length = length, .modes = {{1e-4, 1, m}}}, n_z, n_theta, 4), model,
                  all_terms);
    const double start = tube_wave(motion.mesh(), 1, m);
    motion.until(end, steps);
    const double found = tube_wave(motion.mesh(), 1, m) / start,
                 exact = amplitude_at(end, tube, motion_law(model), q, m);
    EXPECT_NEAR(std::log(found) / end, std::log(exact) / end, 4e-3 * fastest) << tension << ' ' << m;
    EXPECT_GT(std::abs(std::log(exact)), 0.05);
}

TEST(Ensembles, WavesGrowOrDecayAtTheirRates) {
    // At the tension that is given, below and above the thresholds of pearling and buckling.
    for (const auto& [kind, wave] : {std::pair{ModelKind::gradient_flow, Wave{-1.5, 0, 5, 8, 6, 10}},
                                     {ModelKind::overdamped, {2, 2, 5, 6, 12, 12}},
                                     {ModelKind::stokes, {-1.5, 0, 5, 8, 6, 10}},
                                     {ModelKind::fluid, {4.5, 0, 8, 10, 8, 20}}}) {
        SCOPED_TRACE(static_cast<int>(kind));
        expect_rate(wave, open_model(kind, wave.tension, pressure_of_tube(all_terms, 1, wave.tension)));
    }
}

// A tube whose period is free under a force: what is kept, of area and volume, at first.
Model stretching_model(ModelKind kind, double force, bool area, bool volume) {
    Model out = open_model(kind, {}, {});
    out.free_period = true, out.force = force, out.keeps_volume = volume;
    if (area) out.area = AreaRule::fixed;
    return out;
}

template <class Quantity>
double rate_of_stretch(const CurvedMesh& mesh, const Quantity& quantity) {
    return rate_along([&](double s) { return stretched_mesh(mesh, s); }, quantity);
}

TEST(FreePeriod, ItsTermsAreDerivatives) {
    // theory.md (10.18), (10.19): of area, volume and energy of the mesh; the last as far as the mesh resolves it,
    // since the force belongs to the energy of the smooth surface.
    double error[2];
    for (int i : {0, 1}) {
        const CurvedMesh mesh =
            tube_mesh({.radius = 1, .length = 4, .modes = {{0.2, 1, 0}, {0.1, 1, 2}}}, 6 << i, 8 << i, 4);
        const SurfaceSpace space(mesh);
        const Extent rate = stretch_rate(space, mesh);
        EXPECT_NEAR(rate_of_stretch(mesh, [&](const CurvedMesh& m) { return extent(space, m).area; }), rate.area, 1e-8);
        EXPECT_NEAR(rate_of_stretch(mesh, [&](const CurvedMesh& m) { return extent(space, m).volume; }), rate.volume,
                    1e-8);
        const auto energy = [&](const CurvedMesh& m) { return observed(m, all_terms).energy; };
        const double exact = rate_of_stretch(mesh, energy) / mesh.period;
        const double found = Motion(mesh, {}, all_terms).measures().force;
        error[i] = std::abs(found / exact - 1);
    }
    EXPECT_LT(error[1], 1e-3);
    EXPECT_GT(error[0] / error[1], 4);
}

TEST(FreePeriod, ATubeRestsAtItsForce) {
    // theory.md (3.21). What holds area and volume is measured.
    const double R = 0.8, tension = 0.4;
    const double pressure = pressure_of_tube(all_terms, R, tension),
                 force = force_of_tube(all_terms, R, tension, pressure);
    const CurvedMesh mesh = tube_mesh({.radius = R, .length = 2, .modes = {}}, 4, 8, 4);
    for (const ModelKind kind : kinds)
        for (const auto& [area, volume] : {std::pair{true, true}, {true, false}, {false, true}}) {
            SCOPED_TRACE(testing::Message() << static_cast<int>(kind) << ' ' << area << ' ' << volume);
            Model model = stretching_model(kind, force, area, volume);
            if (!area) model.tension = tension;
            if (!volume) model.pressure = pressure;
            Motion motion(mesh, model, all_terms);
            motion.until(0.1, 4);
            const MotionMeasures m = motion.measures();
            EXPECT_NEAR(motion.state.period, 2, 2e-4);
            EXPECT_NEAR(m.r_max, R, 1e-4);
            EXPECT_NEAR(m.tension, tension, 1e-3);
            EXPECT_NEAR(m.pressure, pressure, 1e-3);
        }
}

// Radius and period of a straight tube in gradient flow, by the classical method of Runge and Kutta. With one of area
// and volume kept, theory.md (3.17) and (3.19) in closed form: (u, N) follow from R alone.
struct Straight {
    double R, L;
};
Straight straight_tube(double end, const Bending& energy, Straight start, double force, double pressure) {
    // Area kept: sigma from the force, R_t = b + sigma H + P, and R L is constant.
    const auto rate = [&](double R) {
        const CurvatureJet<double> f = density(energy, -1 / R, 0.0);
        const double sigma = (force + pi * R * R * pressure) / (2 * pi * R) - f.f;
        return pressure - (f.f + f.H / R + sigma) / R;
    };
    const int steps = 2000;
    const double h = end / steps;
    double R = start.R;
    for (int i = 0; i < steps; ++i) {
        const double a = rate(R), b = rate(R + h / 2 * a), c = rate(R + h / 2 * b), d = rate(R + h * c);
        R += h / 6 * (a + 2 * b + 2 * c + d);
    }
    return {R, start.R * start.L / R};
}

TEST(FreePeriod, AStraightTubeFollowsItsForce) {
    const double R = 0.8, L = 2, pressure = 0.2, force = 7, end = 0.3;
    const Straight exact = straight_tube(end, all_terms, {R, L}, force, pressure);
    EXPECT_GT(std::abs(exact.L / L - 1), 0.1);
    for (const auto& [scheme, order, most] : {std::tuple{scheme_named("euler"), 1, 2e-2},
                                              {scheme_named("bdf2"), 2, 1e-3},
                                              {scheme_named("alpha"), 2, 1e-3},
                                              {scheme_named("bdf"), 2, 1e-3}}) {
        SCOPED_TRACE(static_cast<int>(scheme));
        Model model = stretching_model(ModelKind::gradient_flow, force, true, false);
        model.pressure = pressure;
        double error[2];
        for (int i : {0, 1}) {
            Motion motion(tube_mesh({.radius = R, .length = L, .modes = {}}, 4, 8, 4), model, all_terms, {}, scheme);
            const double area = motion.measures().bending.area;
            motion.until(end, 10 << i);
            EXPECT_NEAR(motion.measures().bending.area / area, 1, 1e-10);
            error[i] = std::abs(motion.state.period - exact.L);
        }
        EXPECT_GT(std::log2(error[0] / error[1]), order - 0.3);
        EXPECT_LT(error[1], most * L);
    }
}

TEST(FreePeriod, AtTheMeasuredForceNothingChanges) {
    // A wave under a force at which the period stays for a moment, in all models: a run at fixed period measures it.
    const CurvedMesh mesh = tube_mesh({.radius = 1, .length = 3, .modes = {{0.1, 1, 0}, {0.05, 1, 2}}}, 6, 8, 4);
    for (const ModelKind kind : kinds) {
        SCOPED_TRACE(static_cast<int>(kind));
        Model held = stretching_model(kind, 0, true, true);
        held.free_period = false, held.force = {};
        Motion fixed(mesh, held, all_terms);
        fixed.steps(1e-3, 1);
        const double force = fixed.measures().force;
        const auto stretch_at = [&](double f) {
            Motion open(mesh, stretching_model(kind, f, true, true), all_terms);
            open.steps(1e-3, 1);
            return open.state.stretch;
        };
        EXPECT_LT(std::abs(stretch_at(force)), 0.02 * std::abs(stretch_at(force + 1)));
    }
}

TEST(FreePeriod, WavesGrowOrDecayAtTheRatesOfItsForce) {
    // Area and volume kept, the tension by theory.md (3.22): with a fixed period this wave would stay as it is.
    for (const auto& [kind, wave] : {std::pair{ModelKind::overdamped, Wave{-4, 1, 5, 8, 10, 30}},
                                     {ModelKind::stokes, {2, 2, 5, 6, 12, 12}},
                                     {ModelKind::fluid, {2, 2, 5, 6, 12, 12}}}) {
        SCOPED_TRACE(static_cast<int>(kind));
        const double pressure = pressure_of_tube(all_terms, 1, wave.tension);
        expect_rate(wave, stretching_model(kind, force_of_tube(all_terms, 1, wave.tension, pressure), true, true));
    }
}

}  // namespace tubule::surface3d::ensembles_test
