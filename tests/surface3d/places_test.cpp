// Potentials of places and beads on moving surfaces: their force against the energy, implicit steps, runs against
// tier axisym and exact motions, guards, resumption.
#include "surface3d/fem/places.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "surface3d/meshing/remesh.hpp"
#include "surface3d/motion/step_solver.hpp"
#include "tests/support/message_of.hpp"
#include "tests/surface3d/motion.hpp"
#include "tests/surface3d/run_case.hpp"
#include "tests/surface3d/smooth_field.hpp"

namespace tubule::surface3d::places_test {

Potential particle(double radius, double strength, double range) {
    return {.kind = Potential::Kind::sphere, .radius = radius, .strength = strength, .range = range};
}

// theory.md (2.22), (2.23): the force is the negative rate of INT W dS, the rates of G and of the distance are theirs.
// The assembled forms have the averaged normal and the recovered H: equal up to the error of the mesh.
TEST(Places, ForcesAreRatesOfEnergyAndDistance) {
    const Sphere wavy{.radius = 1, .modes = {{0.1, 2, 1}, {0.05, 3, 2}}};
    Bending bending{.k = {0, 0, 0}};
    bending.potentials = {
        particle(0.6, 1.3, 0.3),
        {.kind = Potential::Kind::formula,
         .formula = std::make_shared<const Formula>(parse_formula("0.3*x*z + exp(y) + z^2", Potential::in_space))}};
    SurfaceLaw law = motion_law({.kind = ModelKind::fluid, .Re = 2, .gamma = 0.5, .keeps_volume = {}});
    law.beads = Beads{0.3, {}};
    std::vector<double> left;
    for (const int n : {3, 6}) {
        const CurvedMesh mesh = mesh_of(wavy, icosphere(n), 4);
        const SurfaceSpace space(mesh);
        const VectorField v = smooth_at(mesh);
        const auto energy = [&](const CurvedMesh& m) {
            return place_integral(space, m, *potential_density_in_space(bending.potentials));
        };
        const auto distance = [&](const CurvedMesh& m) { return bead_distance(m, law.beads->width); };
        MovingSurface surface(mesh, law, bending, {});
        const MotionUnknowns unknowns(mesh, law, bending);
        StepBase base;
        base.mesh = &mesh, base.fields = surface.fields(mesh);
        base.displacement = base.mesh_velocity = VectorField::Zero(3, mesh.size());
        base.velocity = base.past = Eigen::VectorXd::Zero(3 * mesh.size());
        base.te = 0.1, base.beads = &*surface.beads(), base.bead_numbers = surface.bead_numbers(mesh), base.force = 2;
        StepSystem system;
        assemble(space, unknowns, law, bending, base, system);
        const Eigen::VectorXd V = Eigen::MatrixXd(v.transpose()).reshaped();
        const double falls = rate_of(mesh, v, energy), lengthens = rate_of(mesh, v, distance);
        EXPECT_NEAR(place_rate(space, mesh, *potential_density_in_space(bending.potentials), 0, v), falls,
                    1e-8 * std::abs(falls));
        EXPECT_NEAR(surface.distance_rate(mesh, base.bead_numbers, v), lengthens, 1e-8 * std::abs(lengthens));
        left.push_back(std::abs(system.force.head(V.size()).dot(V) / falls + 1));
        left.push_back(std::abs(system.pulling(base.bead_numbers).head(V.size()).dot(V) / lengthens - 1));
    }
    for (const int i : {0, 1}) {
        EXPECT_GT(std::log2(left[i] / left[2 + i]), 3) << left[i] << " " << left[2 + i];
        EXPECT_LT(left[2 + i], 1e-4);
    }
}

// A step so long that nothing resists is one of Newton's method: a sphere about a particle that is shifted and too
// large comes to its equilibrium, R W' + 2 W = 0, up to the square of what it was off. Explicit in any part of the
// force it would stay off in proportion.
TEST(Places, StepsAreImplicit) {
    const double radius = 0.9, range = 0.2, w = 1.3;
    double R = radius + range;
    for (int i = 0; i < 50; ++i) {
        const double e = std::exp(-(R - radius - range) / range), W = w * (e * e - 2 * e),
                     W1 = -2 * w / range * (e * e - e), W2 = 2 * w / (range * range) * (2 * e * e - e);
        R -= (R * W1 + 2 * W) / (3 * W1 + R * W2);
    }
    Bending bending{.k = {1e-3, 0, 0}};  // whose own force is implicit in part
    bending.potentials = {particle(radius, w, range)};
    std::vector<double> off;
    for (const double by : {0.004, 0.002}) {
        CurvedMesh mesh = mesh_of(Sphere{.radius = R + by, .modes = {}}, icosphere(3), 4);
        for (Eigen::Vector3d& x : mesh.nodes) x += Eigen::Vector3d(0, by, by);
        const auto scheme = make_scheme(scheme_named("euler"), mesh, motion_law({}), bending,
                                        {.relaxation = 1e9});  // nodes move along the normal alone
        const MotionState end = scheme->step(scheme->surface().start(mesh), 1e3).state;
        off.push_back((end.X.colwise().norm().array() - R).abs().maxCoeff());
    }
    EXPECT_LT(off[0], 0.3 * 0.004);  // by 2.4 times of which it is off
    EXPECT_GT(std::log2(off[0] / off[1]), 1.7) << off[0] << " " << off[1];
}

// What a uniform pull draws through its friction: of a fixed area u = (1 - exp(-gamma t))/gamma with inertia, and
// nothing changes its shape. A vesicle along the axis, a tube across it.
TEST(Places, ShapesAreDrawnThroughTheirFriction) {
    const std::string drawn = R"(
energy = {k20 = 0.5, potential = [{kind = "formula", formula = "-z"}]}
shape = {kind = "sphere", radius = 1}
discretisation = {elements = 80}
accuracy = {energy = 1e-3}
time = {end = 0.5}
)";
    for (const bool tube : {false, true})
        for (const std::string kind : {"fluid", "overdamped"}) {
            SCOPED_TRACE(kind + (tube ? " tube" : " sphere"));
            std::vector<std::string> sets{"model={kind=\"" + kind + "\", gamma=2, volume=\"free\"}",
                                          "accuracy.estimate=false"};
            if (tube) {
                sets.insert(sets.end(), {"energy.potential.0.formula=-x", "shape={kind=\"tube\", radius=1, length=2}",
                                         "discretisation.elements=40"});
            }
            const Outcome o = run_case(drawn, sets);
            ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
            const bool inert = kind == "fluid";
            const double speed = inert ? (1 - std::exp(-1.0)) / 2 : 0.5, way = inert ? (0.5 - speed) / 2 : 0.25;
            const double A = 4 * pi, E_ref = o.summary.reference_energy;
            EXPECT_NEAR(o.last("speed"), speed, 6e-3 * speed);
            EXPECT_NEAR(o.last("potential_energy"), -A * way, 1e-3 * A * way);
            EXPECT_NEAR(o.last("potential_force"), tube ? 0 : A, 1e-4 * A);
            EXPECT_NEAR(o.last(tube ? "momentum_z" : "momentum_x"), 0, 1e-9);
            if (inert) {
                EXPECT_NEAR(o.last(tube ? "momentum_x" : "momentum_z"), A * speed, 1e-3 * A * speed);
            }
            for (const double defect : o.series("identity_defect")) EXPECT_LT(std::abs(defect), 1e-3 * E_ref);
            EXPECT_NEAR(o.last("r_max"), tube ? 1 + way : 1, 1e-3);
        }
}

