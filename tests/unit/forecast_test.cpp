// What a pilot run tells of the whole run.
#include "common/run/forecast.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tubule {
namespace forecast_test {

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

}  // namespace forecast_test
}  // namespace tubule
