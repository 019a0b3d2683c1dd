// Growth rates fitted to amplitudes that are known functions of time.
#include "common/theory/growth_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>

namespace tubule::theory::growth_fit_test {

struct Samples {
    std::vector<double> t, a;
    Samples(double end, int n, const std::function<double(double)>& amplitude) {
        for (int i = 0; i <= n; ++i) t.push_back(end * i / n), a.push_back(amplitude(end * i / n));
    }
    GrowthFit fit(double noise = 0) const { return fit_growth(t, a, noise); }
};

TEST(GrowthFit, anExponential) {
    for (const double rate : {-0.7, 1e-3, 2.5}) {
        const auto fit = Samples(3, 1000, [&](double t) { return 1e-5 * std::exp(rate * t); }).fit();
        EXPECT_NEAR(fit.rate, rate, 1e-11);
        EXPECT_LT(fit.error, 1e-10);
        EXPECT_EQ(fit.from, 0);
        EXPECT_EQ(fit.to, 3);
        EXPECT_EQ(fit.points, 200);
    }
}

TEST(GrowthFit, betweenTransientAndSaturation) {
    // A fast decay at first, the logistic's saturation in the end; the rate of 1 in between. Both
    // lower the slope everywhere, by 5.5e-5 at least, which no stretch can tell.
    const auto fit = Samples(30, 300, [](double t) {
                         const double a = 1e-6 * std::exp(t);
                         return a / (1 + a) + 1e-5 * std::exp(-3 * t);
                     }).fit();
    EXPECT_NEAR(fit.rate, 1 - 5.5e-5, fit.error);
    EXPECT_LT(fit.error, 1e-3);
    EXPECT_GT(fit.from, 1);
    EXPECT_LT(fit.to, 14);
    EXPECT_GT(fit.to - fit.from, 1);
}

TEST(GrowthFit, aFloorOfNoise) {
    // A decay that ends in a floor that is not a wave: the floor counts neither by itself nor when named.
    const auto decay = [](double t) { return std::exp(-2 * t) + 1e-7 * (1 + std::sin(40 * t)); };
    for (const double noise : {0.0, 1e-5}) {
        const auto fit = Samples(20, 400, decay).fit(noise);
        EXPECT_NEAR(fit.rate, -2, std::max(fit.error, 1e-5)) << noise;
        EXPECT_LT(fit.error, 1e-3);
    }
}

TEST(GrowthFit, aFloorOfRandomNoise) {
    // As long as the floor is, where log a varies by e-folds from point to point, the decay before it is found.
    std::mt19937 random(1);
    std::normal_distribution<double> drawn;
    const auto fit = Samples(20, 400, [&](double t) { return std::abs(std::exp(-2 * t) + 0.01 * drawn(random)); }).fit();
    EXPECT_NEAR(fit.rate, -2, fit.error);
    EXPECT_LT(fit.error, 0.5);
}

TEST(GrowthFit, tellsThatThereIsNone) {
    // An oscillation has no rate: the error bar is as large as what is found.
    const auto fit = Samples(20, 200, [](double t) { return std::abs(std::cos(3 * t)) + 0.01; }).fit();
    EXPECT_GT(fit.error, 0.3 * std::abs(fit.rate));
}

TEST(GrowthFit, tooFewPointsAreRefused) {
    EXPECT_THROW(fit_growth({0, 1, 2, 3, 4}, {1, 1, 1, 1, 1}), std::invalid_argument);
    EXPECT_THROW(fit_growth({0, 1, 2, 3, 4, 5}, {1, 1, 1, 0, 1, 1}), std::invalid_argument);
    EXPECT_THROW(fit_growth({0, 0, 1, 2, 3, 4}, {1, 1, 1, 1, 1, 1}), std::invalid_argument);  // a time twice
    EXPECT_NO_THROW(fit_growth({0, 1, 2, 3, 4, 5}, {1, 1, 1, 1, 1, 1}));
}

}  // namespace tubule::theory::growth_fit_test
