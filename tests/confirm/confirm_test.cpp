// Which points are run in three dimensions, from which starts, and what their results are taken to say.
#include "tools/confirm/confirm.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"
#include "surface3d/run/mesh_record.hpp"
#include "surface3d/run/start.hpp"

namespace tubule::confirm::confirm_test {

// A made-up map of 10 x 10: pinched where i + j < 7, else straight; one point failed.
std::vector<Outcome> map() {
    std::vector<Outcome> all(100, Outcome::uniform_tube);
    for (std::size_t p = 0; p < 100; ++p)
        if (p / 10 + p % 10 < 7) all[p] = Outcome::pinched;
    all[99] = Outcome::failed;
    return all;
}

TEST(Picks, takeBothSidesOfTheLineThenCornersThenOthers) {
    const auto picks = pick_points({10, 10}, map(), std::nullopt, 10, 1);
    ASSERT_EQ(picks.size(), 10u);  // as asked
    std::set<std::size_t> points;
    int of[3] = {0, 0, 0};
    for (const Pick& pick : picks) {
        points.insert(pick.point);
        EXPECT_NE(pick.point, 99u);  // it failed
        ++of[static_cast<int>(pick.why)];
        const std::size_t sum = pick.point / 10 + pick.point % 10;
        const bool beside = sum == 6 || sum == 7, corner = pick.point == 0 || pick.point == 9 || pick.point == 90;
        EXPECT_TRUE(pick.why != Why::boundary || beside) << pick.point;  // the line is between these
        EXPECT_TRUE(pick.why != Why::extreme || corner) << pick.point;
    }
    EXPECT_EQ(points.size(), 10u);  // none twice
    EXPECT_GE(of[0], 3);            // half of ten, in pairs that may share a point
    EXPECT_LE(of[0], 5);
    EXPECT_EQ(of[1], 3);  // a quarter, rounded up
    // Each pair has both outcomes, and pairs lie apart.
    EXPECT_NE(map()[picks[0].point], map()[picks[1].point]);
    EXPECT_GE(std::abs(static_cast<int>(picks[0].point / 10) - static_cast<int>(picks[2].point / 10)), 3);
}

TEST(Picks, areTheSameForTheSameSeed) {
    const auto points = [](unsigned seed) {
        std::vector<std::size_t> all;
        for (const Pick& pick : pick_points({10, 10}, map(), std::nullopt, 12, seed)) all.push_back(pick.point);
        return all;
    };
    EXPECT_EQ(points(1), points(1));
    EXPECT_NE(points(1), points(2));
}

TEST(Picks, areAllThereAreIfMoreAreAsked) {
    std::vector<Outcome> outcomes(6, Outcome::uniform_tube);
    outcomes[2] = Outcome::not_run;
    EXPECT_EQ(pick_points({6}, outcomes, std::nullopt, 50, 1).size(), 5u);  // all but the one not run
    EXPECT_TRUE(pick_points({6}, std::vector<Outcome>(6), std::nullopt, 3, 1).empty());
}

const char* const tube = R"(tier = "axisym"
energy = {k20 = 1.0, k42 = 4.0, H0 = -2.0}
model = {kind = "overdamped", volume = "free"}
shape = {kind = "tube", radius = 1.0, length = 12.0, mode = [{amplitude = 1e-3, n = 1}]}
accuracy = {r_min = 0.05}
discretisation = {elements = 20}
time = {end = 5.0, stationary = 1e-6}
)";

PointResult straight() {
    PointResult p;
    p.outcome = Outcome::uniform_tube;
    p.measures.fill(0);
    p[Measure::time] = 2;
    p[Measure::E_ref] = 1;
    return p;
}

// theory.md (5.9) at Sigma = 0, where f + f_H/R + sigma0 = 0: R = k20 = 1, h = -1 - H0 = 1, f_H = f_HH = 2.
double rate(int n, int m) {
    const double q = 2 * pi * n / 12, Q = q * q + m * m, Z = Q - 1;
    const double F2 = 2, F1 = 2, k42 = 4, G = F2 * Z * Z - 2 * F1 * q * q + 2 * k42 * q * q * q * q;
    return -Q * G / (Q + 1);
}

TEST(Confirm, knowsTheFastestWavesThatFit) {
    const auto waves = fastest_waves(parse_case(tube, {}, "tube.toml"));
    ASSERT_EQ(waves.size(), 3u);
    for (const theory::FittingWave& wave : waves) {
        double most = -1e300;
        for (int n = wave.m < 2 ? 1 : 0; n < 10; ++n) most = std::max(most, rate(n, wave.m));
        EXPECT_NEAR(wave.rate, most, 1e-12 * std::abs(most)) << wave.m;
    }
    EXPECT_LT(waves[0].rate, 0);  // k42 > 3 k20: it does not pearl, theory.md (5.22) ...
    EXPECT_GT(waves[1].rate, 0);  // ... but buckle, theory.md (5.23), as Sigma = 0 < -2 (1 + c) = 2
}

