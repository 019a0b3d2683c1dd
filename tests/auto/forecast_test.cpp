// What a trial run tells of the whole run.
#include "tools/run/forecast.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/case/read.hpp"
#include "tools/run/trial_run.hpp"

namespace tubule {
namespace {

Pilot pilot(int steps, double first, double growth) {
    Pilot out;
    double time = 0;
    for (double step = first; steps > 0; --steps, step *= growth) out.progress(time += step, 0, step);
    return out;
}

TEST(Pilot, CountsTheStepsThatAreLeft) {
    EXPECT_DOUBLE_EQ(pilot(10, 0.01, 1).all_by_done(1), 10);
    // While steps grow, fewer are left than at the last one's length.
    EXPECT_LT(pilot(10, 1e-4, 1.5).all_by_done(1), (1 / (1e-4 * std::pow(1.5, 9)) + 10) / 10);
}

TEST(Pilot, CollapsesWhereItsStepsBecomeFarShorterThanTheyWere) {
    EXPECT_FALSE(pilot(10, 0.01, 1).has_collapsed());
    EXPECT_FALSE(pilot(20, 1e-6, 1.6).has_collapsed());
    EXPECT_FALSE(pilot(10, 0.01, 0.9).has_collapsed());
    EXPECT_TRUE(pilot(10, 0.01, 0.5).has_collapsed());
}

TEST(MotionForecast, FinerRunsMayFollowForRoughFluids) {
    const auto may_follow = [](const std::string& kind, const std::string& shape) {
        const std::string text =
            "tier = \"surface3d\"\n[energy]\nk20 = 0.125\nk42 = 0.12\n[shape]\n" + shape + "[time]\nend = 0.005\n";
        return forecast(parse_case(text, {"model.kind=" + kind, "accuracy.energy=1e-3"}, "case.toml")).finer_runs;
    };
    EXPECT_TRUE(may_follow("fluid", "kind = \"capsule\"\nradius = 0.5\nlength = 1.0\n"));
    EXPECT_FALSE(may_follow("fluid", "kind = \"ellipsoid\"\na = 1.3\nb = 1\nc = 0.8\n"));
}

}  // namespace
}  // namespace tubule
