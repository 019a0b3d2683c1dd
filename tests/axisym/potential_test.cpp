// Potentials of places: derivatives, spheres around a particle, vesicles at a wall.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "axisym/equilibrium/equilibrium_run.hpp"
#include "axisym/equilibrium/mode_stability.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/solve/derivative_check.hpp"
#include "common/theory/dispersion.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::axisym::potential_test {

using Kind = Potential::Kind;
using Law = Potential::Law;

Bending with_potentials(Bending energy, std::vector<Potential> potentials) {
    energy.potentials = std::move(potentials);
    return energy;
}

Potential particle(double radius, double strength, double range) {
    return {.kind = Kind::sphere, .radius = radius, .strength = strength, .range = range};
}

Potential field(const std::string& formula) {
    return {.kind = Kind::formula,
            .formula = std::make_shared<const Formula>(parse_formula(formula, Potential::variables))};
}

// Each law has its minimum, -strength, at the distance `range`, on either side of a wall.
TEST(Potential, hasItsMinimumAtTheRange) {
    for (const Law law : {Law::morse, Law::nine_three})
        for (const Kind kind : {Kind::plane, Kind::sphere})
            for (const bool behind : {false, true}) {
                const Potential p{
                    .kind = kind, .z = -0.3, .radius = 2, .behind = behind, .law = law, .strength = 0.7, .range = 0.2};
                const auto W = [f = *potential_density(std::span(&p, 1))](double r, double z) {
                    const double place[]{r, z};
                    return evaluate(f, place);
                };
                const double sign = behind ? -1 : 1, wall = kind == Kind::plane ? -0.3 : 1.7, z = wall + sign * 0.2;
                EXPECT_NEAR(p.distance(0, z), 0.2, 1e-14);
                EXPECT_NEAR(W(0, z), -0.7, 1e-14);
                EXPECT_NEAR(W(0, z + 1e-4) - W(0, z - 1e-4), 0, 3e-8);
                EXPECT_GT(W(0, wall + sign * 0.1), W(0, z));
                EXPECT_LT(p.distance(0, wall - sign * 0.1), 0);
            }
}

TEST(Potential, formsHaveTheirDerivatives) {
    const Potential wall{.z = -1.7, .strength = 0.4, .range = 0.3}, formula = field("0.3*z*exp(-r^2) + 0.1*sin(z)");
    Potential round = particle(0.4, 0.5, 0.2);
    round.z = 1.9, round.law = Law::nine_three;
    const Bending at_walls = with_potentials(bending(0.2, -0.7, 0.03, 0.1), {wall, round, formula});
    const Curve closed = meridian(Ellipsoid{1, 1, 1.3}), tube = meridian(Tube{1.1, 3, {}});
    const Bending in_tube = with_potentials(bending(0.2, -0.7), {field("0.3*r^2*cos(2*pi*z/3)")});
    for (const auto& [shape, energy] : {std::pair(closed, at_walls), std::pair(tube, in_tube)}) {
        const CurveSpace space(shape.topology, equal_breaks(8), 5, 4, shape.length);
        const CurveForms forms(space, energy);
        const Weights weights{.energy = 0.8, .area = 0.1, .volume = -0.2};
        const auto checked =
            check_derivatives([&](const Eigen::VectorXd& x) { return forms.value(weights, x); },
                              [&](const Eigen::VectorXd& x) { return forms.gradient(weights, x); },
                              [&](const Eigen::VectorXd& x, const Eigen::VectorXd& w) -> Eigen::VectorXd {
                                  return forms.hessian(weights, x) * w;
                              },
                              fit(space, shape));
        EXPECT_TRUE(checked.pass()) << checked.text();
    }
}