TEST(Confirm, makesACaseInThreeDimensions) {
    const Case c = parse_case(tube, {}, "tube.toml");
    const Case s = parse_case(surface_case(c, straight(), {.elements = 123, .noise = 2e-3, .end = 99.0}), {}, "s.toml");
    EXPECT_EQ(s.tier, Tier::surface3d);
    EXPECT_EQ(s.surface.elements, 123);
    EXPECT_EQ(s.time.end, 99);
    const double growing = 6 / fastest_waves(c)[1].rate;  // by e^6
    ASSERT_LT(growing, 99);
    EXPECT_EQ(std::count_if(s.time.output.begin(), s.time.output.end(), [&](double t) { return t <= growing; }), 20);
    EXPECT_EQ(s.time.output.size(), 39u);  // and 20 from there to the end, where there is a frame anyway
    EXPECT_FALSE(s.time.stationary);
    EXPECT_EQ(s.energy.k, c.energy.k);
    const auto& modes = std::get<Tube>(s.shape).modes;
    EXPECT_EQ(modes[0].m, 0);
    EXPECT_EQ(modes[0].amplitude, 1e-3);  // as in tier 1
    std::set<std::pair<int, int>> added;
    for (std::size_t i = 1; i < modes.size(); ++i) {
        EXPECT_NEAR(modes[i].amplitude, 2e-3, 1e-15);
        added.insert({modes[i].n, modes[i].m});
    }
    EXPECT_EQ(added.size() + 1, modes.size());  // none twice
    EXPECT_TRUE(added.contains({1, 1}) && added.contains({1, 2}));
    for (const theory::FittingWave& wave : fastest_waves(c)) EXPECT_EQ(added.contains({wave.n, wave.m}), wave.m > 0);
}

TEST(Confirm, addsWavesToASphereToo) {
    const Case c = parse_case(
        "tier = \"axisym\"\n[energy]\nk20 = 1.0\n[shape]\nkind = \"sphere\"\nradius = 2.0\n"
        "[[shape.mode]]\namplitude = 0.1\nl = 2\n[time]\nend = 1.0\n",
        {}, "sphere.toml");
    const Case s = parse_case(surface_case(c, straight(), {.elements = 60, .noise = 2e-3, .end = {}}), {}, "s.toml");
    const auto& modes = std::get<Sphere>(s.shape).modes;
    ASSERT_EQ(modes.size(), 4u);
    EXPECT_EQ(modes[0].m, 0);
    for (std::size_t i = 1; i < 4; ++i) {
        EXPECT_GT(modes[i].m, 0);
        EXPECT_EQ(modes[i].amplitude, 2e-3);  // relative to the radius, as all are
    }
    EXPECT_TRUE(fastest_waves(c).empty());
}

TEST(Confirm, refusesShapesThatItCannotPerturb) {
    const std::string ellipsoid =
        "tier = \"axisym\"\n[energy]\nk20 = 1.0\n[shape]\nkind = \"ellipsoid\"\n"
        "a = 1.0\nb = 1.0\nc = 0.8\n[time]\nend = 1.0\n";
    EXPECT_THROW(surface_case(parse_case(ellipsoid, {}, "ellipsoid.toml"), straight(), {}), CaseError);
}

// Results of an equilibrium, with rates of m = 0 and 2 that are these, the pair of m = 2 in three dimensions.
EquilibriumEnd pair(double energy, double rate_0, double rate_2, double rate_2_in_3d) {
    Result profile, surface;
    profile.about = surface.about = {{"stop", std::string("finished")}, {"E_ref", 50.0}};
    profile.series = {{"energy", {50}}, {"energy_error", {1e-8}}, {"growth_0", {rate_0}}, {"growth_2", {rate_2}}};
    surface.series = {{"energy", {energy}}, {"energy_error", {1e-3}}};
    const double values[]{rate_2_in_3d, rate_2_in_3d, rate_0};
    for (int i = 0; i < 3; ++i) {
        surface.series["rate_" + std::to_string(i + 1)] = {values[i]};
        surface.series["wave_number_" + std::to_string(i + 1)] = {i < 2 ? 2.0 : 0.0};
    }
    return equilibrium_end(profile, surface);
}

TEST(ConfirmEquilibria, verdicts) {
    EXPECT_EQ(pair(50, -30, -2, -2.01).verdict, Verdict::agrees);
    EXPECT_EQ(pair(50, 3, -2, -2.01).verdict, Verdict::agrees);  // tier axisym has seen m = 0
    EXPECT_EQ(pair(50, -30, 2, 2.01).verdict, Verdict::symmetry_broken);
    EXPECT_EQ(pair(50, -30, 0.02, -0.02).verdict, Verdict::agrees);  // neutral
    EXPECT_EQ(pair(50, -30, -2, 2).verdict, Verdict::other_outcome);
    EXPECT_EQ(pair(50, -30, 2, -2).verdict, Verdict::other_outcome);
    EXPECT_EQ(pair(50.002, -30, -2, -2).verdict, Verdict::agrees);
    EXPECT_EQ(pair(50.004, -30, -2, -2).verdict, Verdict::other_outcome);
    const EquilibriumEnd e = pair(50.002, -30, 2, 2.01);
    EXPECT_NEAR(e.energy_difference, 4e-5, 1e-12);
    EXPECT_EQ(e.m, 2);
    EXPECT_EQ(e.rate, 2.01);
    EXPECT_EQ(e.axisym_rate, 2);
    EXPECT_EQ(e.growing, std::set<int>{2});
}

