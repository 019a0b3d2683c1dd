// Linear theory against the axisymmetric tier: its linearised operators, its spectra, growth in its runs.
#include "axisym/equilibrium/spectrum.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "axisym/equilibrium/profile_modes.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/case/read.hpp"
#include "common/result/frame_profile.hpp"
#include "common/solve/dense.hpp"
#include "common/theory/dispersion.hpp"
#include "common/theory/growth_fit.hpp"
#include "common/theory/waves.hpp"
#include "tests/axisym/runs.hpp"

namespace tubule::axisym::spectrum_test {

using theory::UniformSphere;
using theory::UniformTube;

MotionLaw law_of(ModelKind kind, double Re = 1, std::optional<double> gamma = {}) {
    return motion_law({.kind = kind, .Re = Re, .gamma = gamma, .keeps_volume = {}});
}

TEST(Dispersion, theGraphsLinearisedOperator) {
    // Closed forms, theory.md (5.6) (m = 0, q = 0 included: d(dR/dt)/dR), against the eigenvalues of the discrete
    // Jacobian at a tube, whose radius drifts: dF/dx w + s M w = 0. Errors are relative to the rate, or to 1.
    // The last four: terms that a case adds, whose Hessian in (H, K) is definite, indefinite, that are odd, a formula.
    for (const UniformTube& tube :
         {UniformTube{bending(0.3, -0.4, 0.02, 0.15), 0.8}, UniformTube{bending(0.2), 1},
          UniformTube{bending(0.2, -1.5, 0, 0.06), 0.6},
          UniformTube{with_terms(bending(0.2, -1.5), {powers(0.02, 6, 0), powers(0.1, 4, 2)}), 0.6},
          UniformTube{with_terms(bending(0.2, -0.4), {powers(0.05, 2, 1)}), 0.8},
          UniformTube{with_terms(bending(0.2, -0.5), {powers(-0.03, 3, 0), powers(0.02, 1, 1)}), 0.8},
          UniformTube{with_terms(bending(0.2, -0.5), {formula(0.3, "sqrt(1 + (H - H0)^2 + K^2) + exp(H)*K")}), 0.8}}) {
        const double length = 3;
        const Cell cell{0, length, false, 1};
        const SplineSpace space(cell, equal_breaks(32, cell), 7, 6);
        const Forms forms(space, tube.energy);
        const Eigen::VectorXd x = space.project([&](double) { return tube.radius; }), rate = forms.rate(x);
        EXPECT_NEAR(rate.mean(), radius_rate(tube), 1e-9);
        Eigen::SparseMatrix<double> J = forms.pattern();
        forms.jacobian(x.data(), rate.data(), 0, J.valuePtr());
        const Eigen::MatrixXd A = J, M = forms.mass(x);
        const Eigen::VectorXcd found = general_eigenpairs(-solve_dense(M, A))->values;
        for (int n = 0; n <= 5; ++n) {
            const double q = 2 * pi * n / length, s = growth(tube, law_of(ModelKind::gradient_flow), q, 0).rate();
            std::vector<double> distance;
            for (const auto& value : found) distance.push_back(std::abs(value - s));
            std::sort(distance.begin(), distance.end());
            // Rounding: 1e-16 of the largest eigenvalue, which is that of waves as short as the elements.
            for (int copy = 0; copy < (n == 0 ? 1 : 2); ++copy)
                EXPECT_LT(distance[copy], 1e-8 * std::max(std::abs(s), 1.0)) << "n = " << n << ", s = " << s;
        }
    }
}

TEST(Dispersion, spectraOfTubesAndSpheres) {
    // Closed forms of all m against the numerical spectrum of the same shape.
    const Bending listed = bending(0.3, -0.4, 0.02, 0.15);
    const Bending more = with_terms(bending(0.3, -0.4, 0.02, 0.15),
                                    {powers(0.02, 2, 1), powers(-0.01, 3, 0), formula(0.1, "sqrt(1 + H^2 + K^2)")});
    const double R = 0.8, length = 3;
    const Curve tube = meridian(Tube{R, length, {}});
    const Curve sphere = meridian(Sphere{1.2, {}});
    for (const auto& [energy, law] : {std::pair{listed, law_of(ModelKind::gradient_flow)},
                                      {listed, law_of(ModelKind::overdamped)},
                                      {listed, law_of(ModelKind::stokes, 2, 0.3)},
                                      {more, law_of(ModelKind::gradient_flow)},
                                      {more, law_of(ModelKind::stokes, 2, 0.3)}}) {
        SpectrumSettings settings;
        settings.accuracy = 1e-8;
        const Spectrum found = spectrum(energy, law, held_by(law), tube, settings);
        const bool flows = law.inextensible;
        // Least multipliers that hold a tube: sigma/R + lambda = b0. Any of these give its rates for their tension.
        const double b0 = radius_rate(UniformTube{energy, R});
        if (flows) {
            EXPECT_NEAR(found.sigma / R + found.lambda, b0, 1e-8);
        }
        const UniformTube exact{energy, R, found.sigma};
        ASSERT_EQ(found.modes.size(), 3u);
        for (int m = 0; m <= 2; ++m) {
            std::vector<double> expected;
            for (int n = 0; n <= 4; ++n) {
                if (n == 0 && (m == 1 || (m == 0 && flows))) continue;  // rigid, or kept
                expected.insert(expected.end(), n > 0 ? 2 : 1, growth(exact, law, 2 * pi * n / length, m).rate());
            }
            std::sort(expected.begin(), expected.end(), std::greater<>());
            for (int i = 0; i < 3; ++i)
                EXPECT_NEAR(found.modes[m].rates[i] / expected[i], 1, 1e-8) << "m " << m << ", rate " << i;
        }
        EXPECT_LT(found.estimated_error, 1e-6);
        const Spectrum round = spectrum(energy, law, held_by(law), sphere, settings);
        for (int m = 0; m <= 2; ++m)
            for (int i = 0; i < 2; ++i) {
                const UniformSphere ball{energy, 1.2, round.sigma};
                std::vector<double> expected;
                for (int l = m == 1 ? 2 : flows ? std::max(m, 2) : m; l <= 5; ++l)
                    if (l != 1) expected.push_back(growth(ball, law, l).rate());
                std::sort(expected.begin(), expected.end(), std::greater<>());
                EXPECT_NEAR(round.modes[m].rates[i] / expected[i], 1, 1e-8) << "m " << m << ", rate " << i;
            }
    }
}

TEST(Dispersion, shapesWithoutASpectrumAreRefused) {
    const Curve wavy = meridian(Tube{1, 3, {{0.2, 1, 0, 0}}});
    const Curve straight = meridian(Tube{1, 3, {}});
    const auto found = [](MotionLaw law, const Curve& shape) {
        return spectrum(bending(1), law, held_by(law), shape).modes.size();
    };
    EXPECT_EQ(found(law_of(ModelKind::gradient_flow), wavy), 3u);
    EXPECT_THROW(found(law_of(ModelKind::overdamped), wavy), std::invalid_argument);
    EXPECT_THROW(found(law_of(ModelKind::fluid), straight), std::invalid_argument);
    MotionLaw fed = law_of(ModelKind::overdamped);
    fed.reservoir = true, fed.keeps_volume = false;
    EXPECT_THROW(found(fed, wavy), std::invalid_argument);
    MotionLaw stretches = law_of(ModelKind::overdamped);
    stretches.free_period = true;
    EXPECT_THROW(found(stretches, straight), std::invalid_argument);  // of m = 0
}

// theory.md (5.8) to (5.10) at the tension of a reservoir or of a gradient flow, below and above the threshold of
// pearling; with free volume also a change of the radius, whose rate is the slope of theory.md (3.21).
TEST(Dispersion, atATensionThatIsGiven) {
    const Bending energy = bending(0.5, -0.7, 0.03, 0.1);
    const double length = 9;
    for (const double tension : {0.1, 2.5})
        for (const bool keeps_volume : {true, false})
            for (const ModelKind kind : {ModelKind::gradient_flow, ModelKind::overdamped, ModelKind::stokes}) {
                MotionLaw law = law_of(kind, 2, 0.3);
                const UniformTube tube{energy, 1, tension};
                law.reservoir = law.inextensible, law.keeps_volume = keeps_volume, law.tension = tension;
                if (!keeps_volume) law.pressure = theory::pressure_at_rest(tube);
                SpectrumSettings settings;
                settings.sigma = tension, settings.pressure = law.pressure.at(0), settings.accuracy = 1e-9;
                settings.count = 1;
                const Spectrum found = spectrum(energy, law, held_by(law), meridian(Tube{1, length, {}}), settings);
                for (int m = 0; m <= 2; ++m) {
                    double fastest = -1e300;
                    for (int n = m == 2 ? 0 : 1; n < 12; ++n)
                        fastest = std::max(fastest, growth(tube, law, 2 * pi * n / length, m).rate());
                    if (m == 0 && !keeps_volume) {
                        const double h = 1e-5;
                        fastest = std::max(fastest, (theory::radius_rate_of(law, {energy, 1 + h, tension}) -
                                                     theory::radius_rate_of(law, {energy, 1 - h, tension})) /
                                                        (2 * h));
                    }
                    EXPECT_NEAR(found.modes[m].rates[0], fastest, 1e-8 * std::max(1.0, std::abs(fastest)))
                        << name({.kind = kind, .keeps_volume = {}}) << ", m " << m << ", tension " << tension
                        << keeps_volume;
                }
            }
}

// A pressure that depends on the volume adds -dP/dV 4 pi R^2 to the stiffness of l = 0 alone: theory.md (3.24), (6.3).
TEST(Dispersion, underAPressureOfTheVolume) {
    const Bending energy = bending(0.5, -0.3, 0.02, 0.06);
    const theory::UniformSphere sphere{energy, 1};
    const double P = theory::pressure_at_rest(sphere), V = 4 * pi / 3, N = 60;
    const std::string_view variables[]{"V"};
    MotionLaw law{.friction = 1, .inextensible = false, .keeps_volume = false};
    law.pressure_of_volume =
        std::make_shared<const Formula>(parse_formula(fmt::format("{:.17g} + 60*(1/V - 1/{:.17g})", P, V), variables));
    SpectrumSettings settings;
    settings.last = 0, settings.accuracy = 1e-9;
    set_loads(settings, law, Held::nothing, 0);
    const Spectrum found = spectrum(energy, law, Held::nothing, meridian(Sphere{1, {}}), settings);
    EXPECT_TRUE(found.at_rest());
    EXPECT_NEAR(-found.lambda, P, 1e-9);
    std::vector<double> expected{-theory::stiffness(sphere, 0) - N / (V * V) * 4 * pi, -theory::stiffness(sphere, 2),
                                 -theory::stiffness(sphere, 3), -theory::stiffness(sphere, 4)};
    std::sort(expected.rbegin(), expected.rend());
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(found.modes[0].rates[i], expected[i], 1e-7 * std::abs(expected[i])) << i;
}

TEST(Dispersion, wavesAroundTheAxisAlone) {
    // With m >= 1 nothing needs to be held: the closed forms of a tube whose volume is free, at the tension that holds
    // it, and the same rates as beside those of m = 0.
    MotionLaw free = law_of(ModelKind::overdamped);
    free.keeps_volume = false;
    const Bending energy = bending(0.3, -1.6, 0, 0.15);
    const double R = 0.8, length = 3;
    SpectrumSettings around;
    around.first = 1, around.count = 1, around.accuracy = 1e-8;
    const Curve tube = meridian(Tube{R, length, {}});
    const Spectrum found = spectrum(energy, free, held_by(free), tube, around);
    const UniformTube exact{energy, R, theory::tension_of_free_volume(energy, R)};
    EXPECT_NEAR(found.sigma, exact.tension, 1e-8);
    ASSERT_EQ(found.modes.size(), 2u);
    for (int m = 1; m <= 2; ++m) {
        EXPECT_EQ(found.modes[m - 1].m, m);
        double fastest = -1e300;
        for (int n = m == 1 ? 1 : 0; n <= 3; ++n)
            fastest = std::max(fastest, growth(exact, free, 2 * pi * n / length, m).rate());
        EXPECT_NEAR(found.modes[m - 1].rates[0] / fastest, 1, 1e-8) << m;
    }
    // In motion: those of the gradient flow at this instant, whatever is held; of what flows, an estimate that says so.
    const Curve wavy = meridian(Tube{1, 3, {{0.2, 1, 0, 0}}});
    const MotionLaw gradient = law_of(ModelKind::gradient_flow);
    const Spectrum whole = spectrum(bending(1), gradient, Held::nothing, wavy),
                   part = spectrum(bending(1), gradient, Held::nothing, wavy, around);
    EXPECT_NEAR(part.modes[0].rates[0] / whole.modes[1].rates[0], 1, 1e-5);
    EXPECT_FALSE(spectrum(bending(1), free, held_by(free), wavy, around).at_rest());
    EXPECT_THROW(spectrum(bending(1), law_of(ModelKind::fluid), Held::nothing, wavy, around), std::invalid_argument);
}

TEST(ProfileModes, ofTubesAndCells) {
    // Exact: the amplitudes the shapes were given. Of a sphere the middle of the volume is off by products of them.
    const Curve tube = meridian(Tube{1.1, 3, {{0.2, 1, 0, 0.3}, {0.05, 3, 0, 1}}});
    EXPECT_NEAR(mean_radius(tube), 1.1, 1e-13);
    EXPECT_NEAR(mode_amplitude(tube, 1), 0.2, 1e-13);
    EXPECT_NEAR(mode_amplitude(tube, 2), 0, 1e-13);
    EXPECT_NEAR(mode_amplitude(tube, 3), 0.05, 1e-13);
    const Curve cell = meridian(Sphere{1.2, {{1e-4, 2, 0}, {2e-4, 5, 0}}});
    EXPECT_NEAR(mean_radius(cell), 1.2, 1e-7);
    EXPECT_NEAR(mode_amplitude(cell, 2), 1e-4, 2e-7);
    EXPECT_NEAR(mode_amplitude(cell, 5), 2e-4, 2e-7);
    EXPECT_THROW(mode_amplitude(cell, 1), std::invalid_argument);
    EXPECT_THROW(mode_amplitude(tube, 0), std::invalid_argument);
    EXPECT_THROW(mode_amplitude(meridian(Torus{2, 1}), 2), std::invalid_argument);
}

// The fitted rate from the frames of a run.
theory::GrowthFit fit_of_frames(const std::vector<Record>& frames, int n) {
    std::vector<double> times, amplitudes;
    for (const Record& frame : frames) {
        times.push_back(frame.time);
        amplitudes.push_back(mode_amplitude(meridian(frame_curve(frame)), n));
    }
    return theory::fit_growth(times, amplitudes);
}

std::vector<double> equally_spaced(double end, int n) {
    std::vector<double> times;
    for (int i = 1; i < n; ++i) times.push_back(end * i / n);
    return times;
}

TEST(Growth, fittedToRunsAtThePreferredRadius) {
    // H0 = -1/R, radius at rest: omega = -(2 k20/R^4)[(1 + beta) x^2 - 2 x + 1], theory.md (5.27): grows for k42 < 0,
    // neutral at q R = 1 for k42 = 0, decays for k42 > 0. Amplitudes stay below 3e-5 of R, so that their squares are
    // below 1e-9.
    for (const auto& [k42, length, end] : {std::tuple{-0.1, 2 * pi, 5.0}, {0.05, 2 * pi, 10.0}, {0.0, 9.0, 6.0}}) {
        Case c = tube_case(bending(0.2, -1, 0, k42), 1, length, {{1e-5, 1, 0, 0.3}}, end, equally_spaced(end, 12));
        explicitly(c, 24, 1e-12, 7);
        const Outcome o = run_case(c);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        const UniformTube tube{c.energy, 1};
        const double exact = growth(tube, motion_law(c.model), 2 * pi / length, 0).rate();
        EXPECT_EQ(exact > 0, k42 < 0);
        const auto frames = fit_of_frames(o.log.frames, 1), series = theory::fit_growth(o["time"], o["mode_1"]);
        EXPECT_NEAR(frames.rate / exact, 1, 1e-6) << k42;
        EXPECT_NEAR(series.rate / exact, 1, 1e-6) << k42;
        EXPECT_LT(frames.error, 1e-5 * std::abs(exact));
    }
}

TEST(Growth, fittedToAFlowWithFreeVolume) {
    // Models that flow keep the area. With the volume free too, the tension is known, theory.md (5.5), and a single
    // wave follows theory.md (5.9), (5.10); a fluid its fastest root, after the others have died.
    for (const ModelKind kind : {ModelKind::overdamped, ModelKind::stokes, ModelKind::fluid}) {
        const double length = 9, end = kind == ModelKind::fluid ? 30 : 10;
        Case c = tube_case(bending(1, -1.3, 0, 0.05), 1, length, {{1e-4, 1, 0, 0}}, end, equally_spaced(end, 20));
        c.model = {.kind = kind, .Re = 2, .gamma = 0.3, .keeps_volume = false};
        c.accuracy.energy = 1e-8;
        const Outcome o = run_case(c);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        const UniformTube tube{c.energy, 1, theory::tension_of_free_volume(c.energy, 1)};
        const double exact = growth(tube, motion_law(c.model), 2 * pi / length, 0).rate();
        const auto fit = fit_of_frames(o.log.frames, 1);
        EXPECT_NEAR(fit.rate / exact, 1, 1e-3) << exact << " found " << fit.rate << " +- " << fit.error;
        const auto waves = theory::waves_in_time(tube, motion_law(c.model), length, {{1, 0, 1e-4}}, {end});
        EXPECT_NEAR(o.last("mode_1") / std::abs(waves[0].amplitudes[0]), 1, 2e-3);
    }
}

}  // namespace tubule::axisym::spectrum_test
