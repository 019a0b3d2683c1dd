// Surfaces that come to rest: motions whose distance to rest is known at every time.
#include "common/run/stationarity.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/case/read.hpp"
#include "common/run/energy_checks.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::stationarity_test {

constexpr double area = 4 * pi;  // of size 1

Case case_with(double stationary) {
    Case c;
    c.model.kind = ModelKind::gradient_flow;
    c.time.end = 1000;
    c.time.stationary = stationary;
    return c;
}

// A distance a exp(-t/10) has the speed a exp(-t/10)/10; what it dissipates, with friction 1, is its square times the
// area.
double dissipation(double a, double t) {
    const double speed = a * std::exp(-t / 10) / 10;
    return speed * speed * area;
}

TEST(Stationarity, WaitsUntilTheDistanceIsSmall) {
    Case c = case_with(1e-4);  // distances of 0.01
    c.time.end = 100;
    const Problem problem(c);
    Stationarity settling(problem);
    double settled_at = -1;
    for (double t = 0; t < 100 && settled_at < 0; t += 0.5)
        if (settling.is_settled(t, dissipation(0.034, t), area)) settled_at = t;
    EXPECT_NEAR(settled_at, 10 * std::log(3.4), 0.5);
}

TEST(Stationarity, NoiseOfTheSpeedIsNoRest) {
    Case c = case_with(1e-4);
    c.time.end = 100;
    const Problem problem(c);
    Stationarity settling(problem);
    for (int i = 0; i < 1000; ++i)  // 1e-3 of it, from step to step
        EXPECT_FALSE(settling.is_settled(0.01 * i, dissipation(0.034, 0.01 * i) * (1 + 0.002 * (i % 2)), area)) << i;
}

TEST(Stationarity, NothingSettlesThatDoesNotSlowDown) {
    const Case c = case_with(1e-4);
    const Problem problem(c);
    Stationarity settling(problem);
    EXPECT_FALSE(settling.is_settled(0, 1e-8, area));  // how it changes is unknown as yet
    EXPECT_FALSE(settling.is_settled(1, 1e-8, area));
    EXPECT_FALSE(settling.is_settled(30, 1e-8, area));
    EXPECT_TRUE(settling.is_settled(60, 1e-8, area));
    EXPECT_TRUE(settling.is_settled(90, 2e-8, area));
    EXPECT_TRUE(settling.is_settled(91, 0, area));
}

TEST(Stationarity, NoFartherThanUntilTheEnd) {
    Case c = case_with(1e-4);
    c.time.end = 0.6;  // at a speed of 0.0034, less than 0.01
    const Problem problem(c);
    Stationarity settling(problem);
    settling.is_settled(0, dissipation(0.034, 0), area);
    settling.is_settled(0.5, dissipation(0.034, 0.5), area);
    EXPECT_TRUE(settling.is_settled(0.55, dissipation(0.034, 0.55), area));
}

TEST(ErrorScale, IsTheEnergyOfTheStartWhereTheCaseHasItSo) {
    Case c;
    EXPECT_EQ(reference_energy(c, -3, 100), 100);
    c.accuracy.relative_to_energy = true;
    EXPECT_EQ(reference_energy(c, -3, 100), 3);
    EXPECT_THROW(reference_energy(c, -1e-8, 100), CaseError);
}

TEST(ErrorScale, AFormulaThatOverflowsIsRefused) {
    Case c;
    c.places["energy.term.0.formula"] = "case.toml:3:7";
    c.energy.terms = {
        {.modulus = 1, .formula = std::make_shared<const Formula>(parse_formula("exp(H)", EnergyTerm::variables))}};
    EXPECT_EQ(reference_energy(c, -3, 100), 100);
    EXPECT_EQ(test::message_of([&] { reference_energy(c, HUGE_VAL, HUGE_VAL); }),
              "case.toml:3:7: energy.term.0.formula must be finite on the initial shape, but it overflows there");
}

TEST(ErrorScale, DoubtsWhatHidesTheEnergyOrItsFall) {
    Case c;
    c.accuracy.energy = 0.01;
    EXPECT_EQ(doubt_before(c, 1, 100), "");
    EXPECT_EQ(doubt_before(c, -1, 100), "");
    EXPECT_NE(doubt_before(c, 0.9, 100), "");
    EXPECT_EQ(doubt_after(c, Stop::finished, 10, 9, 100), "");
    EXPECT_CONTAINS(doubt_after(c, Stop::finished, 10, 9.1, 100), "set accuracy.energy below 0.009");
    EXPECT_EQ(doubt_after(c, Stop::pinch_off, 10, 9.1, 100), "");
    EXPECT_EQ(doubt_after(c, Stop::finished, 10, 10, 100), "") << "it was at rest";
}

}  // namespace tubule::stationarity_test