// A straight tube in a field W(r), without tension: in equilibrium where k20/R^2 = W + R W', its waves stiffer by
// W'' + W'/R than under the tension W. Nothing holds it along the axis.
TEST(Potential, tubesInAField) {
    const double k20 = 0.5, length = 3;
    double R = 1;
    const auto jet = [&](double r) { return std::array{0.3 + 0.4 * (r - 1.2) * (r - 1.2), 0.8 * (r - 1.2), 0.8}; };
    for (int i = 0; i < 50; ++i) {
        const auto [W, W1, W2] = jet(R);
        R -= (W + R * W1 - k20 / (R * R)) / (2 * W1 + R * W2 + 2 * k20 / (R * R * R));
    }
    const auto [W, W1, W2] = jet(R);
    const StationaryProblem problem{with_potentials(bending(k20), {field("0.3 + 0.4*(r - 1.2)^2")}), {}};
    const Curve start = half(meridian(Tube{R + 0.1, length, {}}));
    const Equilibrium e = find_equilibrium(problem, start, {.accuracy = 1e-10, .elements = 16});
    ASSERT_EQ(e.stop, Stop::finished) << e.message;
    EXPECT_NEAR(e.observed.r_max, R, 1e-8);
    EXPECT_NEAR(e.observed.energy, 2 * pi * length * (k20 / R + R * W), 1e-8);
    EXPECT_NEAR(axial_force(problem, e), 2 * pi * (k20 / R + R * W), 1e-8);
    EXPECT_EQ(e.observed.potential.force, 0);
    const MotionLaw flow{.friction = 1, .inextensible = false, .keeps_volume = false};
    const theory::UniformTube tube{bending(k20), R, W};
    for (int m = 0; m <= 2; ++m) {
        std::vector<double> expected;
        for (int n = 0; n <= 3; ++n)
            expected.insert(expected.end(), n > 0 ? 2 : 1,
                            -theory::stiffness(tube, m)(2 * pi * n / length) - W2 - W1 / R);
        std::sort(expected.rbegin(), expected.rend());
        const ModeRates found = ModeStability(problem, e).rates(m, flow, 4);
        for (int i = 0; i < 4; ++i) EXPECT_NEAR(found.rates[i], expected[i], 1e-5 * std::abs(expected[i])) << m << i;
    }
}

// A tube that a periodic field makes wavy: its end is the equilibrium, where dE/dL is the force; the energy balances.
TEST(Potential, tubesFollowAPeriodicField) {
    const std::string text =
        "tier = \"axisym\"\n[energy]\nk20 = 0.5\n[[energy.potential]]\nkind = \"formula\"\nformula = "
        "\"0.3*r^2 + 0.1*cos(2*pi*z/3)\"\n[model]\nkind = \"gradient-flow\"\narea = \"free\"\n"
        "[shape]\nkind = \"tube\"\nradius = 0.8\nlength = 3\n[accuracy]\nenergy = 1e-6\n";
    const auto run = [&](const std::string& more, const std::vector<std::string>& sets = {}) {
        return run_case(parse_case(text + more, sets, "case.toml"));
    };
    const Outcome o = run("[time]\nend = 100\nstationary = 1e-9\n");
    ASSERT_EQ(o.summary.stop.reason, Stop::stationary) << o.summary.stop.message;
    EXPECT_GT(o.last("r_max"), 1.01 * o.last("r_min"));
    for (const double defect : o["identity_defect"]) EXPECT_LT(std::abs(defect), 1e-5 * o.summary.reference_energy);
    const Outcome e = run_shapes(parse_case(text + "[equilibrium]\nheld = \"nothing\"\nmodes = 0\n", {}, "case.toml"));
    ASSERT_EQ(e.summary.stop.reason, Stop::finished) << e.summary.stop.message;
    EXPECT_NEAR(e.last("energy"), o.last("energy"), 1e-6 * o.summary.reference_energy);
    EXPECT_NEAR(e.last("force"), o.last("force"), 1e-4 * e.last("force"));
    EXPECT_LT(e.last("growth_0"), 0);
    EXPECT_EQ(e.last("negative_directions"), 0);
    const auto refusal = [&](const std::string& formula) {
        return test::message_of<CaseError>(
            [&] { run("[time]\nend = 1\n", {"energy.potential.0.formula=" + formula}); });
    };
    EXPECT_CONTAINS(refusal("cos(z)"), "must have the period 3 of the tube");
}

