// The gradient term kg INT |grad H|^2 dS: derivatives, energies, growth rates, runs, equilibria.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "axisym/curve/shape_integrals.hpp"
#include "axisym/equilibrium/equilibrium_run.hpp"
#include "axisym/equilibrium/spectrum.hpp"
#include "axisym/graph/graph_derivatives.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/case/read.hpp"
#include "common/result/start_frame.hpp"
#include "common/solve/derivative_check.hpp"
#include "common/theory/dispersion.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::axisym::gradient_test {

Bending with_gradients(Bending energy, double kg) {
    energy.kg = kg;
    return energy;
}

Case case_of(const std::string& text) {
    return parse_case(text, {}, "case.toml");
}

void expect_derivatives(const CurveForms& forms, const Eigen::VectorXd& x) {
    const Weights weights{.energy = 0.8, .area = 0.1, .volume = -0.2};
    const auto checked = check_derivatives([&](const Eigen::VectorXd& y) { return forms.value(weights, y); },
                                           [&](const Eigen::VectorXd& y) { return forms.gradient(weights, y); },
                                           [&](const Eigen::VectorXd& y, const Eigen::VectorXd& w) -> Eigen::VectorXd {
                                               return forms.hessian(weights, y) * w;
                                           },
                                           x);
    EXPECT_TRUE(checked.pass()) << checked.text();
}

TEST(Gradients, formsHaveTheirDerivatives) {
    const Bending energy = with_gradients(bending(0.2, -0.7, 0.03, 0.1), 0.4);
    for (const int degree : {3, 5, 7}) {
        const CurveSpace cell(Topology::cell, equal_breaks(8), degree, degree - 1, 0);
        expect_derivatives(CurveForms(cell, energy), fit(cell, meridian(Ellipsoid{1, 1, 1.3})));
    }
    const CurveSpace tube(Topology::tube, equal_breaks(8), 5, 2, 3, true);
    const CurveForms forms(tube, energy);
    const Eigen::VectorXd x = fit(tube, meridian(Tube{1, 3, {{0.1, 1, 0, 0.4}, {0.03, 2, 0, 0}}}));
    expect_derivatives(forms, x);
    // Along z e_z, against the energies of stretched curves, whose difference quotient is exact to its square.
    const auto stretched = [&](double by) {
        Eigen::VectorXd y = x;
        y.tail(y.size() - tube.r().size()) *= 1 + by;
        return forms.value({.energy = 1}, y);
    };
    EXPECT_NEAR(forms.stretch_slope({.energy = 1}, x), (stretched(1e-5) - stretched(-1e-5)) / 2e-5, 1e-7);
    const Cell cell{0, 3, false, 1};
    for (const int degree : {3, 5, 7}) {
        const SplineSpace graph(cell, equal_breaks(12, cell), degree, degree - 1);
        const Eigen::VectorXd r = graph.project([](double z) { return 1 + 0.2 * std::cos(2 * pi * z / 3 + 0.4); });
        for (const TermCheck& one : check_terms(Forms(graph, energy), r))
            EXPECT_TRUE(one.check.pass()) << one.key << one.check.text();
    }
    EXPECT_THROW(CurveForms(CurveSpace(Topology::tube, equal_breaks(8), 3, 1, 3), energy), std::invalid_argument);
}