TEST(ConfirmEquilibria, noAnswerWhereThereIsNoEquilibrium) {
    Result profile, surface;
    profile.about = {{"stop", std::string("finished")}};
    surface.about = {{"stop", std::string("resolution-lost")}};
    EXPECT_EQ(equilibrium_end(profile, surface).verdict, Verdict::no_answer);
    EXPECT_THROW(equilibrium_end(profile, Result{}), std::runtime_error);
}

// A result as a run in three dimensions would leave it: a straight tube whose wave n = 1, m = 1 grows from `first` by
// `factor` in all.
Result growing_tube(double first, double factor) {
    const Case c = parse_case(tube, {}, "tube.toml");
    Result result;
    result.case_text.text = surface_case(c, straight(), {.elements = 60, .noise = 1e-3, .end = {}});
    result.about = {{"stop", std::string("finished")}, {"stop_time", 2.0}, {"estimated_error", 1e-3}};
    for (int i = 0; i <= 10; ++i) {
        Case then = c;
        std::get<Tube>(then.shape).modes = {{first * std::pow(factor, i / 10.0), 1, 1, 0.3}};
        const surface3d::CurvedMesh mesh = surface3d::Start(then).mesh(60, Problem(then).element_order).mesh;
        Record frame;
        frame.time = 0.2 * i;
        frame.mesh = result.meshes.size();
        Array points{"points", {mesh.nodes.size(), 3}, {}};
        for (const Eigen::Vector3d& x : mesh.nodes) points.data.insert(points.data.end(), {x[0], x[1], x[2]});
        frame.arrays = {points};
        result.meshes.push_back(surface3d::cells_of(mesh));
        result.frames.push_back(frame);
        const std::pair<const char*, double> row[] = {{"time", frame.time},  {"energy", 10 + frame.time},
                                                      {"r_min", 1},          {"r_max", 1},
                                                      {"area", 2 * pi * 12}, {"volume", pi * 12}};
        for (const auto& [key, value] : row) result.series[key].push_back(value);
    }
    return result;
}

TEST(Confirm, seesAWaveThatGrows) {
    PointResult axisymmetric = straight();
    axisymmetric[Measure::time] = 1, axisymmetric[Measure::energy] = 10.5, axisymmetric[Measure::E_ref] = 5;
    const SurfaceEnd broken = surface_end(axisymmetric, growing_tube(1e-3, 20));
    EXPECT_EQ(broken.verdict, Verdict::symmetry_broken);
    EXPECT_EQ(broken.n, 1);
    EXPECT_EQ(broken.m, 1);
    EXPECT_NEAR(broken.noise, 1e-3, 1e-5);  // as set, up to the error of the triangles
    EXPECT_NEAR(broken.amplitude, 2e-2, 2e-4);
    EXPECT_NEAR(broken.fit.rate, std::log(20) / 2, 1e-2);           // as made
    EXPECT_NEAR(broken.linear_rate, rate(1, 1), 1e-10);             // of the case, whatever the frames show
    EXPECT_NEAR(broken.energy_difference, (11 - 10.5) / 5, 1e-12);  // at t = 1, where it ended in tier 1

    const SurfaceEnd calm = surface_end(axisymmetric, growing_tube(1e-3, 2));  // not yet three times
    EXPECT_EQ(calm.verdict, Verdict::agrees);
    EXPECT_EQ(calm.outcome, Outcome::uniform_tube);

    axisymmetric.outcome = Outcome::pinched;
    EXPECT_EQ(surface_end(axisymmetric, growing_tube(1e-3, 1)).verdict, Verdict::other_outcome);
    axisymmetric[Measure::time] = 3;  // it was not there then
    EXPECT_EQ(surface_end(axisymmetric, growing_tube(1e-3, 1)).verdict, Verdict::no_answer);
    EXPECT_TRUE(std::isnan(surface_end(axisymmetric, growing_tube(1e-3, 1)).energy_difference));

    Result lost = growing_tube(1e-3, 1);
    lost.about = {{"stop", std::string("solver-failed")}, {"stop_time", 2.0}};
    EXPECT_EQ(surface_end(axisymmetric, lost).verdict, Verdict::no_answer);
    lost.about.clear();
    EXPECT_THROW(surface_end(axisymmetric, lost), std::runtime_error);  // it is still going on
}

}  // namespace tubule::confirm::confirm_test
