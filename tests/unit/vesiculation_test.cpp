// Vesiculated limits against closed forms: equal spheres, Gauss-Bonnet, and numbers of an independent root finder.
#include "common/theory/vesiculation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace tubule::theory::vesiculation_test {

using std::numbers::pi;

constexpr double area = 4 * pi;

Bending helfrich(double H0) {
    Bending b;
    b.k[term_number("k20")] = 1, b.H0 = H0;
    return b;
}

double volume(double reduced) {
    return reduced * 4 * pi / 3;
}

TEST(Vesiculation, EqualSpheresOfTheSpontaneousCurvatureHaveNoEnergy) {
    for (int n = 2; n <= 5; ++n) {  // n spheres of radius 1/sqrt(n)
        const double root = std::sqrt(static_cast<double>(n));
        const auto limit = vesiculated_limit(helfrich(-2 * root), area, volume(1 / root * (1 + 1e-12)));
        ASSERT_TRUE(limit);
        EXPECT_EQ(limit->others, n - 1);
        EXPECT_NEAR(limit->energy, 0, 1e-9);
        EXPECT_NEAR(limit->other_radius, 1 / root, 1e-5);
    }
}

TEST(Vesiculation, TheLowestOfAllNumbersOfSpheres) {
    // R^2 + n r^2 = 1, R^3 + n r^3 = v by scipy.optimize.brentq, n = 1, 2, 3.
    const struct {
        double v, H0, energy;
        int others;
    } known[]{{0.8, -3, 10.691576858607599, 1},
              {0.77, -2.8, 6.305364038013985, 1},
              {0.7369, -2.88, 2.993970409926846, 1},
              {0.6, -3.5, 3.8151298743771602, 2}};
    for (const auto& k : known) {
        const auto limit = vesiculated_limit(helfrich(k.H0), area, volume(k.v));
        ASSERT_TRUE(limit);
        EXPECT_EQ(limit->others, k.others);
        EXPECT_NEAR(limit->energy, k.energy, 1e-9);
    }
    // Its size: lengths times 3, H0 by 3.
    EXPECT_NEAR(vesiculated_limit(helfrich(-1), 9 * area, 27 * volume(0.8))->energy, known[0].energy, 1e-9);
}

TEST(Vesiculation, ASphereInsideAnother) {
    // R = cos a, r = sin a; H0 = 2/r is that of the inner one, turned over.
    const double a = 0.5, R = std::cos(a), r = std::sin(a), H0 = 2 / r;
    const auto limit = vesiculated_limit(helfrich(H0), area, 4 * pi / 3 * (R * R * R - r * r * r));
    ASSERT_TRUE(limit);
    EXPECT_TRUE(limit->inside);
    EXPECT_EQ(limit->others, 1);
    EXPECT_NEAR(limit->energy, 4 * pi * R * R * std::pow(2 / R + H0, 2), 1e-8);
}

TEST(Vesiculation, TheGaussCurvatureOfSpheresAndNecksIsThatOfASphere) {
    Bending with = helfrich(-3.5);
    with.terms.push_back({.modulus = 0.7, .K = 1});  // INT 0.7 K dS = 2.8 pi
    const double less = vesiculated_limit(helfrich(-3.5), area, volume(0.6))->energy;
    EXPECT_NEAR(vesiculated_limit(with, area, volume(0.6))->energy - less, 2.8 * pi, 1e-6);
}

TEST(Vesiculation, AreaDifferences) {
    // theory.md (2.19): on spheres M = INT H dS = -8 pi (R + r).
    Bending with = helfrich(-3);
    with.alpha = 0.4, with.M0 = -30;
    const auto limit = vesiculated_limit(with, area, volume(0.8)),
               plain = vesiculated_limit(helfrich(-3), area, volume(0.8));
    const double M = -8 * pi * (plain->radius + plain->other_radius);
    ASSERT_EQ(limit->others, 1);
    EXPECT_NEAR(limit->energy, plain->energy + 0.2 * (M + 30) * (M + 30), 1e-9);
}

TEST(Vesiculation, NoneWhereNecksCostMore) {
    Bending stiff = helfrich(-3);
    stiff.k[term_number("k42")] = 1e-3;
    EXPECT_FALSE(vesiculated_limit(stiff, area, volume(0.8)));
    Bending quartic = helfrich(-3);
    quartic.k[term_number("k40")] = 0.1;  // (H-H0)^4 of a neck is finite
    EXPECT_TRUE(vesiculated_limit(quartic, area, volume(0.8)));
    EXPECT_FALSE(vesiculated_limit(helfrich(-3), area, volume(1.01)));
}

}  // namespace tubule::theory::vesiculation_test
