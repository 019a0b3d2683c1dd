// Beads at the poles: derivatives, a sphere's linear response, tethers by virtual work and by their own balance, runs.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "axisym/curve/curve_motion.hpp"
#include "axisym/equilibrium/equilibrium_run.hpp"
#include "axisym/equilibrium/mode_stability.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/case/read.hpp"
#include "common/equilibrium/equilibrium_task.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/theory/dispersion.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/support/message_of.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/random_vector.hpp"

namespace tubule::axisym::beads_test {

using Vector = Eigen::VectorXd;
using test::random_vector;

std::shared_ptr<const CurveSpace> cell(int elements, double width) {
    return std::make_shared<const CurveSpace>(
        Topology::cell, refined_at_beads(Topology::cell, equal_breaks(elements), width, pi), 5, 4);
}

// Central differences with one extrapolation: their own error is of order h^4.
template <class F>
Vector slope(const F& f, double h) {
    return (8 * (f(h / 2) - f(-h / 2)) - (f(h) - f(-h))) / (6 * h);
}

TEST(Beads, equationsHaveTheirDerivatives) {
    const double width = 0.3;
    const auto space = cell(6, width);
    const Vector x = fit(*space, meridian(Ellipsoid{1, 1, 1.5})) + 0.003 * random_vector(space->size(), 1, 2);
    for (const std::optional<double> held : {std::optional<double>(), std::optional(3.1)}) {
        MotionLaw law{.friction = 1, .inextensible = false, .keeps_volume = false, .force = 2};
        law.beads = Beads{width, held ? std::optional(Ramp(0.2)) : std::nullopt};
        StationaryProblem problem{
            bending(0.3, -0.4), {.area = 12, .volume = {}, .reduced_volume = {}}, {.force = held ? 0.0 : 2.0}};
        problem.beads = law.beads, problem.bead_distance = 2.9;
        const StationarySystem system(space, problem, 0.3);
        Vector u = random_vector(system.unknowns(), 0.3, 3);
        u.head(x.size()) = x;
        u[system.lambda()] = u[system.beads() - 1] = 0;  // the volume is free, and nothing holds the place
        u.tail<4>() << 1.4, -1.7, 1.45, -2.2;
        const Vector w = random_vector(u.size(), 1, 4), expected = system.jacobian(u) * w;
        const Vector found = slope([&](double h) { return system.residual(u + h * w); }, 1e-3);
        EXPECT_LE((found - expected).lpNorm<Eigen::Infinity>(), 1e-7 * expected.lpNorm<Eigen::Infinity>());

        // With positions that follow from the curve the merit has the force as its gradient.
        const auto merit = [&](double h) {
            Vector at = u;
            at.head(x.size()) += h * w.head(x.size());
            if (!held) system.set_followers(at);
            return Vector::Constant(1, system.merit(at));
        };
        if (!held) {
            system.set_followers(u);
            EXPECT_NEAR(slope(merit, 1e-3)[0], system.residual(u).head(x.size()).dot(w.head(x.size())), 1e-6);
        }
        for (const auto& [inextensible, inertia] : {std::pair{false, 0.0}, {true, 0.0}, {true, 1.0}}) {
            CurveLaw moves = law;
            moves.inextensible = inextensible, moves.viscosity = inextensible ? 0.4 : 0, moves.inertia = inertia;
            CurveMotion motion(*space, problem.bending, moves, 0.3, 5, 2);
            motion.hold_beads(x);
            const int n = motion.layout().size, at = motion.layout().bead;
            Vector y = random_vector(n, 0.3, 5);
            y.head(x.size()) = x, y.segment<4>(at) = u.tail<4>();
            if (motion.layout().reach >= 0) y[motion.layout().reach] = 0;
            const Vector rate = random_vector(n, 0.3, 6), v = random_vector(n, 1, 7);
            Eigen::SparseMatrix<double> J = motion.pattern();
            motion.jacobian(0, y.data(), rate.data(), 1.7, J.valuePtr());
            const Vector by_J = J * v, by_F = slope(
                                           [&](double h) {
                                               const Vector to = y + h * v, of = rate + 1.7 * h * v;
                                               Vector F(n);
                                               EXPECT_TRUE(motion.residual(0, to.data(), of.data(), F.data()));
                                               return F;
                                           },
                                           1e-3);
            EXPECT_LE((by_J - by_F).lpNorm<Eigen::Infinity>(), 1e-7 * by_J.lpNorm<Eigen::Infinity>());
        }
    }
}

// The derivative d(theta) of the distance of beads on a unit sphere along its normal, from the definition alone.
struct OnSphere {
    double width, P = 0, by_P = 0;
    static constexpr int points = 20000;