// Expected: `tubule run` of the same case in tier axisym with accuracy.energy = 1e-6.
TEST(Places, TubesFollowAPeriodicField) {
    const std::string wavy = R"(
energy.k20 = 0.5
energy.potential = [{kind = "formula", formula = "0.1*cos(2*pi*z/3) + 0.05*sin(4*pi*z/3) + 0.3*x^2 + 0.3*y^2"}]
shape = {kind = "tube", radius = 0.8, length = 3, mode = [{amplitude = 0.1, n = 1}]}
discretisation = {elements = 40}
accuracy = {energy = 1e-3, estimate = false}
time = {end = 0.3}
)";
    const Outcome o = run_case(wavy, {"model={kind=\"overdamped\", gamma=1, volume=\"free\"}"});
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    const double E_ref = o.summary.reference_energy;
    EXPECT_NEAR(o.last("free_energy"), 14.6423313, 1e-3 * E_ref);
    EXPECT_NEAR(o.last("tension"), 0.1759142, 1e-4);
    EXPECT_NEAR(o.last("force"), 5.7723861, 5e-3);
    for (const double defect : o.series("identity_defect")) EXPECT_LT(std::abs(defect), 2e-3 * E_ref);
    const auto refused = [&](const std::string& W) {
        return test::message_of<CaseError>([&] { run_case(wavy, {"energy.potential.0.formula=" + W}); });
    };
    EXPECT_CONTAINS(refused("cos(z)"), "must have the period 3 of the tube");
}

const std::string pulled = R"(
energy = {k20 = 0.5}
shape = {kind = "sphere", radius = 1}
discretisation = {elements = 100}
accuracy = {energy = 1e-3}
time = {end = 0.015, output = [0.01]}
[model]
kind = "stokes"
gamma = 1
area = "reservoir"
tension = 10
bead_width = 0.3
extension = {time = [0, 0.01, 0.015], value = [0, 0.08, 0.08]}
)";