// Expected: INT |grad H|^2 dS of a torus and an ellipsoid by the trapezoidal rule in their own angles, exact to
// rounding. Errors of the splines have order 2 (degree - 2): 2, 6 and 10.
TEST(Gradients, energiesOfToriAndEllipsoids) {
    constexpr int points = 4000;
    double torus = 0, ellipsoid = 0;
    const double R = 2.2, a = 0.7, c = 1.4;  // H = -(1/a + cos t/(R + a cos t)); below z = c cos t, r = sin t
    for (int i = 0; i < points; ++i) {
        const double t = 2 * pi * (i + 0.5) / points, out = R + a * std::cos(t);
        const double torus_t = R * std::sin(t) / (out * out);
        torus += 2 * pi / points * 2 * pi * out * torus_t * torus_t / a;
        const double s = std::sin(t / 2), co = std::cos(t / 2), g2 = co * co + c * c * s * s, g = std::sqrt(g2);
        // H = -c/g^3 - c/g, dg/dt = (c^2 - 1) sin cos/g
        const double H_t = c * (3 / (g2 * g2) + 1 / g2) * (c * c - 1) * s * co / g;
        ellipsoid += pi / points * 2 * pi * s * H_t * H_t / g;
    }
    const Bending energy = with_gradients(bending(0), 1);
    const Curve shapes[2]{meridian(Torus{R, a}), meridian(Ellipsoid{1, 1, c})};
    const double exact[2]{torus, ellipsoid};
    for (int i = 0; i < 2; ++i) {
        EXPECT_NEAR(bending_energy(shapes[i], energy).energy_kg / exact[i], 1, 1e-9);
        for (const auto& [degree, order, most] : {std::tuple{3, 2.0, 0.1}, {5, 6.0, 1e-4}, {7, 10.0, 1e-6}}) {
            const auto error = [&](int elements) {
                const CurveSpace space(shapes[i].topology, equal_breaks(elements), degree, degree - 1, 0);
                const CurveForms forms(space, energy);
                // The projection has the error of the elements in third derivatives, whose square the energy of the
                // best approximation loses: the equilibria below show that order; here 2 (degree - 2) of the energy.
                return std::abs(forms.observe(fit(space, shapes[i])).energy_kg / exact[i] - 1);
            };
            const double coarse = error(16), fine = error(32);
            EXPECT_LT(fine, most) << degree << " " << i;
            if (fine > 1e-9) {
                EXPECT_GT(std::log2(coarse / fine), order - 1) << degree << " " << i;
            }
        }
    }
}

// Straight tubes and spheres, theory.md (5.28) and (6.11): rates of the second variation for m = 0 ... 5.
TEST(Gradients, ratesOfTubesAndSpheres) {
    const MotionLaw flow{.friction = 1, .inextensible = false, .keeps_volume = false};
    const double R = 0.8, length = 3;
    for (const Bending& energy :
         {with_gradients(bending(0.3, -0.4, 0.02, 0.15), 0.05), with_gradients(bending(-0.5, 0, 0.1), 0.2),
          with_gradients(bending(0.5, 0, 0, -0.6), 0.3)}) {
        SpectrumSettings settings;
        settings.last = 5, settings.count = 4, settings.accuracy = 1e-6;
        theory::UniformTube tube{energy, R, 0};
        tube.tension = theory::tension_of_free_volume(energy, R);
        settings.sigma = tube.tension;
        const Spectrum found = spectrum(energy, flow, Held::nothing, meridian(Tube{R, length, {}}), settings);
        for (int m = 0; m <= 5; ++m) {
            std::vector<double> expected;
            for (int n = m == 1 ? 1 : 0; n < 12; ++n)
                for (int copy = 0; copy < (n == 0 ? 1 : 2); ++copy)
                    expected.push_back(-theory::stiffness(tube, m)(2 * pi * n / length));
            std::sort(expected.rbegin(), expected.rend());
            for (int i = 0; i < 4; ++i)
                EXPECT_NEAR(found.modes[m].rates[i], expected[i], 1e-6 * std::max(1.0, std::abs(expected[i])))
                    << "tube, m = " << m << ", " << i;
        }
        theory::UniformSphere sphere{energy, R};
        settings.sigma = 0, settings.pressure = theory::pressure_at_rest(sphere);
        const Spectrum round = spectrum(energy, flow, Held::nothing, meridian(Sphere{R, {}}), settings);
        for (int m = 0; m <= 5; ++m) {
            std::vector<double> expected;
            for (int l = m; l < m + 12; ++l)
                if (l != 1) expected.push_back(-theory::stiffness(sphere, l));
            std::sort(expected.rbegin(), expected.rend());
            for (int i = 0; i < 3; ++i)
                EXPECT_NEAR(round.modes[m].rates[i], expected[i], 1e-6 * std::max(1.0, std::abs(expected[i])))
                    << "sphere, m = " << m << ", " << i;
        }
    }
}

// Waves on tubes that their tension holds, of 20 random energies: growth in runs of graphs and of profile curves
// against theory.md (5.28).
TEST(Gradients, wavesFollowTheDispersionRelation) {
    std::mt19937 random(7);
    const auto uniform = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
    for (int i = 0; i < 20; ++i) {
        const double R = uniform(0.7, 1.3), length = uniform(2, 8), amplitude = 1e-5;
        const int n = 1 + i % 3;
        const Bending energy = with_gradients(
            bending(uniform(-0.5, 0.5), uniform(-1.5, 0.5), uniform(0, 0.1), uniform(-0.2, 0.3)), uniform(0.05, 0.3));
        const theory::UniformTube tube{energy, R, theory::tension_of_free_volume(energy, R)};
        const double rate = -theory::stiffness(tube, 0)(2 * pi * n / length), end = std::min(0.5, 1 / std::abs(rate));
        Case c = tube_case(energy, R, length, {{amplitude, n, 0, 0.3}}, end);
        c.model.tension = Ramp(tube.tension);
        explicitly(c, 12 * n + 12, 1e-12, 7);
        if (i % 2 == 1) c.discretisation.parametrisation = Parametrisation::even;
        const Outcome o = run_case(c);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        const double measured = std::log(o.last("mode_" + std::to_string(n)) / amplitude);
        EXPECT_NEAR(measured, rate * end, 1e-6) << i << ", rate " << rate;
    }
}