// A sphere about a particle: 16 pi k20 + 4 pi R^2 W, stationary where R W' + 2 W = 0; waves l of it cost, beside
// bending, W'' + 4 W'/R + (2 + l (l + 1)) W/R^2 (theory.md (2.22)). At the strength 4 k20/R^2, where wrapping pays, the
// energy of the range 0 is zero.
TEST(Potential, spheresWrapAParticle) {
    const double k20 = 0.5, particle_radius = 0.9, range = 0.2, w = 1.3;
    const auto jet = [&](double R) {
        const double e = std::exp(-(R - particle_radius - range) / range);
        return std::array{w * (e * e - 2 * e), -2 * w / range * (e * e - e), 2 * w / (range * range) * (2 * e * e - e)};
    };
    double R = particle_radius + range;
    for (int i = 0; i < 50; ++i) {
        const auto [W, W1, W2] = jet(R);
        R -= (R * W1 + 2 * W) / (3 * W1 + R * W2);
    }
    const auto [W, W1, W2] = jet(R);
    const StationaryProblem problem{with_potentials(bending(k20), {particle(particle_radius, w, range)}), {}};
    const Equilibrium e = find_equilibrium(problem, meridian(Sphere{1.15, {}}), {.accuracy = 1e-10, .elements = 32});
    ASSERT_EQ(e.stop, Stop::finished) << e.message;
    EXPECT_NEAR(e.observed.r_max, R, 1e-3);  // a point of the mesh
    EXPECT_NEAR(std::sqrt(e.observed.area / (4 * pi)), R, 1e-8);
    EXPECT_NEAR(e.observed.energy, 16 * pi * k20 + 4 * pi * R * R * W, 1e-8);
    EXPECT_NEAR(e.observed.potential.force, 0, 1e-8);
    EXPECT_EQ(e.negative_directions, 0);
    const theory::UniformSphere sphere{bending(k20), R};
    const MotionLaw flow{.friction = 1, .inextensible = false, .keeps_volume = false};
    for (int m = 0; m <= 2; ++m) {
        std::vector<double> expected;
        for (int l = m; l < 8; ++l) {
            const double bends = l == 1 ? 0 : theory::stiffness(sphere, l);
            expected.push_back(-bends - W2 - 4 * W1 / R - (2 + l * (l + 1)) * W / (R * R));
        }
        std::sort(expected.rbegin(), expected.rend());
        const ModeRates found = ModeStability(problem, e).rates(m, flow, 3);
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(found.rates[i], expected[i], 1e-5 * std::abs(expected[i])) << m << i;
    }
    const double small = 0.01, radius = 1 + small;
    const StationaryProblem threshold{with_potentials(bending(k20), {particle(1, 4 * k20 / (radius * radius), small)}),
                                      {}};
    const Equilibrium wrapped =
        find_equilibrium(threshold, meridian(Sphere{radius, {}}), {.accuracy = 1e-8, .elements = 24});
    ASSERT_EQ(wrapped.stop, Stop::finished) << wrapped.message;
    EXPECT_NEAR(wrapped.observed.energy / (16 * pi * k20), 0, 1e-3);
}

const std::string at_wall = R"(tier = "axisym"
[energy]
k20 = 0.5
[[energy.potential]]
kind = "plane"
z = -1.35
strength = 3
range = 0.15
[model]
kind = "gradient-flow"
area = "fixed"
volume = "fixed"
[shape]
kind = "ellipsoid"
a = 1
b = 1
c = 1.1
[accuracy]
energy = 1e-5
[time]
end = 50
stationary = 1e-8
)";

Outcome shapes_of(const std::string& text, const std::vector<std::string>& sets = {}) {
    return run_shapes(parse_case(text, sets, "case.toml"));
}