// Expected: `tubule run` of the same case in tier axisym with accuracy.energy = 1e-6.
TEST(Places, BeadsAreDrawnApart) {
    const Outcome o = run_case(pulled);
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    const double E_ref = o.summary.reference_energy;
    const auto time = o.series("time"), distance = o.series("bead_distance"), force = o.series("force");
    ASSERT_TRUE(std::ranges::count(time, 0.01));
    for (std::size_t i = 0; i < time.size(); ++i)
        EXPECT_NEAR(distance[i] - distance[0], 8 * std::min(time[i], 0.01), 1e-10);
    EXPECT_NEAR(o.last("free_energy"), 150.9922881, 1e-5 * E_ref);
    EXPECT_NEAR(o.last("work"), 1.5487596, 2e-5 * E_ref);
    EXPECT_NEAR(o.last("force"), 6.1088316, 1e-2);
    for (const double defect : o.series("identity_defect")) EXPECT_LT(std::abs(defect), 1e-4 * E_ref);
    EXPECT_LT(o.summary.estimated_error, 1e-3);
    // The same from the frame between on.
    const Record& frame = o.watch.frames.at(1);
    const Restart restart{frame, o.watch.meshes.at(*frame.mesh)};
    Outcome rest = begin(pulled, {});
    rest.summary = run_surface(rest.c, rest.watch, &restart);
    for (const std::string name : {"free_energy", "force", "work", "bead_distance", "energy_error"})
        EXPECT_NEAR(rest.last(name), o.last(name), 1e-9 * E_ref) << name;
}

// Expected: tier axisym, as above.
TEST(Places, AFluidIsDrawnApart) {
    const std::vector<std::string> sets{
        "model={kind=\"fluid\", Re=1, area=\"reservoir\", tension=10, bead_width=0.3, "
        "extension={time=[0, 0.01, 0.015], value=[0, 0.02, 0.02]}}",
        "accuracy.estimate=false"};
    const Outcome o = run_case(pulled, sets);
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    const double E_ref = o.summary.reference_energy;
    const auto time = o.series("time"), distance = o.series("bead_distance"), kinetic = o.series("kinetic_energy");
    for (std::size_t i = 0; i < time.size(); ++i)
        EXPECT_NEAR(distance[i] - distance[0], 2 * std::min(time[i], 0.01), 1e-10);
    EXPECT_NEAR(kinetic.front(), 0.9407256, 1e-5 * E_ref);
    EXPECT_NEAR(o.last("free_energy"), 150.8619626, 1e-4 * E_ref);
    EXPECT_NEAR(o.last("kinetic_energy"), 0.0227448, 2e-5 * E_ref);
    EXPECT_NEAR(o.last("work"), -0.7965711, 5e-5 * E_ref);
    EXPECT_NEAR(o.last("momentum_z"), 0, 1e-9);
    for (const double defect : o.series("identity_defect")) EXPECT_LT(std::abs(defect), 1e-4 * E_ref);
    const Record& frame = o.watch.frames.at(1);  // of the moment when the rate falls
    const Restart restart{frame, o.watch.meshes.at(*frame.mesh)};
    Outcome rest = begin(pulled, sets);
    rest.summary = run_surface(rest.c, rest.watch, &restart);
    for (const std::string name : {"free_energy", "force", "work", "kinetic_energy"})
        EXPECT_NEAR(rest.last(name), o.last(name), 1e-9 * E_ref) << name;
}

// Expected: tier axisym, as above.
TEST(Places, AFluidIsPulledByAForce) {
    const Outcome o = run_case(pulled, {"model={kind=\"fluid\", Re=1, area=\"reservoir\", tension=10, bead_width=0.3, "
                                        "force={time=[0, 0.05], value=[0, 10]}}",
                                        "time={end=0.1, output=[0.05]}", "accuracy.estimate=false"});
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    const double E_ref = o.summary.reference_energy;
    EXPECT_NEAR(o.last("free_energy"), 131.9659324, 2e-5 * E_ref);
    EXPECT_NEAR(o.last("kinetic_energy"), 0.2414227, 2e-5 * E_ref);
    EXPECT_NEAR(o.last("bead_distance"), 1.8954595, 2e-4);
    EXPECT_NEAR(o.last("momentum_z"), 0, 1e-9);
    for (const double defect : o.series("identity_defect")) EXPECT_LT(std::abs(defect), 1e-4 * E_ref);
}

const std::string inflated = R"(
energy = {k20 = 0.1, potential = [{kind = "plane", z = -1.3, strength = 0.1, range = 0.2}]}
model = {volume = "free", pressure = 5}
shape = {kind = "sphere", radius = 1}
discretisation = {elements = 180}
accuracy = {energy = 1e-3}
time = {end = 10}
)";