// Ill-posed without the term, with it a random tube grows to the wave that theory selects.
TEST(Gradients, theSelectedWaveGrows) {
    const Bending energy = with_gradients(bending(0.5, -1, 0, -1.2), 0.02);
    const double length = 20, R = 1;
    const theory::UniformTube tube{energy, R, 0};
    const MotionLaw flow{.friction = 1, .inextensible = false, .keeps_volume = false};
    EXPECT_TRUE(theory::ill_posed_along({bending(0.5, -1, 0, -1.2), R, 0}));
    EXPECT_FALSE(theory::ill_posed_along(tube));
    const auto fastest = theory::fastest_wave(tube, flow, 0);
    ASSERT_TRUE(fastest);
    std::vector<TubeMode> modes;
    for (int n = 1; n <= 20; ++n) modes.push_back({1e-8, n, 0, 2.0 * n * n});
    Case c = tube_case(energy, R, length, modes, 12 / fastest->rate);
    explicitly(c, 160, 1e-9);
    const Outcome o = run_case(c);
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    int largest = 1;
    const auto amplitude = [&](int n) { return o.last("mode_" + std::to_string(n)); };
    for (int n = 2; n <= 20; ++n)
        if (amplitude(n) > amplitude(largest)) largest = n;
    EXPECT_NEAR(largest / (fastest->q * length / (2 * pi)), 1, 0.5 / largest + 0.02);
    EXPECT_GT(amplitude(largest), 3e-4);
}

// Free and kinetic energy fall by what is dissipated, in all models, along a cell whose gradient term does most of it.
TEST(Gradients, energyIsDissipated) {
    for (const char* model : {"kind = \"gradient-flow\"", "kind = \"overdamped\"\ngamma = 1",
                              "kind = \"stokes\"\nRe = 1", "kind = \"fluid\"\nRe = 1"}) {
        const Outcome o =
            run_case(case_of(std::string("tier = \"axisym\"\n[energy]\nk20 = -0.1\nk40 = 0.05\nkg = 0.3\n"
                                         "[shape]\nkind = \"ellipsoid\"\na = 1\nb = 1\nc = 1.4\n[time]\nend = 0.05\n"
                                         "[accuracy]\nenergy = 1e-6\n[model]\n") +
                             model));
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        EXPECT_GT(o["energy_kg"].front(), 0.3) << model;
        EXPECT_LT(std::abs(o.last("identity_defect")), 1e-5 * o.summary.reference_energy) << model;
        EXPECT_LT(o.last("energy"), o["energy"].front()) << model;
    }
}

// Elements too long for the waves that the gradient term alone holds.
TEST(Gradients, unresolvedWavesStopARun) {
    Case c = tube_case(with_gradients(bending(-5), 0.02), 1, 4, {{1e-3, 1, 0, 0}}, 1e-5);
    c.accuracy.energy = 1e-3;  // a run that chooses its own elements has enough
    EXPECT_EQ(run_case(c).summary.stop.reason, Stop::finished);
    explicitly(c, 20, 1e-6);
    for (const auto how : {Parametrisation::graph, Parametrisation::even}) {
        c.discretisation.parametrisation = how;
        const Outcome o = run_case(c);
        EXPECT_EQ(o.summary.stop.reason, Stop::resolution_lost);
        EXPECT_CONTAINS(o.summary.stop.message, "which only the gradient term damps waves");
    }
}

// A graph and a curve of the same tube: energy, force, dissipation.
TEST(Gradients, graphsAndCurvesAgree) {
    Case c = tube_case(with_gradients(bending(0.5, 0, 0.02), 0.2), 1, 8, {{0.2, 1, 0, 0}, {0.1, 2, 0, 1}}, 0.1);
    c.accuracy.energy = 1e-7;
    const Outcome graph = run_case(c);
    c.discretisation.parametrisation = Parametrisation::even;
    const Outcome curve = run_case(c);
    for (const char* name : {"energy", "energy_kg", "force", "dissipation"})
        EXPECT_NEAR(graph.last(name), curve.last(name), 1e-6 * graph.summary.reference_energy) << name;
    EXPECT_GT(graph.last("energy_kg"), 1e-3);
}

