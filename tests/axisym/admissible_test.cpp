// What a run states of its beginning: the energy of the given shape, and no state that its flow forbids.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "axisym/curve/shape_integrals.hpp"
#include "common/shapes/capsule.hpp"
#include "common/shapes/ellipsoid.hpp"
#include "common/shapes/sphere.hpp"
#include "common/shapes/torus.hpp"
#include "tests/axisym/runs.hpp"

namespace tubule::axisym::admissible_test {

TEST(ShapeIntegrals, areThoseOfClosedForms) {
    // Capsule: H = -1/r on the cylinder of length l, -2/r on the spheres. Torus: INT H^2 and INT K^2 by theory.md
    // (7.1).
    const double r = 1.006, l = 3.181;
    const ShapeEnergy capsule = bending_energy(meridian(Capsule{r, l}), bending(0, 0, 0.1853));
    const double exact = 0.1853 * (2 * pi * r * l * std::pow(1 / r, 4) + 4 * pi * r * r * std::pow(2 / r, 4));
    EXPECT_NEAR(capsule.energy, exact, 1e-11 * exact);
    EXPECT_NEAR(capsule.magnitude, exact, 1e-11 * exact);

    const double a = 1, c = 1.5, q = std::sqrt(c * c - a * a);
    Torus torus;
    torus.radius = c, torus.tube_radius = a;
    const ShapeEnergy ring = bending_energy(meridian(torus), bending(1, 0, 0, 1));
    ASSERT_EQ(ring.energy_term.size(), 3u);
    EXPECT_NEAR(ring.energy_term[0], 4 * pi * pi * c * c / (a * q), 1e-10 * ring.energy);
    EXPECT_NEAR(ring.energy_term[2], 4 * pi * pi * c / (a * a * a) * (c / q - 1), 1e-10 * ring.energy);

    // INT K^2 of an ellipsoid with axes 1, 1, 3: a polynomial in the axes.
    const double squares = 3 * (1 + 1 + 81) + 2 * (1 + 9 + 9);
    EXPECT_NEAR(bending_energy(meridian(Ellipsoid{1, 1, 3}), bending(0, 0, 0, 1)).energy, 4 * pi * squares / (15 * 9),
                1e-9);
}

// A sphere with a dent so deep that twelve elements give it a tenth too little energy.
Case dented(double a5, double a4, double end) {
    Case c;
    c.energy = bending(0.6099);
    c.shape = Sphere{.radius = 1, .modes = {{.amplitude = a5, .l = 5}, {.amplitude = a4, .l = 4}}};
    c.accuracy.energy = 0.00389;
    c.time.end = end;
    return c;
}

void expect_rows_that_the_flow_allows(const Case& c, const Outcome& o) {
    const double allowed = std::max(c.accuracy.energy, o.summary.estimated_error) * o.summary.reference_energy;
    double least = HUGE_VAL;
    for (std::size_t i = 0; i < o["time"].size(); ++i) {
        for (const auto& [name, values] : o.series) EXPECT_TRUE(std::isfinite(values[i])) << name << " in row " << i;
        EXPECT_GE(o["r_min"][i], 0) << "row " << i;  // 0 where there is no neck
        EXPECT_LE(o["energy"][i], least + allowed) << "row " << i;
        least = std::min(least, o["energy"][i]);
    }
}

TEST(Admissible, aDeepDentIsNoPinchOff) {
    const Case c = dented(0.4055, -0.0933, 0.0086975);
    const Outcome o = run_case(c);
    EXPECT_EQ(word(o.summary.stop.reason), std::string("finished"));
    // 93.7512689 by the trapezoidal rule on 200000 points, second derivatives by differences
    EXPECT_NEAR(o["energy"][0], 93.75127, 1e-4);
    expect_rows_that_the_flow_allows(c, o);
}

TEST(Admissible, randomDentsGiveNoRowThatTheFlowForbids) {
    std::mt19937 generator(36);
    std::uniform_real_distribution<double> amplitude(-0.42, 0.42);
    for (int i = 0; i < 3; ++i) {
        const double a5 = amplitude(generator), a4 = amplitude(generator) / 2;
        SCOPED_TRACE(testing::Message() << "amplitudes " << a5 << ", " << a4);
        const Case c = dented(a5, a4, 1e-3);
        const Outcome o = run_case(c);
        const double exact = bending_energy(meridian(std::get<Sphere>(c.shape)), c.energy).energy;
        EXPECT_NEAR(o["energy"][0], exact, 1e-9 * exact);
        expect_rows_that_the_flow_allows(c, o);
    }
}

TEST(Admissible, theFirstRowIsTheGivenShape) {
    Case c;
    c.energy = bending(0, 0, 0.1853);
    c.model.kind = ModelKind::overdamped;
    c.shape = Capsule{1.006, 3.181};
    c.accuracy.energy = 3.93e-8;
    c.time.end = 0.0041532;
    const Outcome o = run_case(c, nullptr, [](double) { return true; });  // the initial shape has been written by then
    EXPECT_NEAR(o["energy"][0], bending_energy(meridian(Capsule{1.006, 3.181}), c.energy).energy, 1e-10);
}

// The tension falls before the first step ends: what it does is work, not a rise of the energy.
TEST(Admissible, loadsWorkBeforeTheFirstStep) {
    Case c;
    c.energy = bending(0.1646, -5.7976, 0.00080488);
    c.model.kind = ModelKind::stokes;
    c.model.Re = 2.0428, c.model.gamma = 0.5;
    c.model.area = AreaRule::reservoir;
    c.model.tension = Ramp({0, 1e-12, 1e-11}, {0.24, -0.1, 0.44});
    c.shape = Dumbbell{};
    c.accuracy.energy = 3.5e-4;
    c.time.end = 4e-5;
    c.time.output = {4e-9};
    const Outcome o = run_case(c);
    EXPECT_EQ(word(o.summary.stop.reason), std::string("finished")) << o.summary.stop.message;
    EXPECT_NEAR(o["identity_defect"].back(), 0, 3.5e-4 * o.summary.reference_energy);
}

TEST(Admissible, aMeshThatCannotFollowIsAFailureAtTheBeginning) {
    Case c = dented(0.4055, -0.0933, 1e-6);
    explicitly(c, 68, 1e-3);
    const Outcome o = run_case(c);
    EXPECT_EQ(word(o.summary.stop.reason), std::string("solver-failed"));
    EXPECT_EQ(o.summary.stop.time, 0);
    EXPECT_EQ(o.summary.estimated_error, 1);
    expect_rows_that_the_flow_allows(c, o);
}

}  // namespace tubule::axisym::admissible_test
