// The figure of axisymmetric simulations: what was asked for is what comes out.
#include <gtest/gtest.h>

#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "tests/axisym/reference.hpp"
#include "tests/axisym/runs.hpp"

namespace tubule::axisym::figure_test {

class Figure : public testing::TestWithParam<double> {};

TEST_P(Figure, isAsAccurateAsAsked) {
    // Expected: the independent reference.
    const double asked = GetParam();
    for (const auto& run : reference::figure) {
        SCOPED_TRACE(testing::Message() << "k42 = " << run.k42);
        std::vector<double> times;
        for (const auto& p : run.at) times.push_back(p.time);
        Case c = tube_case(bending(0.2, -2, 0, run.k42), 1, 2, {{0.25, 1, 0, -pi / 2}}, times.back(), times);
        c.accuracy.energy = asked;
        const Outcome o = run_case(c);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        EXPECT_TRUE(o.summary.as_accurate_as_asked);
        EXPECT_LE(o.summary.estimated_error, asked);
        EXPECT_GT(o.summary.estimated_error, 0.02 * asked);  // neither wastes work
        const double E_ref = o.summary.reference_energy;
        EXPECT_NEAR(o["energy"].front(), run.energy_start, asked * E_ref);
        double largest = 0;
        for (const auto& p : run.at) {
            EXPECT_NEAR(o.at("energy", p.time), p.energy, asked * E_ref) << p.time;
            EXPECT_NEAR(o.at("energy_20", p.time), p.energy_20, 10 * asked * E_ref) << p.time;
            EXPECT_NEAR(o.at("energy_42", p.time), p.energy_42, 10 * asked * E_ref) << p.time;
            EXPECT_EQ(o.at("energy_40", p.time), 0);
            EXPECT_NEAR(o.at("r_min", p.time), p.r_min, 20 * asked) << p.time;
            EXPECT_NEAR(o.at("r_max", p.time), p.r_max, 20 * asked) << p.time;
            EXPECT_NEAR(o.at("mode_1", p.time), p.mode_1, 20 * asked) << p.time;
            largest = std::max(largest, std::abs(o.at("energy", p.time) - p.energy) / E_ref);
        }
        std::printf("k42 %.2f, asked %.0e: estimated %.2e, error at the five times %.2e, %d elements, %d attempts\n",
                    run.k42, asked, o.summary.estimated_error, largest, o.summary.elements, o.summary.attempts);
    }
}

INSTANTIATE_TEST_SUITE_P(Asked, Figure, testing::Values(1e-3, 1e-4, 1e-6, 1e-8));

TEST(ReferenceEnergy, isThatOfTheDesign) {
    // E_ref = max(|E(0)|, INT k20 (H^2 + H0^2) + |k42| K^2 dS at t = 0), by the trapezoidal rule.
    double expected = 0;
    const int n = 2048;
    for (int i = 0; i < n; ++i) {
        const double z = 2.0 * i / n, r1 = 0.25 * pi * std::cos(pi * z), r2 = -0.25 * pi * pi * std::sin(pi * z);
        const auto p = graph_point(1 + 0.25 * std::sin(pi * z), r1, r2);
        expected += (0.2 * (p.H * p.H + 4) + 0.06 * p.K * p.K) * p.area * 2 / n;
    }
    const Case c = tube_case(bending(0.2, -2, 0, 0.06), 1, 2, {{0.25, 1, 0, -pi / 2}}, 1e-3);
    EXPECT_NEAR(run_case(c).summary.reference_energy, expected, 1e-4 * expected);
}

}  // namespace tubule::axisym::figure_test