// Where the moduli are well posed, what is known without the term returns as kg -> 0, with the first power of kg.
TEST(Gradients, vanishWithKg) {
    const auto energy = [](double kg) {
        const StationaryProblem problem{with_gradients(bending(0.5), kg),
                                        {.area = 4 * pi, .volume = 0.8 * 4 * pi / 3, .reduced_volume = {}}};
        const Equilibrium e = find_equilibrium(problem, meridian(Ellipsoid{0.8, 0.8, 1.4}), {.accuracy = 1e-11});
        EXPECT_EQ(e.stop, Stop::finished) << e.message;
        return e.observed.energy;
    };
    const double without = energy(0), first = (energy(1e-3) - without) / 1e-3, second = (energy(1e-4) - without) / 1e-4;
    EXPECT_GT(first, 1);
    EXPECT_NEAR(first / second, 1, 2e-2);
}

// A smooth capsule is where it says, and its energy is finite, as that of the limit from sharp ones is not.
TEST(Gradients, smoothCapsules) {
    const Capsule c{0.5, 2, 0.2};
    const Curve m = meridian(c);
    for (int i = 0; i <= 40; ++i) {
        const auto [r, r1, z, z1] = m.at(i / 40.0);
        const auto u = [&](double x) { return (x + std::hypot(x, c.smooth)) / 2; };
        const auto du = [&](double x) { return (1 + x / std::hypot(x, c.smooth)) / 2; };
        const double s = u(z - 1) + u(-z - 1);
        EXPECT_NEAR(r * r + s * s, 0.25, 1e-13);
        EXPECT_NEAR(r * r1 + s * (du(z - 1) - du(-z - 1)) * z1, 0, 1e-12);
    }
    const auto kg_of = [](double smooth) {
        return bending_energy(meridian(Capsule{0.5, 2, smooth}), with_gradients(bending(1), 1)).energy_kg;
    };
    EXPECT_GT(kg_of(0.1), 1.5 * kg_of(0.2));  // as 1/smooth in the end
    const Outcome o =
        run_case(case_of("tier = \"axisym\"\n[energy]\nk20 = 0.5\nkg = 0.02\n[shape]\nkind = \"capsule\"\nradius = "
                         "0.5\nlength = 2\nsmooth = "
                         "0.2\n[model]\nkind = \"stokes\"\n[time]\nend = 0.01\n[accuracy]\nenergy = 1e-4\n"));
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    EXPECT_LT(o.last("energy_kg"), o["energy_kg"].front());
    EXPECT_CONTAINS(
        test::message_of([] {
            case_of(
                "tier = \"axisym\"\n[energy]\nk20 = 1\n[shape]\nkind = \"capsule\"\nradius = 0.5\nlength = 2\nsmooth = "
                "0.3\n[time]\nend = 1\n");
        }),
        "shape.smooth must be at most half of shape.radius");
}

// A frame of a result begins a run with the gradient term; one of a patch is refused.
TEST(Gradients, framesAsInitialShapes) {
    const auto begun = [](const std::string& first, const std::string& set) {
        const Outcome before = run_case(case_of(first));
        Result result;
        result.frames = {before.log.frames.back()};
        Case c = case_of(
            "tier = \"axisym\"\n[energy]\nk20 = 0.5\nkg = 0.1\n[shape]\nkind = \"result\"\npath = \"x.hdf\"\nframe = "
            "0\n[time]\nend = 0.001\n" +
            set);
        c.input = frame_as_input(std::get<ResultFrame>(c.shape), result);
        return run_case(c);
    };
    const std::string head = "tier = \"axisym\"\n[energy]\nk20 = 0.5\n[time]\nend = 0.001\n[shape]\n";
    const Outcome o = begun(head + "kind = \"ellipsoid\"\na = 1\nb = 1\nc = 1.4\n", "");
    EXPECT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    EXPECT_GT(o.last("energy_kg"), 0.1);
    EXPECT_CONTAINS(test::message_of([&] { begun(head + "kind = \"patch\"\nradius = 1\nheight = 0.3\n", ""); }),
                    "energy.kg must be 0 where the shape is a patch");
}

}  // namespace tubule::axisym::gradient_test
