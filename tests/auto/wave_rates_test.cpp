// Growth rates that tier auto gives non-axisymmetric modes, under tension, pressure and axial force, against closed
// forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/theory/dispersion.hpp"
#include "tools/auto/waves.hpp"

namespace tubule::wave_rates_test {

constexpr double length = 9, time = 0.5;

// A straight tube of radius 1 at a time.
Record straight_tube() {
    constexpr std::size_t points = 61;
    Record out;
    out.time = time, out.kind = RecordKind::curve;
    out.numbers = {{"length", length}};
    Array r{"r", {points}, std::vector<double>(points, 1.0)}, z{"z", {points}, {}};
    for (std::size_t i = 0; i < points; ++i) z.data.push_back(length * static_cast<double>(i) / (points - 1));
    out.arrays = {r, z};
    return out;
}

// The fastest wave with m = 1, 2, ... that fits the length, at this tension.
std::vector<double> closed_forms(const Case& c, double tension) {
    std::vector<double> out;
    for (int m = 1; m <= c.automatic.modes; ++m) {
        double fastest = -HUGE_VAL;
        for (int n = m == 1 ? 1 : 0; n < 12; ++n)
            fastest = std::max(
                fastest, theory::growth({c.energy, 1, tension}, motion_law(c.model), 2 * pi * n / length, m).rate());
        out.push_back(fastest);
    }
    return out;
}

void expect_closed_forms(const Model& model, double tension) {
    Case c;
    c.energy.k[0] = 0.5, c.energy.k[2] = 0.1, c.energy.H0 = -0.7;
    c.model = model;
    const WaveRates found = wave_rates(c, straight_tube());
    const std::vector<double> expected = closed_forms(c, tension);
    ASSERT_EQ(found.rates.size(), expected.size());
    EXPECT_FALSE(found.estimated);
    for (std::size_t i = 0; i < expected.size(); ++i)
        EXPECT_NEAR(found.rates[i], expected[i], 1e-7 * std::max(1.0, std::abs(expected[i])))
            << name(model) << ", m " << i + 1 << ", tension " << tension;
}

// At half of this time the loads have half of these values.
Ramp twice(double value) {
    return Ramp({0, 2 * time}, {0, 2 * value});
}

// theory.md (5.8) to (5.10), at the tension that is given, and that of (3.21) and (3.22) under a pressure or a force.
TEST(WaveRates, UnderTensionPressureAndForce) {
    const double f = 0.5 * 0.09, f_H = -0.3;  // at H = -1, K = 0
    for (const double tension : {-1.4, 0.8}) {
        const double pressure = f + f_H + tension, force = pi * (f + tension - f_H);
        expect_closed_forms({.keeps_volume = false, .tension = twice(tension), .pressure = twice(pressure)}, tension);
        expect_closed_forms({.keeps_volume = true, .tension = twice(tension)}, tension);
        expect_closed_forms({.keeps_volume = false, .area = AreaRule::fixed, .pressure = twice(pressure)}, tension);
        expect_closed_forms({.keeps_volume = true, .area = AreaRule::fixed, .free_period = true, .force = twice(force)},
                            tension);
        for (const ModelKind kind : {ModelKind::overdamped, ModelKind::stokes}) {
            Model model{.kind = kind, .Re = 2, .gamma = kind == ModelKind::stokes ? 0.3 : 1, .keeps_volume = true};
            model.area = AreaRule::reservoir, model.tension = twice(tension);
            expect_closed_forms(model, tension);
            model.area = AreaRule::fixed, model.tension = {};
            model.free_period = true, model.force = twice(force);
            expect_closed_forms(model, tension);
            model.free_period = false, model.force = {}, model.keeps_volume = false, model.pressure = twice(pressure);
            expect_closed_forms(model, tension);
        }
    }
}

}  // namespace tubule::wave_rates_test
