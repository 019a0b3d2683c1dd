// Signs that a surface in motion cannot continue.
#include "surface3d/run/guards.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <map>
#include <regex>

#include "common/case/read.hpp"
#include "common/run/stall.hpp"
#include "common/shapes/capsule.hpp"
#include "common/shapes/sphere.hpp"
#include "common/shapes/torus.hpp"
#include "surface3d/meshing/graded_mesh.hpp"
#include "tests/support/message_of.hpp"
#include "tests/surface3d/errors.hpp"
#include "tests/surface3d/motion.hpp"

namespace tubule::surface3d::guards_test {

// A tube of period 1 whose profile is r = 1 + cos(2 pi s)/2, z = s + bulge sin(2 pi s), displaced by `up`: pancakes,
// whose faces cross those of the next where bulge is more than 1/(2 pi), as z is then less than before around s = 1/2.
CurvedMesh pancakes(double bulge, double up) {
    CurvedMesh mesh = tube_mesh({.radius = 1, .length = 1, .modes = {}}, 8, 16, 3);
    for (Eigen::Vector3d& x : mesh.nodes) {
        const double s = x.z() - up, radius = 1 + std::cos(2 * pi * s) / 2;
        x = {radius * x.x(), radius * x.y(), x.z() + bulge * std::sin(2 * pi * s)};
    }
    return mesh;
}

// As find_bad_shape lets it pass.
MotionMeasures sound_shape() {
    MotionMeasures m;
    m.symbol = 1, m.neck_radius = 1, m.turn.angle = 0.1, m.quality.worst = 1;
    m.narrowest = m.least_symbol = m.turn.where = m.quality.where = Eigen::Vector3d::Zero();
    return m;
}

TEST(SelfIntersection, OfClosedSurfaces) {
    EXPECT_FALSE(find_self_intersection(mapped_mesh(icosphere(3), 4, map_of(Sphere{.radius = 1, .modes = {}}))));
    // Poles pulled through each other: z is mirrored near the axis.
    for (const double dent : {0.9, 1.1}) {
        CurvedMesh mesh = mapped_mesh(icosphere(4), 3, map_of(Sphere{.radius = 1, .modes = {}}));
        for (Eigen::Vector3d& x : mesh.nodes) x.z() *= 1 - dent * std::exp(-8 * x.head<2>().squaredNorm());
        const auto crossing = find_self_intersection(mesh);
        ASSERT_EQ(crossing.has_value(), dent > 1);
        if (dent < 1) continue;
        EXPECT_EQ(crossing->reason, Stop::self_intersection);
        EXPECT_CONTAINS(crossing->message, "the surface intersects itself near (");
    }
}

TEST(SelfIntersection, NotWherePlanesNearlyAgree) {
    // Flat triangles on the cylinder of a capsule lie in common planes, up to rounding, and far from each other.
    for (const double length : {2.0, 5.0})
        for (const int order : {3, 4}) {
            SCOPED_TRACE(testing::Message() << "length " << length << ", order " << order);
            const Capsule capsule{1, length};
            const Curve profile = base(capsule);
            const auto map = map_of(capsule);
            const TriangleMesh rings = graded_rings(resolution_of(map, profile, order), profile, 200);
            EXPECT_FALSE(find_self_intersection(mapped_mesh(rings, order, map)));
        }
}

TEST(SelfIntersection, OfATubeWithItsOwnImages) {
    // Wherever the pancakes stand: within the mesh, or cut by its ends, so that images meet.
    for (const double up : {0.0, 0.25, 0.5}) {
        SCOPED_TRACE(up);
        EXPECT_FALSE(find_self_intersection(pancakes(0.1, up)));
        EXPECT_TRUE(find_self_intersection(pancakes(0.25, up)));
    }
}

TEST(ImpossibleCurvature, IsTold) {
    // A sphere has INT H^2 = 16 pi and INT K = 4 pi, a tube INT K = 0 and no least INT H^2.
    const CurvedMesh sphere = mapped_mesh(icosphere(1), 2, map_of(Sphere{.radius = 1, .modes = {}}));
    const CurvedMesh tube = tube_mesh({.radius = 1, .length = 1, .modes = {}}, 4, 8, 2);
    const auto told = [](const CurvedMesh& mesh, double H2, double K, double allowed) {
        Observables o;
        o.integral_H2 = H2 * 16 * pi, o.integral_K = K * 4 * pi;
        return find_impossible_curvature(o, mesh, allowed).has_value();
    };
    for (const double allowed : {0.01, 0.05}) {
        EXPECT_FALSE(told(sphere, 1 - 0.9 * allowed, 1 + 0.9 * allowed, allowed));
        EXPECT_TRUE(told(sphere, 1 - 1.1 * allowed, 1, allowed));
        EXPECT_TRUE(told(sphere, 1, 1 - 1.1 * allowed, allowed));
        EXPECT_FALSE(told(tube, 0.1, 0.9 * allowed, allowed));
        EXPECT_TRUE(told(tube, 0.1, 1.1 * allowed, allowed));
    }
}

TEST(Energy, RisesAreToldFromErrors) {
    // docs/surface_motion.md: a quarter of the accuracy asked in a step, ten times that accuracy in many.
    EXPECT_FALSE(find_rise_in_step(-1, 1e-2, 3, 0.1));
    EXPECT_FALSE(find_rise_in_step(0.24e-2, 1e-2, 3, 0.1));
    const auto jump = find_rise_in_step(0.26e-2, 1e-2, 3, 0.1);
    ASSERT_TRUE(jump);
    EXPECT_EQ(jump->reason, Stop::resolution_lost);
    EXPECT_EQ(jump->message, "the energy increased by 0.0026 of E_ref in a step of 0.1, which the model forbids");
    EXPECT_FALSE(find_slow_rise(0.09, 1e-2, 3));
    const auto creep = find_slow_rise(0.11, 1e-2, 3);
    ASSERT_TRUE(creep);
    EXPECT_EQ(creep->reason, Stop::resolution_lost);
    EXPECT_EQ(creep->time, 3);
    EXPECT_EQ(creep->message, "the energy gradually increased by 0.11 of E_ref, which the model forbids");
}

TEST(Guards, SpeakWhereANumberIsNone) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(find_rise_in_step(none, 1e-2, 3, 0.1));
    EXPECT_TRUE(find_slow_rise(none, 1e-2, 3));
    const auto drift = find_drift(none, 1e-2, 3);
    ASSERT_TRUE(drift);
    EXPECT_EQ(drift->message, "the volume is not finite");
    const CurvedMesh sphere = mapped_mesh(icosphere(1), 2, map_of(Sphere{.radius = 1, .modes = {}}));
    for (const bool H : {false, true}) {
        Observables o;
        o.integral_H2 = H ? none : 16 * pi, o.integral_K = H ? 4 * pi : none;
        EXPECT_TRUE(find_impossible_curvature(o, sphere)) << H;
    }
    // A shape with no other defect.
    const MotionMeasures well = sound_shape();
    EXPECT_FALSE(find_bad_shape(well, 1e-3, 3));
    MotionMeasures m = well;
    m.symbol = none;
    EXPECT_TRUE(find_bad_shape(m, 1e-3, 3));
    m = well, m.neck_radius = none;
    EXPECT_TRUE(find_bad_shape(m, 1e-3, 3));
    m = well, m.turn.angle = none;
    EXPECT_TRUE(find_bad_shape(m, 1e-3, 3));
    m = well, m.quality.worst = none;
    EXPECT_TRUE(find_bad_shape(m, 1e-3, 3));
}

