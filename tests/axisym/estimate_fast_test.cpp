// The stated error against the true one, on 15 random cases.
#include <gtest/gtest.h>

#include "tests/axisym/estimate.hpp"

namespace tubule::axisym {
namespace {

TEST(Estimate, isHonest) {
    const Distribution d = battery(20240, 15);
    EXPECT_GE(d.within(0.1, 1), 0.9);
    EXPECT_LE(d.quantile(1), 1.2);
    for (const Honesty& h : d.all) EXPECT_LE(h.error, h.asked);
}

}  // namespace
}  // namespace tubule::axisym
