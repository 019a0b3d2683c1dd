// Each way in which a run can end early: detected, distinguished, its state saved, reported with time and place.
#include <gtest/gtest.h>

#include <cmath>

#include "axisym/curve/curve_guards.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/run/stall.hpp"
#include "tests/axisym/runs.hpp"

namespace tubule::axisym::guards_test {

// The last state can be looked at or resumed from, and the rows end with it.
void expect_saved(const Outcome& o) {
    const bool resumable = o.summary.stop.reason == Stop::time_limit || o.summary.stop.reason == Stop::interrupted;
    const auto& records = resumable ? o.log.checkpoints : o.log.frames;
    ASSERT_FALSE(records.empty());
    EXPECT_EQ(records.back().time, o.summary.stop.time);
    EXPECT_EQ(o.last("time"), o.summary.stop.time);
    EXPECT_EQ(o.last("energy"), o.summary.energy);
    EXPECT_FALSE(o.summary.stop.message.empty());
    for (const auto& row : o.log.rows)
        for (double value : row) ASSERT_TRUE(std::isfinite(value));
}

#define EXPECT_STOP(outcome, stop_reason) \
    EXPECT_EQ(word((outcome).summary.stop.reason), std::string(name(stop_reason))) << (outcome).summary.stop.message

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST(Guards, finished) {
    const Outcome o = run_case(tube_case(bending(0.2, -2), 1, 2, {{0.25, 1}}, 0.3));
    EXPECT_STOP(o, Stop::finished);
    EXPECT_EQ(o.summary.stop.time, 0.3);
    expect_saved(o);
}

TEST(Guards, pinchOffWhereTheNeckIs) {
    // The neck of 1 + 0.6 cos(2 pi z/L + phase) stays at phase = pi by symmetry; with two waves there are two of them.
    for (double phase : {0.0, 1.0, 4.0}) {
        const double place = std::fmod((pi - phase + 2 * pi) / (2 * pi) * 2, 2.0);
        const Outcome o = run_case(tube_case(bending(0.2, -2), 1, 2, {{0.6, 1, 0, phase}}, 1));
        EXPECT_STOP(o, Stop::pinch_off);
        EXPECT_SAYS(o.summary.stop.message, "the neck radius fell to 0.001 at z = ");
        const double said = std::stod(o.summary.stop.message.substr(o.summary.stop.message.rfind(' ')));
        EXPECT_NEAR(said, place, 1e-4);
        EXPECT_SAYS(o.summary.stop.advice, "accuracy.r_min");
        EXPECT_NEAR(o.last("r_min"), 1e-3, 1e-6);
        expect_saved(o);
    }
}

TEST(Guards, startBelowTheFloor) {
    Case c = tube_case(bending(0.2, -2), 1, 2, {{0.6, 1}}, 1);
    c.accuracy.r_min = 0.41;
    const Outcome o = run_case(c);
    EXPECT_STOP(o, Stop::pinch_off);
    EXPECT_EQ(o.summary.stop.time, 0);
    expect_saved(o);
}

TEST(Guards, illPosedFromTheStart) {
    // theory.md (2.14), (2.15): f_HH = 2 k20 + 12 k40 (H-H0)^2 < 0 on the tube r = 1.
    const Outcome o = run_case(tube_case(bending(0.2, -2, -0.1), 1, 2, {{0.1, 1}}, 1));
    EXPECT_STOP(o, Stop::ill_posed);
    EXPECT_EQ(o.summary.stop.time, 0);
    EXPECT_SAYS(o.summary.stop.message, "well-posedness at z = ");
    EXPECT_SAYS(o.summary.stop.advice, "refinement does not help");
    expect_saved(o);
}

TEST(Guards, illPosedOnTheWay) {
    // theory.md (2.14): 2 k20 + 2 k42/r^2 vanishes at r = sqrt(-k42/k20) on a tube, here sqrt(0.4). The shrinking tube
    // gets there at the time of v - ln|v| = 2 k20 H0^4 t + const, v = 1 - H0^2 R^2: theory.md (7.11).
    const auto F = [](double R) { return 1 - 4 * R * R - std::log(4 * R * R - 1); };
    const double R = std::sqrt(0.4), time = (F(R) - F(1)) / (2 * 0.2 * 16);
    const Outcome tube = run_case(tube_case(bending(0.2, -2, 0, -0.08), 1, 2, {}, 5));
    EXPECT_STOP(tube, Stop::ill_posed);
    EXPECT_NEAR(tube.summary.stop.time, time, 2e-3 * time);
    EXPECT_NEAR(tube.last("r_min"), R, 2e-3);
    expect_saved(tube);
    // With a wave, the neck gets there first.
    const Outcome wave = run_case(tube_case(bending(0.2, -2, 0, -0.08), 1, 2, {{0.05, 1}}, 5));
    EXPECT_STOP(wave, Stop::ill_posed);
    EXPECT_LT(wave.summary.stop.time, time);
    EXPECT_NEAR(wave.last("r_min"), R, 5e-3);
    expect_saved(wave);
}

TEST(Guards, illPosedFromTheStartOnADeepNeck) {
    // The symbol is negative at the neck and positive elsewhere: refused before any mesh is adapted to it.
    const Outcome o = run_case(tube_case(bending(0.2, -1, 0, -0.02), 1, 2, {{0.85, 1}}, 1));
    EXPECT_STOP(o, Stop::ill_posed);
    EXPECT_EQ(o.summary.stop.time, 0);
    expect_saved(o);
}

TEST(Guards, degenerateIsNotIllPosed) {
    // k40 alone, towards H = H0: f_HH = 12 k40 (H-H0)^2 > 0 falls as near to 0 as it likes.
    const Outcome o = run_case(tube_case(bending(0, -2, 0.02), 1, 2, {}, 2000));
    EXPECT_STOP(o, Stop::finished);
    EXPECT_LT(12 * 0.02 * std::pow(-1 / o.last("r_min") + 2, 2), 1e-3 * 12 * 0.02);
}

TEST(Guards, overhang) {
    // An independent computation with the profile as a curve that may overhang (spectral, 97 points): vertical at
    // t = 0.0086943, z = 0.3094 and 0.6906. The guard trips a little before, where |r'| is about 50.
    Case c = tube_case(bending(0.2), 1, 1, {{0.45, 1}}, 1);
    c.discretisation.parametrisation = Parametrisation::graph;
    const Outcome o = run_case(c);
    EXPECT_STOP(o, Stop::overhang);
    EXPECT_NEAR(o.summary.stop.time, 0.0086943, 0.25 * 0.0086943);
    EXPECT_LT(o.summary.stop.time, 0.0086943);
    EXPECT_SAYS(o.summary.stop.message, "turned vertical at z = 0.");
    const double said = std::stod(o.summary.stop.message.substr(o.summary.stop.message.find("z = ") + 4));
    EXPECT_NEAR(std::min(said, 1 - said), 0.3094, 0.03);
    EXPECT_SAYS(o.summary.stop.advice, "a graph r(z) cannot follow");
    EXPECT_GT(o.last("r_min"), 0.4);  // no neck
    expect_saved(o);
}

TEST(Guards, warnsOfAThreeDimensionalLoss) {
    // theory.md (2.14): in the direction x between kappa_theta and kappa_s; k40 = 0, k42 < 0: at larger |kappa_s|.
    const Outcome o = run_case(tube_case(bending(0.2, -1, 0, -0.05), 1, 2, {{0.25, 1}}, 0.001));
    EXPECT_STOP(o, Stop::finished);
    ASSERT_EQ(o.summary.warnings.size(), 1u);
    EXPECT_SAYS(o.summary.warnings[0], "directions that axisymmetric motion does not excite");
}

TEST(Guards, resolutionLostByExplicitSettings) {
    // The neck of the pinch-off case does not fit on 16 elements.
    Case c = tube_case(bending(0.2, -2), 1, 2, {{0.6, 1}}, 1);
    explicitly(c, 16, 1e-5);
    const Outcome o = run_case(c);
    EXPECT_STOP(o, Stop::resolution_lost);
    EXPECT_FALSE(o.summary.as_accurate_as_asked);
    EXPECT_SAYS(o.summary.stop.advice, "discretisation.elements");
    expect_saved(o);
}

TEST(Guards, missedAccuracyIsSaid) {
    // Explicit settings too coarse for what is asked, yet not hopeless: finished, with a warning.
    Case c = tube_case(bending(0.2, -2), 1, 2, {{0.25, 1}}, 0.3);
    c.accuracy.energy = 1e-8;
    explicitly(c, 12, 1e-4);
    const Outcome o = run_case(c);
    EXPECT_STOP(o, Stop::finished);
    EXPECT_FALSE(o.summary.as_accurate_as_asked);
    EXPECT_GT(o.summary.estimated_error, 1e-8);
    ASSERT_FALSE(o.summary.warnings.empty());
    EXPECT_SAYS(o.summary.warnings.back(), "was asked for");
}

TEST(Guards, solverFailed) {
    // No step of IDA has an error of 1e-17 in double precision.
    Case c = tube_case(bending(0.2, -2), 1, 2, {{0.25, 1}}, 1);
    explicitly(c, 24, 1e-17);
    const Outcome o = run_case(c);
    EXPECT_STOP(o, Stop::solver_failed);
    EXPECT_SAYS(o.summary.stop.message, "too much accuracy");
    expect_saved(o);
}

TEST(Guards, timeLimit) {
    Case c = tube_case(bending(0.2, -2), 1, 2, {{0.25, 1}}, 1);
    c.time.limit = 0;
    const Outcome o = run_case(c);
    EXPECT_STOP(o, Stop::time_limit);
    EXPECT_GT(o.summary.stop.time, 0);
    EXPECT_LT(o.summary.stop.time, 1);
    EXPECT_SAYS(o.summary.stop.advice, "--resume");
    expect_saved(o);
}

TEST(Guards, interrupted) {
    const Outcome o =
        run_case(tube_case(bending(0.2, -2), 1, 2, {{0.25, 1}}, 1), nullptr, [](double t) { return t > 0.1; });
    EXPECT_STOP(o, Stop::interrupted);
    EXPECT_GT(o.summary.stop.time, 0.1);
    EXPECT_LT(o.summary.stop.time, 0.3);
    EXPECT_SAYS(o.summary.stop.advice, "--resume");
    expect_saved(o);
}

TEST(Guards, aSoftWaveIsNotStationary) {
    // On the tube r = 1/|H0| a wave a cos(q z) changes H by a (1 - q^2), little for q near 1: theory.md (2.10). It
    // decays at the rate 2 k20 (1 - q^2)^2 = 1/57, from 3.4 percent of the radius, while its energy is 2e-6 of E_ref.
    Case c = tube_case(bending(1, -1), 1, 6.6, {{0.034, 1}}, 100);
    c.time.stationary = 1e-5;
    const Outcome o = run_case(c);
    EXPECT_GT(o.summary.stop.time, 50) << o.summary.stop.message;
}

TEST(Guards, stationary) {
    // The tube r = 1/|H0| is where the energy vanishes.
    Case c = tube_case(bending(0.2, -2), 1, 2, {{0.25, 1}}, 1000);
    c.time.stationary = 1e-6;
    const Outcome o = run_case(c);
    EXPECT_STOP(o, Stop::stationary);
    EXPECT_LT(o.summary.stop.time, 1000);
    EXPECT_LT(o.summary.energy, 1e-6 * o.summary.reference_energy);
    EXPECT_NEAR(o.last("r_min"), 0.5, 1e-3);
    expect_saved(o);
}

TEST(Outputs, areWhereTheyWereAskedFor) {
    // Unsorted, doubled, zero and the end itself: each time once, in order.
    const Outcome o = run_case(tube_case(bending(0.2, -2), 1, 2, {{0.25, 1}}, 0.3, {0.2, 0.05, 0.2, 0, 0.3}));
    ASSERT_EQ(o.log.frames.size(), 4u);
    const double expected[] = {0, 0.05, 0.2, 0.3};
    for (int i = 0; i < 4; ++i) EXPECT_EQ(o.log.frames[i].time, expected[i]);
    const auto& t = o["time"];
    for (std::size_t i = 1; i < t.size(); ++i) EXPECT_GT(t[i], t[i - 1]);
    EXPECT_EQ(t.front(), 0);
    EXPECT_EQ(t.back(), 0.3);
}

TEST(Outputs, rowsFitTheirNames) {
    const Case c = tube_case(bending(0.2, -2, 0.01, 0.02), 1, 2, {{0.2, 2}, {0.1, 4}, {0.05, 2, 0, 1}}, 0.01);
    const auto names = series_names(c);
    const std::vector<std::string> expected{
        "time",      "step_size",   "order",       "newton_iterations", "energy",   "energy_20", "energy_40",
        "energy_42", "free_energy", "dissipation", "identity_defect",   "area",     "volume",    "r_min",
        "r_max",     "mode_2",      "mode_4",      "tension",           "pressure", "force",     "energy_error",
        "elements",  "wall_seconds"};
    EXPECT_EQ(names, expected);
    const Outcome o = run_case(c);
    for (const auto& row : o.log.rows) EXPECT_EQ(row.size(), names.size());
    for (std::size_t i = 0; i < o["energy"].size(); ++i)
        EXPECT_NEAR(o["energy"][i], o["energy_20"][i] + o["energy_40"][i] + o["energy_42"][i], 1e-12 * o["energy"][i]);
    // Two modes of two waves add up: |0.2 + 0.05 e^i|.
    EXPECT_NEAR(o["mode_2"].front(), std::hypot(0.2 + 0.05 * std::cos(1), 0.05 * std::sin(1)), 1e-5);
    EXPECT_NEAR(o["mode_4"].front(), 0.1, 1e-5);
}

// docs/decisions/curves.md: the speed of the parameter may vary by a factor of 1000 along the profile.
TEST(CurveGuards, aParameterStretchedTooFar) {
    Snapshot s{};
    s.neck.radius = HUGE_VAL, s.o.symbol = 1, s.o.g_max = 2;
    const auto tripped = [&](double least) {
        s.o.g_min = least;
        std::vector<StopReport> out;
        for (const CurveGuard& guard : curve_guards())
            if (!(guard.value(s, 1e-3) > 0)) out.push_back(guard.report(s, 0.5));
        return out;
    };
    EXPECT_TRUE(tripped(2.1e-3).empty());
    const auto stop = tripped(1.9e-3);
    ASSERT_EQ(stop.size(), 1);
    EXPECT_EQ(word(stop[0].reason), "mesh-lost");
    EXPECT_EQ(stop[0].time, 0.5);
    EXPECT_SAYS(stop[0].message, "varies by a factor 1.05e+03 along the profile");
    EXPECT_SAYS(stop[0].advice, "discretisation.parametrisation = \"even\"");
}

TEST(CurveGuards, stepsThatLeadNowhere) {
    // 2000 steps in which the time does not grow by a thousandth, nor the energy falls, and which are shorter than
    // 1e-9 of the end.
    const auto steps_until_stop = [](double step, double end) {
        Stall stall(2000, 1e-9 * end, 1e-4, "set discretisation.elements");
        double time = 1;
        for (int steps = 1; steps <= 5000; ++steps, time += step)
            if (const auto stop = stall.look(time, step, 0)) {
                EXPECT_EQ(word(stop->reason), "solver-failed");
                EXPECT_SAYS(stop->message, "no progress with steps of 1e-10");
                EXPECT_SAYS(stop->advice, "discretisation.elements");
                return steps;
            }
        return 0;
    };
    EXPECT_EQ(steps_until_stop(1e-10, 1), 2002);  // the first look is where it begins
    EXPECT_EQ(steps_until_stop(1e-10, 0.01), 0);  // such steps are not short for this end
    EXPECT_EQ(steps_until_stop(1e-5, 1e5), 0);    // a thousandth of the time in 100 steps
}

}  // namespace tubule::axisym::guards_test
