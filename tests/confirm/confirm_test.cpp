// Which points are run in three dimensions, from which starts, and what their results are taken to say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/case/read.hpp"
#include "tools/confirm/picks.hpp"
#include "tools/confirm/surface_point.hpp"

namespace tubule::confirm {
namespace {

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
[energy]
k20 = 1.0
k42 = 4.0
H0 = -2.0
[model]
kind = "overdamped"
volume = "free"
[shape]
kind = "tube"
radius = 1.0
length = 12.0
[[shape.mode]]
amplitude = 1e-3
n = 1
[accuracy]
r_min = 0.05
[discretisation]
elements = 20
[time]
end = 5.0
stationary = 1e-6
)";

PointResult straight() {
    PointResult p;
    p.outcome = Outcome::uniform_tube;
    p.measures.fill(0);
    p[Measure::volume] = 3.141592653589793 * 12;  // radius 1
    p[Measure::E_ref] = 1;
    return p;
}

// maths 5 (b) at P = 0, where f + F1/R + sigma0 = 0: R = k20 = 1, h = -1 - H0 = 1, F1 = F2 = 2.
double rate(int n, int m) {
    const double q = 2 * 3.141592653589793 * n / 12, Q = q * q + m * m, Z = Q - 1;
    const double F2 = 2, F1 = 2, k42 = 4, G = F2 * Z * Z - 2 * F1 * q * q + 2 * k42 * q * q * q * q;
    return -Q * G / (Q + 1);
}

TEST(Confirm, explainsByTheRatesOfWavesThatFit) {
    const auto all = explain(parse_case(tube, {}, "tube.toml"), straight());
    ASSERT_EQ(all.size(), 1u);  // it ends where it began
    ASSERT_EQ(all[0].waves.size(), 3u);
    for (const theory::FittingWave& wave : all[0].waves) {
        double most = -1e300;
        for (int n = wave.m < 2 ? 1 : 0; n < 10; ++n) most = std::max(most, rate(n, wave.m));
        EXPECT_NEAR(wave.rate, most, 1e-12 * std::abs(most)) << wave.m;
    }
    EXPECT_LT(all[0].waves[0].rate, 0);  // k42 > 3 k20: it does not pearl (maths 5, thresholds) ...
    EXPECT_GT(all[0].waves[1].rate, 0);  // ... but buckle, as P = 0 < -2 (1 + c) = 2
}

TEST(Confirm, makesACaseInThreeDimensions) {
    const Case c = parse_case(tube, {}, "tube.toml");
    const auto waves = added_waves(c, straight());
    const Case s = parse_case(surface_case(c, waves, {.elements = 123, .noise = 2e-3, .end = 7.0}), {}, "s.toml");
    EXPECT_EQ(s.tier, Tier::surface3d);
    EXPECT_EQ(s.surface.elements, 123);
    EXPECT_EQ(s.time.end, 7);
    EXPECT_FALSE(s.time.stationary);
    EXPECT_EQ(s.energy.k, c.energy.k);
    const auto& modes = std::get<Tube>(s.shape).modes;
    ASSERT_EQ(modes.size(), 1 + waves.size());
    EXPECT_EQ(modes[0].m, 0);
    EXPECT_EQ(modes[0].amplitude, 1e-3);  // as in tier 1
    std::set<int> around;
    for (std::size_t i = 1; i < modes.size(); ++i) {
        EXPECT_EQ(modes[i].amplitude, 2e-3);
        around.insert(modes[i].m);
    }
    EXPECT_EQ(around, (std::set<int>{1, 2}));
}

TEST(Confirm, refusesShapesThatItCannotPerturb) {
    const std::string ellipsoid =
        "tier = \"axisym\"\n[energy]\nk20 = 1.0\n[shape]\nkind = \"ellipsoid\"\n"
        "a = 1.0\nb = 1.0\nc = 0.8\n[time]\nend = 1.0\n";
    EXPECT_THROW(added_waves(parse_case(ellipsoid, {}, "ellipsoid.toml"), straight()), CaseError);
}

}  // namespace
}  // namespace tubule::confirm