// A vesicle is drawn to a wall and spreads there. Its end is the equilibrium; the balance of the energy closes.
TEST(Potential, vesiclesAdhere) {
    const Case c = parse_case(at_wall, {}, "case.toml");
    const Outcome o = run_case(c);
    ASSERT_EQ(o.summary.stop.reason, Stop::stationary) << o.summary.stop.message;
    for (const double defect : o["identity_defect"]) EXPECT_LT(std::abs(defect), 2e-4 * o.summary.reference_energy);
    EXPECT_LT(o["potential_force"].front(), -0.1);
    EXPECT_NEAR(o.last("potential_force"), 0, 1e-2);
    EXPECT_LT(o.last("potential_energy"), 2 * o["potential_energy"].front());
    EXPECT_NEAR(o.last("energy"), o.last("energy_20") + o.last("potential_energy"), 1e-9);
    std::string still = at_wall.substr(0, at_wall.find("[time]")) + "[equilibrium]\n";
    still.replace(still.find("kind = \"gradient-flow\"\n"), 23, "");
    const Outcome e = shapes_of(still);
    ASSERT_EQ(e.summary.stop.reason, Stop::finished) << e.summary.stop.message;
    EXPECT_NEAR(e.last("energy"), o.last("energy"), 2e-5 * o.summary.reference_energy);
    EXPECT_NEAR(e.last("potential_force"), 0, 1e-6);
    EXPECT_EQ(e.last("negative_directions"), 0);
    // Along the wall nothing holds it: that motion is no mode.
    const Outcome modes = shapes_of(still + "modes = 1\n");
    EXPECT_LT(modes.last("growth_1"), -1);
}

// Along a branch dE/dw = INT W dS/w: E rises by the integral of that (Simpson's rule).
TEST(Potential, branchesVaryTheStrength) {
    const std::string branch =
        at_wall.substr(0, at_wall.find("[model]")) +
        at_wall.substr(at_wall.find("[shape]"), at_wall.find("[time]") - at_wall.find("[shape]")) +
        "[equilibrium]\n[equilibrium.branch]\nvary = \"energy.potential.0.strength\"\nto = 3.4\n"
        "step = 0.2\n";
    const Outcome o = shapes_of(branch);
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    ASSERT_EQ(o["parameter"].size(), 3u);
    const auto slope = [&](std::size_t i) { return o["potential_energy"][i] / o["parameter"][i]; };
    EXPECT_NEAR(o["energy"][2] - o["energy"][0], 0.4 / 6 * (slope(0) + 4 * slope(1) + slope(2)),
                1e-3 * std::abs(o["energy"][2] - o["energy"][0]));
}

// A torus of radii R and a in the field z^2 + r: INT W = 2 pi^2 R a^3 + 4 pi^2 a (R^2 + a^2/2) at first, then the
// energy balances.
TEST(Potential, toriMoveInFields) {
    const double R = 2, a = 0.7;
    const Outcome o = run_case(parse_case(
        "tier = \"axisym\"\n[energy]\nk20 = 0.5\n[[energy.potential]]\nkind = \"formula\"\nformula = \"z^2 + "
        "r\"\n[shape]\nkind = \"torus\"\nradius = 2\ntube_radius = 0.7\n[accuracy]\nenergy = 1e-5\n[time]\nend = "
        "0.05\n",
        {}, "case.toml"));
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    const double W = 2 * pi * pi * R * std::pow(a, 3) + 4 * pi * pi * a * (R * R + a * a / 2);
    EXPECT_NEAR(o["potential_energy"].front(), W, 1e-9 * W);
    EXPECT_LT(o["potential_energy"].back(), 0.8 * W);
    for (const double defect : o["identity_defect"]) EXPECT_LT(std::abs(defect), 1e-5 * o.summary.reference_energy);
}

