// INT s_m dt from rates at some times, against integrals by hand.
#include "tools/auto/noise_growth.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "common/theory/dispersion.hpp"
#include "tools/auto/waves.hpp"

namespace tubule::noise_growth_test {

TEST(NoiseGrowth, constantRatesGiveExponentials) {
    NoiseGrowth growth(1e-6, 2);
    for (const double t : {0.0, 0.3, 1.0, 4.0}) growth.add(t, {2.0, -1.0});
    for (const double t : {0.0, 0.2, 1.0, 2.7, 4.0}) {
        EXPECT_NEAR(growth.amplitude(1, t) / (1e-6 * std::exp(2 * t)), 1, 1e-13);
        EXPECT_NEAR(growth.amplitude(2, t), 1e-6, 1e-20);  // noise stays noise
    }
    // 1e-6 exp(2 t) = 1e-3 at t = 3 ln(10)/2.
    const auto at = growth.reached(1e-3);
    ASSERT_TRUE(at);
    EXPECT_EQ(at->m, 1);
    EXPECT_NEAR(at->time, 1.5 * std::log(10.0), 1e-12);
    EXPECT_FALSE(growth.reached(1e-2));
    EXPECT_EQ(growth.error(1), 0);
}

TEST(NoiseGrowth, linearRatesAreIntegratedExactly) {
    // s = t - 1: noise until t = 1, then exp((t-1)^2/2) times that: what decayed before t = 1 is replaced.
    NoiseGrowth growth(1e-4, 1);
    for (const double t : {0.0, 0.7, 1.6, 2.0, 5.0}) growth.add(t, {t - 1});
    for (const double t : {0.5, 1.0, 1.2, 1.6, 1.9, 3.0, 5.0}) {
        const double since = std::max(t - 1, 0.0);
        EXPECT_NEAR(growth.amplitude(1, t) / (1e-4 * std::exp(since * since / 2)), 1, 1e-12) << t;
    }
    EXPECT_NEAR(growth.reached(1e-2)->time, 1 + std::sqrt(2 * std::log(100.0)), 1e-12);
}

TEST(NoiseGrowth, growthThatEndsBetweenTwoTimesIsSeen) {
    // s = 2 - t: largest at t = 2, exp(2) times the noise, and the same again as at t = 1 at t = 3.
    NoiseGrowth growth(1e-3, 1);
    for (const double t : {0.0, 1.5, 4.0}) growth.add(t, {2 - t});
    const auto peak = growth.largest();
    EXPECT_NEAR(peak.time, 2, 1e-12);
    EXPECT_NEAR(peak.amplitude / (1e-3 * std::exp(2.0)), 1, 1e-12);
    EXPECT_NEAR(growth.amplitude(1, 3), growth.amplitude(1, 1), 1e-15);
    EXPECT_NEAR(growth.amplitude(1, 4), 1e-3, 1e-15);
    // 2 t - t^2/2 = 1.9 at t = 2 - sqrt(0.2), inside the second interval.
    EXPECT_NEAR(growth.reached(1e-3 * std::exp(1.9))->time, 2 - std::sqrt(0.2), 1e-11);
}

TEST(NoiseGrowth, theFirstOfTwoModesToArriveIsTold) {
    NoiseGrowth growth(1e-6, 3);
    // ln(1000) at t = ln(1000)/2 by the second mode; the third begins later but is faster in the end.
    for (int i = 0; i <= 8; ++i) growth.add(i, {0.5, 2, 0.4 * i});
    EXPECT_EQ(growth.reached(1e-3)->m, 2);
    EXPECT_NEAR(growth.reached(1e-3)->time, std::log(1000.0) / 2, 1e-12);
    EXPECT_EQ(growth.largest().m, 2);
}

TEST(NoiseGrowth, goesOnFromAmplitudes) {
    NoiseGrowth growth(1e-6, 2);
    growth.begin_with({1e-4, 1e-9});
    growth.add(3, {1, 1}), growth.add(4, {1, 1});
    EXPECT_NEAR(growth.amplitude(1, 4) / (1e-4 * std::exp(1.0)), 1, 1e-13);
    EXPECT_NEAR(growth.amplitude(2, 4) / (1e-6 * std::exp(1.0)), 1, 1e-13);  // never below the noise
    growth.forget();
    growth.add(0, {0, 0});
    EXPECT_NEAR(growth.amplitude(1, 0), 1e-6, 1e-20);
    EXPECT_THROW(growth.add(0, {0, 0}), std::invalid_argument);
    EXPECT_THROW(growth.add(1, {0}), std::invalid_argument);
}

TEST(NoiseGrowth, errorOfCurvedRatesIsTold) {
    // s = t^2: the trapezoids of step h make h^2 t/6 too much of the integral, here 0.01 * 2/6.
    NoiseGrowth growth(1e-6, 1);
    for (int i = 0; i <= 20; ++i) growth.add(i / 10.0, {i * i / 100.0});
    const double off = std::log(growth.amplitude(1, 2) / 1e-6) - 8.0 / 3;
    EXPECT_NEAR(off, 0.01 * 2 / 6, 1e-12);
    EXPECT_NEAR(growth.error(1), off, 0.06 * off);  // the first interval has no second difference
}

TEST(WaveRates, inertiaOnlySlowsWavesThatGrow) {
    // Against the fluid's dispersion relation theory.md (5.12): exact for m = 0, where all models flow alike, an upper
    // bound for others. The friction belongs to the Stokes flow.
    for (const double Re : {0.3, 3.0, 30.0})
        for (const int m : {0, 1, 2})
            for (const double tension : {0.0, -20.0, 3.0}) {
                theory::UniformTube tube{{}, 0.9, tension};
                tube.energy.k[0] = 0.7, tube.energy.H0 = -1.5;
                const auto rate = [&](ModelKind kind) {
                    const double gamma = kind == ModelKind::overdamped ? 1 : 0.2;
                    const MotionLaw law = motion_law({.kind = kind, .Re = Re, .gamma = gamma, .keeps_volume = {}});
                    return theory::growth(tube, law, 0.8, m).rate();
                };
                const double estimate = rate_with_inertia(rate(ModelKind::stokes), rate(ModelKind::overdamped)),
                             fluid = rate(ModelKind::fluid);
                if (m == 0) {
                    EXPECT_NEAR(estimate / fluid, 1, 1e-10);
                }
                if (fluid <= 0) continue;
                EXPECT_GE(estimate, fluid * (1 - 1e-10));
                EXPECT_LT(estimate, 1.2 * fluid) << "Re " << Re << ", m " << m;
                EXPECT_LT(estimate, rate(ModelKind::stokes));
            }
}

// The limits of the quadratic equation: the Stokes rate where inertia is small, +- sqrt(overdamped) where it is large.
TEST(WaveRates, haveTheSignOfWhatResistsMore) {
    for (const double sign : {-1.0, 1.0}) {
        EXPECT_NEAR(rate_with_inertia(sign * 5e-4, -3 * sign), sign * 5e-4, 1e-9);
        EXPECT_NEAR(rate_with_inertia(-10, 0.01), 0.1, 1e-3);
        EXPECT_LE(rate_with_inertia(10, -0.01), 0);
    }
}

}  // namespace tubule::noise_growth_test