TEST(Places, Guards) {
    const Outcome passed = run_case(inflated, {"energy.potential.0.range=0.3", "accuracy.estimate=false"});
    EXPECT_EQ(passed.summary.stop.reason, Stop::undefined) << passed.summary.stop.message;
    EXPECT_CONTAINS(passed.summary.stop.message, "behind the wall of a potential");
    const Outcome coarse =
        run_case(inflated, {"energy.potential.0.range=0.06", "energy.potential.0.z=-1.06", "accuracy.estimate=false"});
    EXPECT_EQ(coarse.summary.stop.reason, Stop::resolution_lost);
    EXPECT_CONTAINS(coarse.summary.stop.message, "times the range of the wall there apart");
    const Outcome undefined =
        run_case(inflated, {"energy.potential=[{kind=\"formula\", formula=\"0.1*sqrt(z + 1.3)\"}]",
                            "accuracy.estimate=false", "discretisation.order=2"});
    EXPECT_EQ(undefined.summary.stop.reason, Stop::undefined) << undefined.summary.stop.message;
    for (const double E : undefined.series("energy")) EXPECT_TRUE(std::isfinite(E));
    const Outcome bead = run_case(pulled, {"model.bead_width=0.05", "accuracy.estimate=false"});
    EXPECT_EQ(bead.summary.stop.reason, Stop::resolution_lost);
    EXPECT_CONTAINS(bead.summary.stop.message, "times model.bead_width apart");
    const Outcome full =
        run_case(pulled, {"model={kind=\"overdamped\", bead_width=0.3, extension={time=[0, 0.01], value=[0, 0.9]}}",
                          "shape={kind=\"ellipsoid\", a=1, b=1, c=1.1}", "accuracy.estimate=false",
                          "discretisation.step=0.005"});
    EXPECT_EQ(full.summary.stop.reason, Stop::solver_failed);
    EXPECT_CONTAINS(full.summary.stop.advice, "fixed area and volume allow only some");
    const auto refused = [](const std::string& text, const std::vector<std::string>& sets) {
        return test::message_of<CaseError>([&] { run_case(text, sets); });
    };
    EXPECT_CONTAINS(refused(inflated, {"energy.potential.0.z=-0.9"}), "a point of it is 0.1 behind one");
    EXPECT_CONTAINS(refused(pulled, {"model.bead_width=1.2"}), "must be small beside the shape");
    EXPECT_CONTAINS(refused(pulled, {"model={kind=\"overdamped\", bead_width=0.3, force=5}"}),
                    "no other shape has these");
    EXPECT_CONTAINS(refused(inflated, {"shape={kind=\"tube\", radius=1, length=6}"}),
                    "only valid with a closed surface");
}

// Wider triangles where nothing acts, small ones at a wall and at beads: a new mesh of a surface that was coarse there.
TEST(Places, NewMeshesResolveThem) {
    const CurvedMesh mesh = mesh_of(Sphere{.radius = 1, .modes = {}}, icosphere(4), 4);
    const Potential wall{.kind = Potential::Kind::plane, .z = -1.1, .strength = 1, .range = 0.1};
    const std::vector<Potential> potentials{wall};
    EXPECT_GT(wall_coarseness(mesh, potentials).value, coarsest_place);
    RemeshOptions options;
    options.largest = largest_edges(mesh, potentials, std::nullopt, BeadNumbers::Zero());
    const auto found = remesh(mesh, Eigen::MatrixXd(0, mesh.size()), options);
    ASSERT_TRUE(std::holds_alternative<Remeshed>(found));
    EXPECT_LT(wall_coarseness(std::get<Remeshed>(found).mesh, potentials).value, 0.9 * coarsest_place);
    const Beads beads{0.15, {}};
    const auto numbers = [&](const CurvedMesh& on) {
        return bead_numbers(SurfaceSpace(on), on, BeadEquations(beads.width, BeadEquations::in_space), 1);
    };
    EXPECT_GT(bead_coarseness(mesh, numbers(mesh), beads.width).value, 0.9 * coarsest_place);
    options.largest = largest_edges(mesh, {}, beads, numbers(mesh));
    const auto other = remesh(mesh, Eigen::MatrixXd(0, mesh.size()), options);
    ASSERT_TRUE(std::holds_alternative<Remeshed>(other));
    const CurvedMesh& finer = std::get<Remeshed>(other).mesh;
    EXPECT_LT(bead_coarseness(finer, numbers(finer), beads.width).value, 0.9 * coarsest_place);
}

}  // namespace tubule::surface3d::places_test