TEST(Guards, ANeckThatIsTooThinForItsTrianglesAtTheStartIsNotClosing) {
    // It may open: tubes of tier axisym with necks of 0.02 radii do, and 180 triangles do not tell.
    MotionMeasures m = sound_shape();
    m.turn.angle = 3, m.turn.saddle = true;
    EXPECT_EQ(find_bad_shape(m, 1e-3, 0)->reason, Stop::resolution_lost);
    EXPECT_EQ(find_bad_shape(m, 1e-3, 3)->reason, Stop::pinch_off);
    m.turn.saddle = false;
    EXPECT_EQ(find_bad_shape(m, 1e-3, 3)->reason, Stop::resolution_lost);
}

TEST(Guards, AStateIsFiniteInAllItsParts) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    const CurvedMesh mesh = mapped_mesh(icosphere(1), 2, map_of(Sphere{.radius = 1, .modes = {}}));
    const MotionLaw law = motion_law({.kind = ModelKind::fluid, .Re = 1, .gamma = 0, .keeps_volume = {}});
    const MotionState well = MovingSurface(mesh, law, {.k = {1}}, {}).start(mesh);
    EXPECT_TRUE(is_finite(well));
    MotionState s = well;
    s.X(1, 2) = none;
    EXPECT_FALSE(is_finite(s));
    s = well, s.w(1, 2) = none;
    EXPECT_FALSE(is_finite(s));
    s = well, s.u[3] = none;
    EXPECT_FALSE(is_finite(s));
    s = well, s.p[3] = none;
    EXPECT_FALSE(is_finite(s));
    s = well, s.lambda = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(is_finite(s));
}

