// The critical amplitude as narrowly as the reference brackets it.
#include <gtest/gtest.h>

#include "tests/axisym/reference.hpp"
#include "tests/axisym/runs.hpp"

namespace tubule::axisym::critical_amplitude_test {

TEST(CriticalAmplitudeStudy, agreesWithTheReferenceToItsBracket) {
    const auto pinches = [](double amplitude) {
        Case c = tube_case(bending(0.2, -2), 1, 2, {{amplitude, 1}}, 3);
        c.accuracy.energy = 1e-8;
        const Outcome o = run_case(c);
        EXPECT_TRUE(o.summary.stop.reason == Stop::finished || o.summary.stop.reason == Stop::pinch_off)
            << o.summary.stop.message;
        return o.summary.stop.reason == Stop::pinch_off;
    };
    EXPECT_FALSE(pinches(reference::relaxes_at));
    EXPECT_TRUE(pinches(reference::pinches_at));
}

}  // namespace tubule::axisym::critical_amplitude_test