// What a uniform pull draws through its friction: u = (1 - exp(-gamma t))/gamma with inertia, 1/gamma without, in a
// fixed shape.
TEST(Potential, spheresAreDrawnThroughTheirFriction) {
    for (const bool inert : {false, true}) {
        const Outcome o = run_case(
            parse_case("tier = \"axisym\"\nenergy = {k20 = 0.5, potential = [{kind = \"formula\", formula = \"-z\"}]}\n"
                       "shape = {kind = \"sphere\", radius = 1}\naccuracy = {energy = 1e-6}\ntime = {end = 0.5}\n",
                       {fmt::format("model={{kind=\"{}\", gamma=2, volume=\"free\"}}", inert ? "fluid" : "overdamped")},
                       "case.toml"));
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        const double speed = inert ? (1 - std::exp(-1.0)) / 2 : 0.5, way = inert ? (0.5 - speed) / 2 : 0.25;
        EXPECT_NEAR(o["speed"].back(), speed, inert ? 5e-6 : 1e-9);
        EXPECT_NEAR(o["potential_energy"].back(), -4 * pi * way, 1e-6 * o.summary.reference_energy);
        EXPECT_NEAR(o["free_energy"].back(), 8 * pi - 4 * pi * way, 1e-6 * o.summary.reference_energy);
        EXPECT_NEAR(o["potential_force"].back(), 4 * pi, 1e-9);
    }
}

// A shape with seams begins with elements that resolve a wall, too.
TEST(Potential, capsulesAtWallsAreResolved) {
    const Outcome o = run_case(parse_case(
        "tier = \"axisym\"\nenergy = {k20 = 0.5, potential = [{kind = \"plane\", z = -1.6, range = 0.04, strength = "
        "1}]}\n"
        "shape = {kind = \"capsule\", radius = 0.5, length = 2}\naccuracy = {energy = 1e-3}\ntime = {end = 1e-5}\n",
        {}, "case.toml"));
    EXPECT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
}

TEST(Potential, wallsAreNotPassed) {
    // A sphere that a pressure inflates into a weak wall; one where a formula of the place ceases to be defined.
    const std::string inflated =
        "tier = \"axisym\"\n[energy]\nk20 = 0.1\n[[energy.potential]]\nPOTENTIAL\n[model]\nvolume = \"free\"\n"
        "pressure = 5\n[shape]\nkind = \"sphere\"\nradius = 1\n[accuracy]\nenergy = 1e-3\n[time]\nend = 10\n";
    const auto stopped = [&](const std::string& potential) {
        std::string text = inflated;
        text.replace(text.find("POTENTIAL"), 9, potential);
        const Outcome o = run_case(parse_case(text, {}, "case.toml"));
        EXPECT_EQ(o.summary.stop.reason, Stop::undefined) << o.summary.stop.message;
        for (const double E : o["energy"]) EXPECT_TRUE(std::isfinite(E));
        return o.summary.stop.message;
    };
    EXPECT_CONTAINS(stopped("kind = \"plane\"\nz = -1.2\nstrength = 0.1\nrange = 0.1"), "behind the wall");
    EXPECT_CONTAINS(stopped("kind = \"formula\"\nformula = \"0.1*sqrt(z + 1.3)\""), "hardly defined");
    const auto begins = [&](const std::vector<std::string>& sets, bool still) {
        std::string text = at_wall;
        if (still) text = text.substr(0, text.find("[model]")) + text.substr(text.find("[shape]"));
        if (still) text = text.substr(0, text.find("[time]")) + "[equilibrium]\n";
        return test::message_of<CaseError>([&] {
            const Case c = parse_case(text, sets, "case.toml");
            still ? shapes_of(text, sets) : run_case(c);
        });
    };
    for (const bool still : {false, true}) {
        EXPECT_CONTAINS(begins({"energy.potential.0.z=-1"}, still), "a point of it is 0.1 behind one");
        const std::string formula = "energy.potential=[{kind=\"formula\", formula=\"log(z)\"}]";
        EXPECT_CONTAINS(begins({formula}, still), "energy.potential must be finite on the initial shape");
    }
    EXPECT_CONTAINS(begins({"shape={kind=\"sphere\", radius=1}"}, false), "no other shape has these");
    const auto refusal = [&](const std::vector<std::string>& sets) {
        return test::message_of<CaseError>([&] { parse_case(at_wall, sets, "case.toml"); });
    };
    EXPECT_CONTAINS(refusal({"energy.potential.0.range=0"}), "must be a number > 0");
}

}  // namespace tubule::axisym::potential_test