// What every guard of a motion has to say, at its worst.
std::vector<StopReport> all_reports() {
    MeshQuality folded;
    folded.worst = -1;
    std::vector<StopReport> out{*find_rise_in_step(1, 1e-2, 3, 0.1), *find_slow_rise(1, 1e-2, 3),
                                *find_drift(1, 1e-2, 3), *find_fold(folded)};
    const CurvedMesh sphere = mapped_mesh(icosphere(1), 2, map_of(Sphere{.radius = 1, .modes = {}}));
    for (const bool H : {false, true}) {
        Observables o;
        o.integral_H2 = H ? 0 : 16 * pi, o.integral_K = H ? 4 * pi : 0;
        out.push_back(*find_impossible_motion(o, sphere, 0.05, 3));
        EXPECT_EQ(out.back().time, 3);
    }
    for (const auto& spoil : std::vector<std::function<void(MotionMeasures&)>>{
             [](MotionMeasures& m) { m.symbol = -1; }, [](MotionMeasures& m) { m.neck_radius = 0; },
             [](MotionMeasures& m) { m.turn.angle = 3; }, [](MotionMeasures& m) { m.quality.worst = 0; }}) {
        MotionMeasures m = sound_shape();
        spoil(m);
        out.push_back(*find_bad_shape(m, 1e-3, 3));
    }
    return out;
}

TEST(Guards, AdviseNothingThatACaseRefuses) {
    // Every key that is named, with a value that the documentation allows, in a case that moves. One that such a case
    // does not have is refused.
    const std::map<std::string, std::string> values{
        {"accuracy.energy", "1e-2"},         {"accuracy.r_min", "1e-3"},         {"discretisation.order", "3"},
        {"discretisation.mesh", "graded"},   {"discretisation.relaxation", "1"}, {"discretisation.step", "1"},
        {"discretisation.recovery", "patch"}};
    const std::string moving =
        "tier = \"surface3d\"\n[energy]\nk20 = 1\n[shape]\nkind = \"sphere\"\nradius = 1\n[time]\nend = 1\n";
    EXPECT_THROW(parse_case(moving, {"discretisation.recovery=patch"}, "case.toml"), std::exception);
    const std::regex key("(accuracy|discretisation|model|time)\\.[a-z_0-9]*[a-z0-9]");
    int named = 0;
    for (const StopReport& report : all_reports())
        for (std::sregex_iterator i(report.advice.begin(), report.advice.end(), key), end; i != end; ++i, ++named) {
            const auto found = values.find(i->str());
            ASSERT_NE(found, values.end()) << i->str();
            EXPECT_NO_THROW(parse_case(moving, {found->first + "=" + found->second}, "case.toml")) << report.advice;
        }
    EXPECT_GE(named, 6);
}

// How many steps of one length are taken from t = 1 until they are found to lead nowhere, at most `most`.
int steps_taken(double step, double fall, int most) {
    Stall stall(100, 1e-4, 1e-2, "");
    double time = 1, energy = 1;
    for (int taken = 0; taken < most; ++taken) {
        if (const auto stuck = stall.look(time, step, energy)) {
            EXPECT_EQ(stuck->reason, Stop::solver_failed);
            EXPECT_CONTAINS(stuck->message, "no progress with steps of");
            return taken;
        }
        time += step, energy -= fall;
    }
    return most;
}

TEST(Stall, OnlyStepsThatLeadNowhere) {
    EXPECT_EQ(steps_taken(1e-6, 0, 1000), 101);      // the first look is where it begins
    EXPECT_EQ(steps_taken(2e-5, 0, 1000), 1000);     // a thousandth of the time in 50 steps
    EXPECT_EQ(steps_taken(1e-6, 2e-5, 1000), 1000);  // a tenth of the accuracy in 50 steps
    EXPECT_EQ(steps_taken(1e-6, 5e-6, 1000), 101);   // in 200
}

TEST(Stall, FollowsASingularity) {
    // Steps of 1/125 of what is left until t = 1, as near a pinch-off asked for 1e-4; the energy falls with the root.
    Stall stall(100, 1e-3, 1e-4, "");
    for (int i = 0; i < 1500; ++i) {
        const double left = std::pow(1 - 1.0 / 125, i);
        ASSERT_FALSE(stall.look(1 - left, left / 125, std::sqrt(left))) << "left: " << left;
    }
}