    explicit OnSphere(double w) : width(w) {
        double low = 0.5, high = 1.5;
        for (int i = 0; i < 100; ++i)
            (integral([&](double t) { return W(t); }) > 0 ? low : high) = P = (low + high) / 2;
        by_P = -integral([&](double t) { return W_zeta(t); });
    }
    double zeta(double t) const { return std::cos(t) - P; }
    double g(double t) const {
        const double r = std::sin(t), far = zeta(t) - width;
        return std::exp(-(r * r + far * far) / (2 * width * width));
    }
    double W(double t) const { return g(t) * zeta(t); }
    double W_zeta(double t) const { return g(t) * (1 - zeta(t) * (zeta(t) - width) / (width * width)); }
    double W_r(double t) const { return -W(t) * std::sin(t) / (width * width); }
    template <class F>
    static double integral(const F& f) {
        double sum = 0;
        for (int i = 0; i < points; ++i) {
            const double t = (i + 0.5) * pi / points;
            sum += f(t) * 2 * pi * std::sin(t) * pi / points;
        }
        return sum;
    }
    double slope(double t) const {  // of one bead; d INT W dS = INT (dW/dnu - H W) w dS, H = -2
        return -(W_r(t) * std::sin(t) + W_zeta(t) * std::cos(t) + 2 * W(t)) / by_P;
    }
};

// Under a small force a sphere of fixed volume, at a tension, gives way by f SUM d_l^2/stiffness_l in the modes l = 2,
// 4,
// ... of d: theory.md (8.5) has the stiffness.
TEST(Beads, sphereGivesWayLinearly) {
    const double width = 0.3, force = 1e-3;
    const OnSphere exact(width);
    double compliance = 0;
    const theory::UniformSphere sphere{bending(0.5), 1, 3};
    for (int l = 2; l < 60; l += 2) {
        const double part =
            OnSphere::integral([&](double t) { return exact.slope(t) * std::legendre(l, std::cos(t)); });
        compliance += 4 * part * part * (2 * l + 1) / (4 * pi) / theory::stiffness(sphere, l);
    }
    StationaryProblem problem{
        bending(0.5), {.area = {}, .volume = 4 * pi / 3, .reduced_volume = {}}, {.tension = 3, .force = force}};
    problem.beads = Beads{width, std::nullopt};
    const auto distance = [&](double f) {
        problem.loads.force = f;
        const Equilibrium e = find_equilibrium(problem, meridian(Sphere{1, {}}), {.accuracy = 1e-11});
        EXPECT_EQ(e.stop, Stop::finished) << e.message;
        EXPECT_NEAR(axial_force(problem, e), f, 1e-9);
        return e.length;
    };
    EXPECT_NEAR(distance(0), 2 * exact.P, 1e-8);
    EXPECT_NEAR((distance(force) - distance(-force)) / (2 * force), compliance, 1e-6 * compliance);
}

// A sphere that moves across the axis by x gains x^2/2 SUM q d^2G/dx^2, as the weights stay. With INT W = 0 that is
// f/w^4 INT W r^2/(dG/dP) for both beads, and the rate that over INT n_x^2 = 4 pi/3; to second order in the force.
TEST(Beads, holdASphereOnTheirAxis) {
    const double width = 0.3, force = 0.02;
    const OnSphere exact(width);
    const double stiffness = OnSphere::integral([&](double t) { return exact.W(t) * std::pow(std::sin(t), 2); }) /
                             (std::pow(width, 4) * exact.by_P);
    const auto rate = [&](double f) {
        StationaryProblem problem{
            bending(0.5), {.area = {}, .volume = 4 * pi / 3, .reduced_volume = {}}, {.tension = 3, .force = f}};
        problem.beads = Beads{width, std::nullopt};
        const Equilibrium e = find_equilibrium(problem, meridian(Sphere{1, {}}), {.accuracy = 1e-11});
        EXPECT_EQ(e.stop, Stop::finished) << e.message;
        const MotionLaw gradient_flow{.friction = 1, .inextensible = false, .keeps_volume = false};
        return ModeStability(problem, e).rates(1, gradient_flow, 1).rates[0];
    };
    const double expected = -stiffness / (4 * pi / 3);
    EXPECT_NEAR((rate(force) - rate(-force)) / (2 * force), expected, 1e-3 * std::abs(expected));
    EXPECT_LT(rate(0), -1);  // nothing holds it, and no motion of the whole counts
}

const std::string pulled = "/tether.toml", branch = "/branch_tether.toml";

Case of(const std::string& name, const std::vector<std::string>& sets) {
    return read_case(test::cases + name, sets);
}

// The free energy of shapes rises along a branch by the force times the distance (central differences, extrapolated).
TEST(Beads, forceIsTheSlopeOfTheEnergy) {
    const auto at = [](double extension) {
        const Outcome o = run_shapes(
            of(branch, {"equilibrium={}", fmt::format("model.extension={}", extension), "accuracy.energy=1e-9"}));
        EXPECT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        return std::array{o.last("free_energy"), o.last("force")};
    };
    const double h = 0.04;
    const auto F = [&](double shift) { return at(0.3 + shift)[0]; };
    EXPECT_NEAR((8 * (F(h / 2) - F(-h / 2)) - (F(h) - F(-h))) / (6 * h), at(0.3)[1], 1e-5 * at(0.3)[1]);
}

// From an equilibrium with other beads the descent and plain Newton steps find the same one.
TEST(Beads, beginsAtAnotherEquilibrium) {
    StationaryProblem problem{
        bending(0.5), {.area = {}, .volume = 4 * pi / 3, .reduced_volume = {}}, {.tension = 10, .force = 15}};
    problem.beads = Beads{0.3, std::nullopt};
    const Equilibrium first = find_equilibrium(problem, meridian(Ellipsoid{0.9, 0.9, 1.25}), {.accuracy = 1e-8});
    ASSERT_EQ(first.stop, Stop::finished) << first.message;
    problem.loads.force = 0, problem.beads = Beads{0.2, Ramp(0.3)}, problem.bead_distance = first.length;
    const Curve from = meridian(*first.space, first.x);
    EquilibriumSettings near{.accuracy = 1e-8, .descend = false}, afar{.accuracy = 1e-8};
    const Equilibrium a = find_equilibrium(problem, from, near), b = find_equilibrium(problem, from, afar);
    ASSERT_EQ(a.stop, Stop::finished) << a.message;
    ASSERT_EQ(b.stop, Stop::finished) << b.message;
    EXPECT_NEAR(a.observed.energy, b.observed.energy, 1e-6);
    EXPECT_NEAR(axial_force(problem, a), axial_force(problem, b), 1e-5);
}

// A long tether balances by itself, theory.md (2.23): f = 2 pi R (f + sigma) - pi R^2 P, with R where it is a cylinder.
TEST(Beads, tethersBalance) {
    const Outcome o = run_shapes(of(branch, {"equilibrium.branch.to=12", "equilibrium.branch.step=2"}));
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    const Record& last = o.log.frames.back();
    const auto array = [&](const std::string& name) {
        for (const Array& a : last.arrays)
            if (a.name == name) return a.data;
        return std::vector<double>();
    };
    const std::vector<double> r = array("r"), z = array("z"), H = array("H");
    double R = 0, off = HUGE_VAL;
    for (std::size_t i = 0; i < r.size(); ++i)
        if (z[i] > 1 && r[i] > 0.1 && std::abs(1 / r[i] + H[i]) < off) R = r[i], off = std::abs(1 / R + H[i]);
    const double force = 2 * pi * R * (0.5 / (R * R) + 20) - pi * R * R * o.last("pressure");
    EXPECT_GT((z.back() - 1) / R, 20);  // its length
    EXPECT_NEAR(o.last("force"), force, 1e-6 * force);
    // It overshoots before tethers have formed; where the force falls, one of the two grows at the other's expense.
    const std::vector<double>& forces = o["force"];
    EXPECT_GT(*std::ranges::max_element(forces), 1.04 * forces.back());
    for (std::size_t i = 0; i < o["parameter"].size(); ++i)
        if (o["parameter"][i] == 2 || o["parameter"][i] == 4) {
            EXPECT_EQ(o["negative_directions"][i], o["parameter"][i] == 2 ? 0 : 1);
        }
}

// Under a force a run comes to the equilibrium, at the rate of its slowest mode, and its energy balances.
TEST(Beads, runsRelax) {
    const std::string at_force =
        "tier = \"axisym\"\n[energy]\nk20 = 0.5\n[model]\narea = \"free\"\nvolume = \"fixed\"\ntension = 10\n"
        "bead_width = 0.2\nforce = 15\n[shape]\nkind = \"sphere\"\nradius = 1\n";
    const Outcome o = run_case(
        parse_case(at_force + "[accuracy]\nenergy = 1e-7\n[time]\nend = 0.3\noutput = [0.2, 0.22]\n", {}, "case.toml"));
    const Case c = parse_case(at_force + "[equilibrium]\nmodes = 1\n", {}, "case.toml");
    const Outcome e = run_shapes(c);
    ASSERT_EQ(e.summary.stop.reason, Stop::finished) << e.summary.stop.message;
    const double rest = e.last("bead_distance"), before = o.at("bead_distance", 0.2) - rest,
                 after = o.at("bead_distance", 0.22) - rest;
    EXPECT_NEAR(std::log(before / after) / 0.02, -e.last("growth_0"), 1e-2 * -e.last("growth_0"));
    EXPECT_NEAR(o.last("free_energy"), e.last("free_energy"), 1e-6 * o.summary.reference_energy);
    for (const double defect : o["identity_defect"]) EXPECT_LT(std::abs(defect), 1e-5 * o.summary.reference_energy);
}

// In Stokes flow the distance follows what is asked for; what holds it does the work; a kink jumps in the force.
TEST(Beads, distanceIsHeld) {
    const Case c = of(pulled, {"model={kind=\"stokes\", area=\"reservoir\", tension=10, bead_width=0.2, "
                               "extension={time=[0, 0.1, 0.2], value=[0, 0.4, 0.4]}}",
                               "time={end=0.2, output=[0.05, 0.1]}", "accuracy.energy=1e-3"});
    const Outcome o = run_case(c);
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    const double first = o["bead_distance"].front();
    EXPECT_NEAR(o.at("bead_distance", 0.05) - first, 0.2, 1e-7);
    EXPECT_NEAR(o.last("bead_distance") - first, 0.4, 1e-7);
    EXPECT_GT(o.last("work"), 0.9 * (o.last("free_energy") - o["free_energy"].front()));
    EXPECT_LT(o.last("force"), 0.98 * o.at("force", 0.1));
    for (const double defect : o["identity_defect"]) EXPECT_LT(std::abs(defect), 1e-4 * o.summary.reference_energy);
    // Interrupted and resumed it ends alike.
    const Outcome part = run_case(c, nullptr, [](double t) { return t > 0.12; });
    ASSERT_EQ(part.summary.stop.reason, Stop::interrupted) << part.summary.stop.message;
    const Outcome rest = run_case(c, &part.log.checkpoints.back());
    EXPECT_EQ(rest.summary.stop.reason, Stop::finished) << rest.summary.stop.message;
    EXPECT_NEAR(rest.last("bead_distance"), o.last("bead_distance"), 1e-7);
    EXPECT_NEAR(rest.last("force"), o.last("force"), 1e-3 * o.last("force"));
    EXPECT_LT(std::abs(rest.last("identity_defect")), 1e-4 * o.summary.reference_energy);
}

const double speed = 2, until = 0.02;  // of the distance of beads
const std::vector<std::string> drawn_fluid{
    "model={kind=\"fluid\", area=\"reservoir\", tension=10, bead_width=0.3, "
    "extension={time=[0, 0.02, 0.03], value=[0, 0.04, 0.04]}}",
    "accuracy.energy=1e-4"};

// Beads take a sphere's fluid along at once: with u.nu = SUM a_l P_l its kinetic energy is SUM a_l^2 (1 + 4/(l (l +
// 1))) 2 pi/(2 l + 1), as div u = 0, least at the rate SUM a_l d_l, d the derivative of the distance. Where the rate
// falls to 0 they take it out again, and otherwise the energy balances.
TEST(Beads, velocitiesOfAFluidJump) {
    const OnSphere exact(0.3);
    double lightness = 0;
    for (int l = 2; l < 60; l += 2) {
        const double part =
            OnSphere::integral([&](double t) { return exact.slope(t) * std::legendre(l, std::cos(t)); });
        lightness += 4 * part * part * (2 * l + 1) / (4 * pi) / (1 + 4.0 / (l * (l + 1)));
    }
    std::vector<std::string> sets = drawn_fluid;
    sets.push_back("time={end=0.03, output=[0.01, 0.02]}");
    const Case c = of(pulled, sets);
    const Outcome o = run_case(c);
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    EXPECT_NEAR(o["kinetic_energy"].front(), speed * speed / (2 * lightness), 1e-5);
    const double first = o["bead_distance"].front();
    EXPECT_NEAR(o.at("bead_distance", 0.01) - first, speed * 0.01, 1e-8);
    EXPECT_NEAR(o.last("bead_distance") - first, speed * until, 1e-8);
    const double before = o.at("kinetic_energy", until), taken = o.at("work", until) - o.last("work");
    EXPECT_GT(taken, 0.5 * before);
    EXPECT_LT(o.last("kinetic_energy"), 0.5 * before);
    for (const double defect : o["identity_defect"]) EXPECT_LT(std::abs(defect), 1e-5 * o.summary.reference_energy);
    // From the frame of that moment on it ends alike.
    const Outcome rest = run_case(c, &o.log.frames.at(2));
    EXPECT_EQ(rest.summary.stop.reason, Stop::finished) << rest.summary.stop.message;
    for (const std::string name : {"bead_distance", "work", "free_energy", "kinetic_energy"})
        EXPECT_NEAR(rest.last(name), o.last(name), 1e-6) << name;
}

// The measured force as a given one, after the impulse 2 E_K/speed of the start, draws the beads as far.
TEST(Beads, aMeasuredForceDrawsAsFar) {
    std::vector<std::string> sets = drawn_fluid;
    std::string times, values;
    const int steps = 20;
    for (int i = 1; i <= steps; ++i) times += fmt::format("{}{}", i > 1 ? ", " : "", until * i / steps);
    sets.push_back(fmt::format("time={{end={}, output=[{}]}}", until, times));
    const Outcome held = run_case(of(pulled, sets));
    ASSERT_EQ(held.summary.stop.reason, Stop::finished) << held.summary.stop.message;
    const double pulse = 1e-6, impulse = 2 * held["kinetic_energy"].front() / speed, force = held["force"].front();
    times = fmt::format("0, {0}, {1}, ", pulse, 1.001 * pulse) + times;
    values = fmt::format("{0}, {0}, {1}", impulse / pulse, force);
    for (int i = 1; i <= steps; ++i) values += fmt::format(", {}", held.at("force", until * i / steps));
    sets[0] = fmt::format(
        "model={{kind=\"fluid\", area=\"reservoir\", tension=10, bead_width=0.3, "
        "force={{time=[{}], value=[{}]}}}}",
        times, values);
    const Outcome given = run_case(of(pulled, sets));
    ASSERT_EQ(given.summary.stop.reason, Stop::finished) << given.summary.stop.message;
    EXPECT_NEAR(given.at("bead_distance", until / 2) - held.at("bead_distance", until / 2), 0, 1e-3 * speed * until);
    EXPECT_NEAR(given.last("bead_distance") - held.last("bead_distance"), 0, 1e-3 * speed * until);
    EXPECT_NEAR(given.last("kinetic_energy"), held.last("kinetic_energy"), 1e-3 * held.last("kinetic_energy"));
}

TEST(Beads, refusals) {
    const auto refused = [](const std::vector<std::string>& sets) {
        return test::message_of<CaseError>([&] { run_case(of(pulled, sets)); });
    };
    EXPECT_CONTAINS(refused({"model.bead_width=1.2"}), "must be small beside the shape");
    EXPECT_CONTAINS(refused({"shape={kind=\"torus\", radius=2, tube_radius=0.5}"}),
                    "needs a closed shape with two poles");
    EXPECT_CONTAINS(refused({"model={kind=\"stokes\", bead_width=0.2, force=1}"}), "no other shape has these");
    const Outcome full =
        run_case(of(pulled, {"discretisation.elements=16",
                             "model={kind=\"stokes\", bead_width=0.2, extension={time=[0, 1], value=[0, 1]}}",
                             "shape={kind=\"ellipsoid\", a=1, b=1, c=1.1}"}));
    EXPECT_EQ(full.summary.stop.reason, Stop::solver_failed);
    EXPECT_CONTAINS(full.summary.stop.advice, "fixed area and volume");
    // A force that tethers do not withstand draws the membrane out of what its elements resolve.
    const Outcome o =
        run_case(of(pulled, {"model={area=\"free\", volume=\"fixed\", tension=10, bead_width=0.1, force=40}",
                             "discretisation.elements=8"}));
    EXPECT_EQ(o.summary.stop.reason, Stop::resolution_lost);
    EXPECT_CONTAINS(o.summary.stop.message, "an element near a bead");
}

}  // namespace tubule::axisym::beads_test
