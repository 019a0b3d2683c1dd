// A neck that closes: followed to r_min, and distinguished from one that does not.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/axisym/reference.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::axisym::pinch_off_test {

Case neck_case(double amplitude, double end) {
    return tube_case(bending(0.2, -2), 1, 2, {{amplitude, 1}}, end);
}

TEST(PinchOff, thresholdsAreCrossedWhenTheReferenceDoes) {
    // Expected: the independent reference, times to 1e-8. Each floor ends a run of its own, at the root IDA finds.
    for (const auto& crossing : reference::pinch_off) {
        SCOPED_TRACE(crossing.r_min);
        Case c = neck_case(0.6, 1);
        c.accuracy.energy = 1e-7;
        c.accuracy.r_min = crossing.r_min;
        const Outcome o = run_case(c);
        ASSERT_EQ(o.summary.stop.reason, Stop::pinch_off) << o.summary.stop.message;
        EXPECT_NEAR(o.summary.stop.time / crossing.time, 1, 1e-5);
        EXPECT_NEAR(o.last("r_min") / crossing.r_min, 1, 1e-4);
        EXPECT_EQ(o.last("time"), o.summary.stop.time);
        EXPECT_NEAR(o["energy"].front(), reference::pinch_off_energy_start, 1e-7 * o.summary.reference_energy);
        EXPECT_NEAR(o.summary.energy, crossing.energy, 1e-6 * o.summary.reference_energy);  // at a time off by 1e-5
        EXPECT_LE(o.summary.estimated_error, 1e-7);
        EXPECT_TRUE(o.summary.as_accurate_as_asked);
        EXPECT_CONTAINS(o.summary.stop.message, "at z = 1");
    }
}

TEST(PinchOff, oneRunPassesAllThresholds) {
    // The same from the rows of one run to the default floor, interpolated: log r_min is nearly cubic between rows.
    Case c = neck_case(0.6, 1);
    c.accuracy.energy = 1e-7;
    const Outcome o = run_case(c);
    ASSERT_EQ(o.summary.stop.reason, Stop::pinch_off);
    const auto &t = o["time"], &r = o["r_min"];
    for (const auto& crossing : reference::pinch_off) {
        if (crossing.r_min <= 0.001) continue;
        std::size_t i = 2;
        while (r[i] > crossing.r_min) ++i;
        double time = 0;  // Lagrange, through four rows
        for (std::size_t j = i - 2; j < i + 2; ++j) {
            double weight = 1;
            for (std::size_t k = i - 2; k < i + 2; ++k)
                if (k != j) weight *= (std::log(crossing.r_min) - std::log(r[k])) / (std::log(r[j]) - std::log(r[k]));
            time += weight * t[j];
        }
        EXPECT_NEAR(time / crossing.time, 1, 1e-5) << crossing.r_min;
    }
}

TEST(PinchOff, criticalAmplitudeIsBetween) {
    // Expected: the reference's bracket of the critical amplitude, 0.38103 ... 0.38104. E = 0 on the tube r = 1/2.
    for (double asked : {1e-4, 1e-6}) {
        Case below = neck_case(0.380, 3), above = neck_case(0.382, 3);
        below.accuracy.energy = above.accuracy.energy = asked;
        const Outcome tube = run_case(below), pinched = run_case(above);
        EXPECT_EQ(tube.summary.stop.reason, Stop::finished) << tube.summary.stop.message;
        EXPECT_NEAR(tube.last("r_min"), 0.5, 1e-5);
        EXPECT_NEAR(tube.last("r_max"), 0.5, 1e-5);
        EXPECT_NEAR(tube.summary.energy, 0, 1e-9);
        EXPECT_EQ(pinched.summary.stop.reason, Stop::pinch_off) << pinched.summary.stop.message;
    }
}

}  // namespace tubule::axisym::pinch_off_test