// theory.md 6: on a sphere and on a straight tube, area and volume are one condition.
TEST(NewMesh, WhereAreaAndVolumeAreOneCondition) {
    const Bending bending{.k = {1, 0, 0}, .H0 = 0};
    for (const bool tube : {false, true}) {
        SCOPED_TRACE(tube ? "tube" : "sphere");
        const CurvedMesh mesh = tube ? tube_mesh({.radius = 1, .length = 3, .modes = {}}, 6, 10, 3)
                                     : mapped_mesh(icosphere(3), 3, map_of(Sphere{.radius = 1, .modes = {}}));
        for (const ModelKind kind : {ModelKind::overdamped, ModelKind::stokes, ModelKind::fluid}) {
            // A mesh whose area is 1e-6 too small and, through another error, its volume 4e-6.
            const SurfaceSpace space(mesh);
            const Extent now = extent(space, mesh);
            MotionControl control{.area = now.area * (1 + 1e-6), .volume = now.volume * (1 + 4e-6)};
            control.least_variation =
                std::max(1e-9, 4 * noise_of_H(space, mesh, motion_fields(space, mesh, Projection(space, mesh))));
            const MotionLaw law = motion_law({.kind = kind, .Re = 1, .gamma = 1, .keeps_volume = {}});
            const auto scheme = make_scheme(scheme_named("bdf2"), mesh, law, bending, control);
            const MotionState start = scheme->surface().start(mesh);
            EXPECT_NEAR(extent(space, scheme->surface().mesh(start)).area / *control.area, 1, 1e-12);
            // A sphere's radius grows by half as much, relatively, a tube's by as much.
            const double most = (start.X - node_positions(mesh)).colwise().norm().maxCoeff();
            EXPECT_NEAR(most, tube ? 1e-6 : 0.5e-6, 2e-7);
            // Nor do steps correct the volume: they are those of a run without that defect.
            control.volume = now.volume;
            const auto other = make_scheme(scheme_named("bdf2"), mesh, law, bending, control);
            EXPECT_EQ(scheme->step(start, 1e-6).state.X, other->step(other->surface().start(mesh), 1e-6).state.X);
        }
    }
}

// A capsule of few triangles, whose H is known to 0.2 only, is no sphere: 20 % of the volume of the sphere of its area
// are missing. Of a sphere with waves of 1e-3, 3 (l-1)(l+2)/(16 pi) a^2 = 2.4e-7 (theory.md 6, to second order) are
// missing.
TEST(NewMesh, OnlyNearASphereAreAreaAndVolumeOneCondition) {
    const Capsule capsule{0.913, 3.135};
    const Curve profile = base(capsule);
    const CurvedMesh few =
        mapped_mesh(uniform_rings(resolution_of(map_of(capsule), profile, 3), profile, 113), 3, map_of(capsule));
    const CurvedMesh sphere = mapped_mesh(icosphere(2), 4, map_of(Sphere{.radius = 1, .modes = {{1e-3, 2, 1}}}));
    const MotionLaw law = motion_law({.kind = ModelKind::overdamped, .keeps_volume = {}});
    for (const CurvedMesh* mesh : {&few, &sphere}) {
        SCOPED_TRACE(mesh == &few ? "capsule" : "sphere");
        const SurfaceSpace space(*mesh);
        const MotionFields fields = motion_fields(space, *mesh, Projection(space, *mesh));
        const Extent e = extent(space, *mesh);
        const MotionControl control{.area = e.area,
                                    .volume = e.volume,
                                    .least_variation = 4 * noise_of_H(space, *mesh, fields),
                                    .most_drift = 1e-6};
        const auto scheme = make_scheme(scheme_named("bdf2"), *mesh, law, {.k = {1, 0, 0}, .H0 = 0.958}, control);
        EXPECT_EQ(scheme->surface().area_is_volume(*mesh, fields), mesh == &sphere);
        MotionState state = scheme->surface().start(*mesh);
        for (int i = 0; i < 3; ++i) state = scheme->step(state, 1e-5).state;
        const Extent after = extent(space, scheme->surface().mesh(state));
        EXPECT_NEAR(after.area / e.area, 1, 1e-11);
        EXPECT_NEAR(after.volume / e.volume, 1, mesh == &sphere ? 1e-6 : 1e-11);
    }
}

}  // namespace tubule::surface3d::guards_test
