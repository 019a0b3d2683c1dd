// The stated error against the true one, on 100 random cases.
#include <gtest/gtest.h>

#include "tests/axisym/estimate.hpp"

namespace tubule::axisym {
namespace {

TEST(Estimate, isHonest) {
    const Distribution d = battery(71, 100);
    EXPECT_GE(d.within(0.1, 1), 0.9);
    EXPECT_GE(d.within(0, 1.2), 0.97);
    EXPECT_LE(d.quantile(1), 2.5);  // transients that come and go between two estimates, far below what was asked
    for (const Honesty& h : d.all) EXPECT_LE(h.error, h.asked);
}

}  // namespace
}  // namespace tubule::axisym
