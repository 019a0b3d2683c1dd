// Patches in rings: plates, films and tethers against closed forms and an independent boundary-value solution; runs.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "axisym/curve/curve_motion.hpp"
#include "axisym/curve/shape_integrals.hpp"
#include "axisym/equilibrium/mode_stability.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/result/start_frame.hpp"
#include "common/solve/derivative_check.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/support/message_of.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/random_vector.hpp"

namespace tubule::axisym::patch_test {

using Vector = Eigen::VectorXd;
using test::random_vector;

// An open end has no condition: splines there are all polynomials, and the last coefficient is the value.
TEST(SplineSpace, openEnds) {
    for (int degree = 2; degree <= 7; ++degree)
        for (int smoothness = degree == 5 ? 2 : 1; smoothness < degree; ++smoothness) {  // see refusals
            const SplineSpace space({0, 1, true, 1, true, true}, equal_breaks(5), degree, smoothness);
            EXPECT_EQ(space.size(), 5 * (degree - smoothness) + smoothness + 1);
            const auto power = [&](double s) { return std::pow(s + 0.3, degree); };
            const Vector c = space.project(power);
            for (const double s : {0.0, 0.13, 0.6, 1.0})
                EXPECT_NEAR(space.evaluate(c.data(), s)[0], power(s), 1e-11) << degree << smoothness;
            EXPECT_NEAR(c[0], power(0), 1e-11);
            EXPECT_NEAR(c[c.size() - 1], power(1), 1e-11);
        }
    const SplineSpace odd({0, 1, true, 1, true, false}, equal_breaks(6), 5, 4, {1, -1});
    const Vector c = random_vector(odd.size(), 1);
    EXPECT_NEAR(odd.evaluate(c.data(), 1.0)[0], 0, 1e-14);
    EXPECT_NEAR((odd.project([&](double s) { return odd.evaluate(c.data(), s)[0]; }) - c).norm(), 0, 1e-8);
}

std::shared_ptr<const CurveSpace> space_of(const Curve& m, int elements) {
    return std::make_shared<const CurveSpace>(m.topology, equal_breaks(elements), 5, 4);
}
const std::vector<Patch> patches{{1.3, 0.6, {}}, {1.3, 0.9, 0.7}};

// Long: forms, equilibria and all laws of motion of the same patches.
TEST(Patches, equationsHaveTheirDerivatives) {
    for (const Patch& patch : patches)
        for (const Rim rim : {Rim::clamped, Rim::hinged}) {
            const Curve m = meridian(patch);
            const auto space = space_of(m, 6);
            const Vector x = fit(*space, m) + random_vector(space->size(), 0.003, 2);
            const Bending energy = bending(0.3, -0.4, 0.01, 0.02);
            const CurveForms forms(*space, energy);
            const Weights weights{1, -0.7, 1.3, 0.4};
            const auto check = check_derivatives(
                [&](const Vector& y) { return forms.value(weights, y); },
                [&](const Vector& y) { return forms.gradient(weights, y); },
                [&](const Vector& y, const Vector& w) -> Vector { return forms.hessian(weights, y) * w; }, x);
            EXPECT_TRUE(check.pass()) << check.text();

            StationaryProblem problem{energy, {.area = 7, .volume = {}, .reduced_volume = {}}, {.pressure = 0.4}};
            problem.rings = rings_of(m, rim);
            if (!patch.second_radius) problem.beads = Beads{0.4, Ramp(0.2)}, problem.bead_distance = 0.5;
            const StationarySystem system(space, problem, 0.3);
            Vector u = random_vector(system.unknowns(), 0.3, 3);
            u.head(x.size()) = x;
            if (problem.beads) u.segment<4>(system.beads()) << 0.01, 0.2, 0.55, -1.7;
            const Vector w = random_vector(u.size(), 1, 4);
            const auto slope = [](const auto& f) -> Vector {
                const double h = 2e-5;
                return (8 * (f(h / 2) - f(-h / 2)) - (f(h) - f(-h))) / (6 * h);
            };
            const Vector by_J = system.jacobian(u) * w,
                         by_F = slope([&](double h) -> Vector { return system.residual(u + h * w); });
            EXPECT_LE((by_F - by_J).lpNorm<Eigen::Infinity>(), 1e-7 * by_J.lpNorm<Eigen::Infinity>());

            for (const auto& [inextensible, open, keeps_volume] :
                 {std::array{false, false, false}, {true, false, true}, {true, true, false}, {true, true, true}}) {
                MotionLaw of{
                    .friction = 1, .inextensible = inextensible, .keeps_volume = keeps_volume, .reservoir = open};
                of.inertia = of.viscosity = inextensible ? 0.4 : 0, of.rim = rim, of.beads = problem.beads;
                of.tension = 0.6, of.pressure = keeps_volume ? 0 : 0.3;
                CurveLaw law = of;
                law.open_rim = open;
                CurveMotion motion(*space, energy, law, 0.3, 5, 2);
                motion.hold_rings(x);
                if (law.beads) motion.hold_beads(x);
                Vector y = random_vector(motion.layout().size, 0.3, 5);
                y.head(x.size()) = x;
                if (law.beads) y.segment<4>(motion.layout().bead) = u.segment<4>(system.beads());
                if (motion.layout().reach >= 0) y[motion.layout().reach] = 0;
                const Vector rate = random_vector(y.size(), 0.3, 6), v = random_vector(y.size(), 1, 7);
                Eigen::SparseMatrix<double> J = motion.pattern();
                motion.jacobian(0, y.data(), rate.data(), 1.7, J.valuePtr());
                const Vector moves = J * v, moved = slope([&](double h) -> Vector {
                                                const Vector to = y + h * v, of = rate + 1.7 * h * v;
                                                Vector F(y.size());
                                                EXPECT_TRUE(motion.residual(0, to.data(), of.data(), F.data()));
                                                return F;
                                            });
                // Row by row: those of the numbers are small beside the forces.
                const Vector scale = J.cwiseAbs() * v.cwiseAbs();
                for (Eigen::Index i = 0; i < y.size(); ++i) EXPECT_NEAR(moves[i], moved[i], 1e-6 * scale[i]) << i;
            }
        }
}

const std::string plate =
    "tier = \"axisym\"\n[energy]\nk20 = 0.5\n[model]\npressure = 1e-3\n[shape]\nkind = \"patch\"\nradius = 1\n"
    "[equilibrium]\nheld = \"nothing\"\nmodes = 2\n[accuracy]\nenergy = 1e-9\n";

Outcome shape_of(const std::string& text, const std::vector<std::string>& sets) {
    const Outcome o = run_shapes(parse_case(text, sets, "case.toml"));
    EXPECT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    return o;
}

// Under a small pressure P a flat patch bends as a plate of the stiffness kappa = 2 k20 = 1: clamped P/64 high, hinged
// P (5 + nu)/(64 (1 + nu)) with the Gaussian modulus nu - 1, under the tension 4 as a clamped membrane in Bessel
// functions (Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, sections 16 and 93).
TEST(Patches, bendAsPlates) {
    const double P = 1e-3;
    EXPECT_NEAR(shape_of(plate, {}).last("height"), P / 64, 1e-8 * P);
    for (const double gaussian : {-0.5, 0.0, 0.3}) {
        const double nu = 1 + gaussian;
        const std::string term = fmt::format("energy.term=[{{modulus={}, H=0, K=1}}]", gaussian);
        EXPECT_NEAR(shape_of(plate, {"model.rim=hinged", term}).last("height"), P * (5 + nu) / (64 * (1 + nu)),
                    1e-7 * P);
    }
    const double q = 2,
                 taut = P / (4 * q * q) - P * (std::cyl_bessel_i(0, q) - 1) / (2 * q * q * q * std::cyl_bessel_i(1, q));
    EXPECT_NEAR(shape_of(plate, {"model.tension=4"}).last("height"), taut, 1e-7 * P);
}

// Growth rates of a flat patch: clamped minus the fourth powers of the zeros of J_m I_{m+1} + I_m J_{m+1} (Leissa,
// Vibration of Plates, NASA SP-160, table 2.1), hinged without a Gaussian modulus -(j^4 + sigma j^2), j the zeros of
// J_m.
TEST(Patches, relaxAsPlates) {
    const Outcome clamped = shape_of(plate, {});
    const double k[3] = {3.19622062, 4.61089988, 5.90567824}, j[3] = {2.404825558, 3.831705970, 5.135622302};
    for (int m = 0; m < 3; ++m)
        EXPECT_NEAR(clamped.last(fmt::format("growth_{}", m)), -std::pow(k[m], 4), 1e-7 * std::pow(k[m], 4));
    const Outcome hinged = shape_of(plate, {"model.rim=hinged", "model.tension=3", "model.pressure=0"});
    for (int m = 0; m < 3; ++m) {
        const double rate = std::pow(j[m], 4) + 3 * j[m] * j[m];
        EXPECT_NEAR(hinged.last(fmt::format("growth_{}", m)), -rate, 1e-8 * rate);
    }
}

// A catenoid has no bending energy, balances its tension, and spans rings of radius 1 up to the height 1.325487 = 2
// /sinh(x), x tanh(x) = 1. Its force is 2 pi times the tension and the radius of the waist; beyond the fold it
// unduloids.
TEST(Patches, filmsAreCatenoids) {
    const Outcome o = run_shapes(read_case(test::cases + "/branch_catenoid.toml"));
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    int folds = 0;
    for (std::size_t i = 0; i < o["parameter"].size(); ++i) {
        EXPECT_LT(o["energy"][i], 1e-9);
        const double waist = o["r_middle"][i];
        EXPECT_NEAR(waist * std::cosh(o["parameter"][i] / (2 * waist)), 1, 1e-6);
        EXPECT_NEAR(o["force"][i], 2 * pi * waist, 1e-6);
        if (o["special"][i] == 0) continue;
        ++folds;
        EXPECT_NEAR(o["parameter"][i], 1.3254868, 1e-6);
    }
    EXPECT_EQ(folds, 1);
    EXPECT_EQ(o.summary.stop.message,
              "the branch turned at the fold at 1.32549 and ended at the parameter 1: it did not reach 1.5");
    EXPECT_EQ(o.summary.warnings, std::vector<std::string>{o.summary.stop.message});
}

// A tether from a clamped flat patch of radius 20, kappa = 1, tension 1/2: the force 2 pi sqrt(2 kappa sigma) and the
// radius sqrt(kappa/(2 sigma)) at the end, and before that the curve of a force at a point, as width falls: 7.0726297
// at the extension 8, by scipy.solve_bvp from Hamilton's equations with the pole's expansion. That curve rises to 1.127
// times the final force.
TEST(Patches, tethersOvershoot) {
    const auto drawn = [](double width, double to) {
        const Outcome o =
            run_shapes(read_case(test::cases + "/branch_patch_tether.toml",
                                 {fmt::format("model.bead_width={}", width),
                                  fmt::format("equilibrium.branch={{vary=\"model.extension\", to={}, step=4}}", to)}));
        EXPECT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        return o;
    };
    const auto force = [&](double width) { return drawn(width, 8).last("force"); };
    const double wide = force(0.1), half = force(0.05), narrow = force(0.025);
    // The error is a w^2 log w + b w^2: eliminated from three widths, each half of the one before.
    const double first = (4 * half - wide) / 3, second = (4 * narrow - half) / 3, point = (4 * second - first) / 3;
    EXPECT_NEAR(point, 7.0726297, 1e-4 * 7.07);
    const Outcome tether = drawn(0.1, 56);
    EXPECT_NEAR(tether.last("force"), 2 * pi, 1e-6 * 2 * pi);
    EXPECT_GT(*std::ranges::max_element(tether["force"]), 1.12 * 2 * pi);
    const auto array = [&](const std::string& name) {
        return std::ranges::find(tether.log.frames.back().arrays, name, &Array::name)->data;
    };
    const std::vector<double> r = array("r"), z = array("z");
    int found = 0;
    for (std::size_t i = 0; i < r.size(); ++i) {
        if (std::abs(z[i] - 28) > 1) continue;
        EXPECT_NEAR(r[i], 1, 1e-6);
        ++found;
    }
    EXPECT_GT(found, 3);
}

// The force between two rings is the slope of the free energy in their distance.
TEST(Patches, forceIsTheSlopeOfTheEnergy) {
    const std::string strip =
        "tier = \"axisym\"\n[energy]\nk20 = 0.5\nk42 = 0.03\nH0 = -0.7\n[model]\ntension = 0.4\npressure = 0.3\n"
        "[shape]\nkind = \"patch\"\nradius = 1\nsecond_radius = 0.8\nheight = 1\n[equilibrium]\nheld = \"nothing\"\n"
        "[accuracy]\nenergy = 1e-10\n[equilibrium.branch]\nvary = \"shape.height\"\nto = 1.1\nstep = 0.025\n";
    const Outcome o = shape_of(strip, {});
    const std::vector<double>& F = o["free_energy"];
    ASSERT_EQ(F.size(), 5);
    const double h = 0.025;
    EXPECT_NEAR((8 * (F[3] - F[1]) - (F[4] - F[0])) / (12 * h), o["force"][2], 1e-5 * std::abs(o["force"][2]));
}

const std::string moving =
    "tier = \"axisym\"\n[energy]\nk20 = 0.5\n[model]\nkind = \"{}\"\nrim = \"{}\"\nvolume = \"free\"\npressure = 3\n"
    "[shape]\nkind = \"patch\"\nradius = 1\nheight = 0.5\n[accuracy]\nenergy = 1e-5\n";

// Runs come to the equilibrium, at the rate of its slowest mode, and their energy balances.
TEST(Patches, runsRelax) {
    const auto asks = [](bool held) {
        return std::vector<std::string>{held ? "equilibrium={held=\"area\"}" : "equilibrium={held=\"nothing\"}"};
    };
    const std::string reservoir = "model.area=reservoir", pull = "model.tension=2";
    for (const auto& [kind, open] : {std::pair{"gradient-flow", true}, {"overdamped", false}, {"stokes", true}}) {
        const std::string text = fmt::format(fmt::runtime(moving), kind, kind[0] == 'g' ? "clamped" : "hinged");
        const bool flows = kind[0] != 'g';
        std::vector<std::string> rest = asks(!open), moves;
        if (flows && open) moves = {reservoir, pull}, rest.insert(rest.end(), moves.begin(), moves.end());
        const Outcome e = shape_of(text, rest);
        const Outcome o = run_case(parse_case(text + "[time]\nend = 0.3\n", moves, "case.toml"));
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        EXPECT_NEAR(o.last("free_energy"), e.last("free_energy"), 1e-6 * o.summary.reference_energy);
        for (const double defect : o["identity_defect"]) EXPECT_LT(std::abs(defect), 1e-5 * o.summary.reference_energy);
        if (!open) {
            EXPECT_NEAR(o.last("area"), o["area"].front(), 1e-10);
        }
    }
    const std::string text = fmt::format(fmt::runtime(moving), "stokes", "hinged");
    for (const bool open : {false, true}) {
        std::vector<std::string> rest = asks(!open), moves{"accuracy.energy=1e-5", "model.gamma=0.5"};
        if (open) moves.insert(moves.end(), {reservoir, pull}), rest.insert(rest.end(), {reservoir, pull});
        rest.insert(rest.end(), {"equilibrium.modes=0", "model.gamma=0.5"});
        const Outcome e = shape_of(text, rest);
        const double rate = e.last("growth_0"), end = 12 / -rate, from = 0.65 * end, to = 0.8 * end;
        const Outcome o = run_case(
            parse_case(text + fmt::format("[time]\nend = {}\noutput = [{}, {}]\n", end, from, to), moves, "case.toml"));
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        const auto off = [&](double t) { return o.at("volume", t) - e.last("volume"); };
        EXPECT_NEAR(std::log(off(to) / off(from)) / (to - from), rate, 5e-3 * -rate);
    }
}

// A cylinder of radius R = 0.8, H0 = -1/R, between hinged rings has the waves sin(n pi z/L) cos(m theta) of a tube: its
// rates are those of theory.md (5.8), (5.9), (5.10) where membrane flows in through the rings.
TEST(Patches, hingedCylindersHaveTheWavesOfTubes) {
    const double R = 0.8, length = 1.3, k20 = 0.3, k42 = 0.15, sigma = 0.7, gamma = 0.8, mu = 0.6;
    const Curve m = meridian(Patch{R, length, R});
    StationaryProblem problem{bending(k20, -1 / R, 0, k42), {}, {.tension = sigma, .pressure = sigma / R}};
    problem.rings = rings_of(m, Rim::hinged);
    const Equilibrium e = find_equilibrium(problem, m, {.accuracy = 1e-10});
    ASSERT_EQ(e.stop, Stop::finished) << e.message;
    const MotionLaw gradient_flow{.friction = 1, .inextensible = false, .keeps_volume = false},
        overdamped{.friction = gamma, .keeps_volume = false, .reservoir = true},
        stokes{.viscosity = mu, .friction = gamma, .keeps_volume = false, .reservoir = true};
    for (int around = 0; around <= 3; ++around) {
        const auto rates = [&](const MotionLaw& law) { return ModeStability(problem, e).rates(around, law, 2).rates; };
        const std::vector<double> found[3] = {rates(gradient_flow), rates(overdamped), rates(stokes)};
        std::vector<double> expected[3];
        for (int n = 1; n < 4; ++n) {
            const double q = pi * n / length, mR = around / R, Q = q * q + mR * mR, Z = Q - 1 / (R * R);
            const double G = 2 * k20 * Z * Z + sigma * Z + 2 * k42 * std::pow(q, 4) / (R * R),
                         slip = gamma * (Q * R * R + 1);
            expected[0].push_back(-G), expected[1].push_back(-Q * R * R * G / slip);
            expected[2].push_back(-Q * R * R * G /
                                  (slip + 4 * mu * q * q - 4 * mu * mu * q * q * mR * mR / (gamma + mu * Q)));
        }
        for (int law = 0; law < 3; ++law) {
            std::ranges::sort(expected[law], std::greater<>());
            for (int i = 0; i < 2; ++i) EXPECT_NEAR(found[law][i] / expected[law][i], 1, 1e-6) << around << law << i;
        }
        // A closed rim hinders the flow, and for m = 0 holds the area, too.
        const MotionLaw closed{.viscosity = mu, .friction = gamma, .keeps_volume = false};
        if (around > 0) {
            EXPECT_GT(rates(closed)[0], found[2][0]);
        }
    }
}

// A result is the initial shape of the next run, with its rings; interrupted and resumed a run ends alike.
TEST(Patches, continueAndResume) {
    const std::string text = fmt::format(fmt::runtime(moving), "stokes", "hinged") + "[time]\nend = 0.01\n";
    const Case c = parse_case(text, {"accuracy.energy=1e-4"}, "case.toml");
    const Outcome whole = run_case(c), part = run_case(c, nullptr, [](double t) { return t > 0.004; });
    ASSERT_EQ(part.summary.stop.reason, Stop::interrupted) << part.summary.stop.message;
    const Outcome rest = run_case(c, &part.log.checkpoints.back());
    EXPECT_EQ(rest.summary.stop.reason, Stop::finished) << rest.summary.stop.message;
    EXPECT_NEAR(rest.last("energy"), whole.last("energy"), 1e-4 * whole.summary.reference_energy);

    const Record& end = whole.log.frames.back();
    const auto array = [&](const std::string& name) { return std::ranges::find(end.arrays, name, &Array::name)->data; };
    const PerturbedCurve again = curve_through(array("r"), array("z"), 0);
    EXPECT_EQ(again.topology, Topology::cap);
    const ShapeEnergy energy = bending_energy(meridian(again), c.energy);
    EXPECT_NEAR(energy.energy, whole.last("energy"), 1e-5 * whole.summary.reference_energy);
}

// A fluid goes on from its last frame with its velocity, and loses no energy there.
TEST(Patches, fluidsContinueWithTheirVelocity) {
    const std::string dome = test::cases + "/patch.toml", path = testing::TempDir() + "patch_fluid.hdf";
    const std::string fluid = "model={kind=\"fluid\", area=\"reservoir\", tension=2, volume=\"free\", pressure=6}";
    const std::vector<std::string> sets{fluid, "time={end=0.05}", "accuracy.energy=1e-4"};
    const Case c = read_case(dome, sets);
    const Outcome first = run_case(c);
    ASSERT_EQ(first.summary.stop.reason, Stop::finished) << first.summary.stop.message;
    Result result;
    result.frames = {first.log.frames.back()};
    Case next = c;
    next.shape = ResultFrame{.path = path, .frame = 0};
    next.velocity.initial = InitialVelocity::result;
    next.input = frame_as_input(std::get<ResultFrame>(next.shape), result);
    const Outcome second = run_case(next);
    ASSERT_EQ(second.summary.stop.reason, Stop::finished) << second.summary.stop.message;
    EXPECT_GT(first.last("kinetic_energy"), 1e-3);
    EXPECT_NEAR(second["kinetic_energy"].front(), first.last("kinetic_energy"), 1e-3 * first.last("kinetic_energy"));
    EXPECT_NEAR(second["free_energy"].front(), first.last("free_energy"), 1e-5 * first.summary.reference_energy);

    std::get<ResultFrame>(next.shape).modes = {{.amplitude = 0.1, .l = {}, .n = 2}};
    const std::string message = test::message_of<CaseError>([&] { run_case(next); });
    EXPECT_CONTAINS(message, "must be absent: modes and noise are those of closed cells");
}

// What no distance allows ends a run with what to free.
TEST(Patches, aBeadBeyondAFixedArea) {
    const Outcome o = run_case(parse_case(
        "tier = \"axisym\"\n[energy]\nk20 = 0.1\n[model]\narea = \"fixed\"\nrim = \"hinged\"\nbead_width = 0.1\n"
        "extension = {time = [0, 0.1], value = [0, 0.4]}\n[shape]\nkind = \"patch\"\nradius = 0.6\nheight = 0.05\n"
        "[accuracy]\nenergy = 1e-3\n[time]\nend = 0.1\n",
        {}, "case.toml"));
    EXPECT_EQ(o.summary.stop.reason, Stop::solver_failed) << o.summary.stop.message;
    EXPECT_CONTAINS(o.summary.stop.advice, "a fixed area allows only some distances");
}

TEST(Patches, refusals) {
    const auto refused = [](const std::string& text, const std::vector<std::string>& sets) {
        return test::message_of<CaseError>([&] {
            const Case c = parse_case(text, sets, "case.toml");
            c.equilibrium ? run_shapes(c) : run_case(c);
        });
    };
    const auto says = [&](const std::string& text, const std::vector<std::string>& sets, const std::string& words) {
        const std::string message = refused(text, sets);
        EXPECT_CONTAINS(message, words);
    };
    const std::string text = fmt::format(fmt::runtime(moving), "stokes", "hinged") + "[time]\nend = 0.01\n";
    says(text, {"shape.height=0"}, "model.area must leave the area free where the patch is flat: give shape.height");
    says(text, {"model.area=reservoir", "discretisation.parametrisation=material"}, "flows in through the ring");
    says(text, {"model.kind=fluid", "velocity={initial=\"rotation\", omega=1}"}, "the ring holds the membrane");
    says(text, {"energy.H0=sin(area)"}, "energy.H0 must be a number where the shape is a patch");
    says(text, {"discretisation.smoothness=1"}, "four points per element do not determine them");
    says(text, {"energy.alpha=1"}, "energy.alpha must be absent");
    says(text, {"tier=surface3d"}, "tier surface3d has closed surfaces and periodic tubes");
    says(plate, {"equilibrium.held=reduced-volume", "model.pressure=0"}, "must not be \"reduced-volume\"");
    says(plate, {"equilibrium.held=area-and-volume", "model.pressure=0", "shape.height=0.1"}, "they are one condition");
    says(plate, {"equilibrium.branch={vary=\"shape.height\", to=1, step=0.1}"}, "it is the distance of the rings");
    says(plate, {"model.rim=hinged", "shape={kind=\"sphere\", radius=1}"}, "it says how a patch is held");
    says(plate, {"model.bead_width=0.6"}, "must be small beside the shape");
}

}  // namespace tubule::axisym::patch_test
