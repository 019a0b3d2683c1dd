// Cases with [equilibrium]: what they may say, and the rows and frames that come out.
#include "axisym/equilibrium/equilibrium_run.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::axisym::equilibrium_run_test {

const std::string good = R"(tier = "axisym"
[energy]
k20 = 0.125
H0 = -2.0
k42 = 0.12
[shape]
kind = "capsule"
radius = 0.5
length = 2.0
[accuracy]
energy = 1e-8
[equilibrium]
modes = 1
[equilibrium.branch]
vary = "energy.k42"
to = 0.0
step = 0.05
)";

std::string with(const std::string& old_text, const std::string& new_text) {
    std::string text = good;
    return text.replace(text.find(old_text), old_text.size(), new_text);
}

std::string refusal(const std::string& text) {
    return test::message_of<CaseError>([&] {
        RunObserver nobody;
        run_equilibrium(parse_case(text, {}, "case.toml"), nobody);
    });
}

struct Recorder : RunObserver {
    std::vector<std::vector<double>> rows;
    std::vector<Record> frames;
    bool stop = false;
    void row(std::span<const double> values) override { rows.emplace_back(values.begin(), values.end()); }
    void frame(const std::function<Record()>& make) override { frames.push_back(make()); }
    bool interrupted() override { return stop && !rows.empty(); }
};

struct Outcome {
    RunSummary summary;
    Recorder log;
    std::vector<std::string> names;
    double at(const std::string& name, int row) const {
        const auto it = std::find(names.begin(), names.end(), name);
        EXPECT_NE(it, names.end()) << name;
        return log.rows[row < 0 ? log.rows.size() + row : row][it - names.begin()];
    }
    const std::vector<double>& array(const std::string& name, int frame) const {
        for (const Array& a : log.frames.at(frame).arrays)
            if (a.name == name) return a.data;
        throw std::runtime_error(name);
    }
};
Outcome outcome(const std::string& text, const std::vector<std::string>& sets = {}, bool stop = false) {
    const Case c = parse_case(text, sets, "case.toml");
    Outcome out;
    out.log.stop = stop;
    out.names = equilibrium_series_names(c);
    out.summary = run_equilibrium(c, out.log);
    for (const auto& row : out.log.rows) EXPECT_EQ(row.size(), out.names.size());
    EXPECT_EQ(out.log.rows.size(), out.log.frames.size());
    return out;
}

TEST(EquilibriumCase, refusals) {
    const auto expect = [](const std::string& old_text, const std::string& new_text, const std::string& message) {
        EXPECT_EQ(refusal(with(old_text, new_text)), "case.toml:" + message) << new_text;
    };
    const std::string held = "equilibrium.held";
    expect("modes = 1", "held = \"area\"\nvolume = 2.0",
           "14:10: equilibrium.volume is not held fixed: see " + held + "");
    expect("modes = 1", "held = \"volume\"\narea = 2.0", "14:8: equilibrium.area is not held fixed: see " + held);
    expect("modes = 1", "held = \"nothing\"\nreduced_volume = 0.8",
           "14:18: equilibrium.reduced_volume is not held fixed: see " + held);
    expect("modes = 1", "volume = 2.0\nreduced_volume = 0.8",
           "14:18: equilibrium.reduced_volume cannot be combined with equilibrium.volume");
    expect("modes = 1", "modes = -1", "13:9: equilibrium.modes must be an integer >= 0 and <= 100, not -1");
    expect("vary = \"energy.k42\"\n", "", "14:1: equilibrium.branch needs vary: the key that changes along the branch");
    expect("step = 0.05\n", "",
           "14:1: equilibrium.branch needs to and step: the end of the branch and the distance between shapes");
    expect("step = 0.05\n", "step = 0.05\namplitude = 0.1\n",
           "18:13: equilibrium.branch.amplitude is where a bifurcating branch begins: see mode and branches");
    expect("energy.k42", "energy.M0",
           "14:1: equilibrium.branch varies what the energy does not have: see energy.alpha");
    expect(
        "energy.k42", "energy.k43",
        "15:8: equilibrium.branch.vary must be one of \"energy.k20\", \"energy.k40\", \"energy.k42\", "
        "\"energy.H0\", \"energy.kg\", \"energy.alpha\", \"energy.M0\", \"equilibrium.area\", \"equilibrium.volume\", "
        "\"equilibrium.reduced_volume\", "
        "\"model.tension\", \"model.pressure\", \"model.force\", \"model.extension\", \"shape.height\", not "
        "\"energy.k43\"; did you "
        "mean 'energy.k40'?");
    const std::string varies = "14:1: equilibrium.branch varies a quantity that is not held fixed: see " + held;
    expect("modes = 1\n[equilibrium.branch]\nvary = \"energy.k42\"",
           "held = \"area\"\n[equilibrium.branch]\nvary = \"equilibrium.volume\"", varies);
    expect("modes = 1\n[equilibrium.branch]\nvary = \"energy.k42\"",
           "held = \"area\"\n[equilibrium.branch]\nvary = \"equilibrium.reduced_volume\"", varies);
    expect("modes = 1\n[equilibrium.branch]\nvary = \"energy.k42\"",
           "held = \"volume\"\n[equilibrium.branch]\nvary = \"equilibrium.area\"", varies);
    expect("[accuracy]", "[time]\nend = 1.0\n[accuracy]",
           "11:7: time.end must be absent: only valid with a motion, without [equilibrium]");
    const auto clash = [&](const std::string& model, const std::string& is_held, const std::string& complaint) {
        const std::string text = with("modes = 1\n", "held = \"" + is_held + "\"\n");
        EXPECT_EQ(refusal(text.substr(0, text.find("[equilibrium.branch]")) + "[model]\n" + model + "\n"),
                  "case.toml:13:8: equilibrium.held must " + complaint);
    };
    clash("volume = \"fixed\"", "area", "hold the volume: see model.volume");
    clash("area = \"fixed\"", "volume", "hold the area: see model.area");
    clash("volume = \"free\"", "volume", "leave the volume free: see model.volume");
    clash("area = \"free\"", "area", "leave the area free: see model.area");
    clash("tension = 0.1", "area-and-volume", "leave the area free: see model.tension");
    clash("pressure = 0.1", "reduced-volume", "leave the volume free: see model.pressure");
    expect("modes = 1\n[equilibrium.branch]\nvary = \"energy.k42\"",
           "held = \"area\"\n[equilibrium.branch]\nvary = \"model.tension\"",
           "14:1: equilibrium.branch varies the tension or pressure of what is held: see " + held);
    expect("to = 0.0", "to = 0.12",
           "14:1: equilibrium.branch from 0.12 to 0.12 by 0.05 makes 0 steps; the number must be 1 to 10000");
    expect("step = 0.05", "step = 1e-9",
           "14:1: equilibrium.branch from 0.12 to 0 by 1e-09 makes 1.2e+08 steps; the number must be 1 to 10000");
    expect("modes = 1", "area = 1.0",
           " equilibrium.area: a reduced volume of 22.2733 is impossible: the largest is 1, that of a sphere");
}

TEST(EquilibriumCase, writtenOutItIsTheSame) {
    const std::string text = effective_toml(parse_case(good, {"equilibrium.reduced_volume=0.75"}, "case.toml"));
    EXPECT_CONTAINS(text, "reduced_volume = 0.75");
    EXPECT_CONTAINS(text, "[equilibrium.branch]");
    EXPECT_EQ(text.find("[time]"), std::string::npos) << text;
    EXPECT_EQ(effective_toml(parse_case(text, {}, "again.toml")), text);
}

TEST(EquilibriumCase, branchOfShapes) {
    // Expected: independent spectral reference (tests/axisym/equilibrium_test.cpp).
    const Outcome o = outcome(good);
    EXPECT_EQ(o.summary.stop.reason, Stop::finished);
    EXPECT_EQ(o.summary.stop.time, 3);
    ASSERT_EQ(o.log.rows.size(), 4u);  // 0.12, 0.07, 0.02, 0
    EXPECT_NEAR(o.at("parameter", 1), 0.07, 1e-12);
    EXPECT_NEAR(o.at("energy", 0), 6.3849499091967346, 1e-6);
    EXPECT_NEAR(o.at("energy", -1), 1.2568365089070843, 1e-6);
    EXPECT_NEAR(o.at("distance_to_start", -1), 0.055235900332553545, 1e-6);
    EXPECT_EQ(o.at("special", -1), 0);
    EXPECT_LT(o.at("growth_0", -1), 0);
    EXPECT_LT(o.at("growth_1", -1), 0);
    EXPECT_EQ(o.array("displacement_1", 0).size(), 201u);
    const auto &r = o.array("r", 3), &z = o.array("z", 3), &H = o.array("H", 3);
    EXPECT_EQ(r.front(), 0);
    EXPECT_EQ(r.back(), 0);
    EXPECT_NEAR(z.back() - z.front(), 2.93276235152434, 1e-6);
    EXPECT_NEAR(H.front(), -2 * 2.017056842618144, 1e-3);
}

TEST(EquilibriumCase, growthRatesByTheModel) {
    // Theorem: in the metric of more dissipation the same second variation decays more slowly; Re = 1 and gamma = 1
    // dissipate more than gamma = 1 alone, which is the overdamped model.
    const std::string single = good.substr(0, good.find("[equilibrium.branch]"));
    const double gradient = outcome(single).at("growth_1", 0),
                 overdamped = outcome(single, {"model.kind=overdamped"}).at("growth_1", 0),
                 stokes = outcome(single, {"model.kind=stokes", "model.Re=1.0", "model.gamma=1.0"}).at("growth_1", 0),
                 viscous = outcome(single, {"model.kind=stokes", "model.Re=0.1", "model.gamma=1.0"}).at("growth_1", 0);
    EXPECT_LT(gradient, overdamped);
    EXPECT_LT(overdamped, stokes);
    EXPECT_LT(stokes, viscous);
    EXPECT_LT(viscous, 0);
}

TEST(EquilibriumCase, whatIsHeld) {
    const std::string single = good.substr(0, good.find("[equilibrium.branch]"));
    const Outcome given = outcome(single, {"equilibrium.reduced_volume=0.8"});
    EXPECT_NEAR(given.at("reduced_volume", 0), 0.8, 1e-11);
    EXPECT_NEAR(given.at("area", 0), 9.42477796076938, 1e-10);  // the initial one: 2 pi r l + 4 pi r^2
    const Outcome size = outcome(single, {"equilibrium.held=reduced-volume"});
    EXPECT_NEAR(size.at("reduced_volume", 0), 0.7698003589195009, 1e-10);  // initial
    EXPECT_NEAR(2 * size.at("tension", 0) * size.at("area", 0) - 3 * size.at("pressure", 0) * size.at("volume", 0), 0,
                1e-7);
    EXPECT_EQ(outcome(single, {"equilibrium.held=nothing"}).at("pressure", 0), 0);
    EXPECT_NEAR(outcome(single, {"equilibrium.held=volume"}).at("tension", 0), 0, 0);
}

// From nearly a sphere, where area and volume are nearly one condition, to the prolate of tests/surface3d and its
// energy (tier axisym to 1e-10, from c = 1.4). A size that the energy does not determine stays.
TEST(EquilibriumCase, beginsBesideASphere) {
    const std::string text =
        "tier = \"axisym\"\n[energy]\nk20 = 0.5\n[shape]\nkind = \"ellipsoid\"\na = 1\nb = 1\nc = 1.05\n"
        "[accuracy]\nenergy = 1e-7\n[equilibrium]\nreduced_volume = 0.9\n";
    for (const char* held : {"area-and-volume", "reduced-volume"}) {
        const Outcome o = outcome(text, {fmt::format("equilibrium.held={}", held)});
        EXPECT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        EXPECT_NEAR(o.at("energy", 0), 29.899015632, 1e-6);
        EXPECT_NEAR(2 * o.at("tension", 0) * o.at("area", 0) - 3 * o.at("pressure", 0) * o.at("volume", 0), 0, 1e-5);
    }
}

// theory.md (3.21), (3.23): the equilibrium radius under a tension and a pressure, also where a motion would leave it.
TEST(EquilibriumCase, restsUnderTensionAndPressure) {
    const std::string sphere = R"(tier = "axisym"
energy = {k20 = 0.5, k40 = 0.03, k42 = 0.1, H0 = -0.7}
model = {tension = 0.4}
shape = {kind = "sphere", radius = 1.05}
accuracy = {energy = 1e-9}
equilibrium = {descend = false}
)";
    const double h = -2 + 0.7, f = 0.5 * h * h + 0.03 * std::pow(h, 4) + 0.1, f_H = h + 0.12 * std::pow(h, 3),
                 P = 2 * (f + 0.4) + 2 * f_H - 0.4;
    const Outcome o = outcome(sphere, {"model.pressure=" + fmt::format("{:.17g}", P)});
    EXPECT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    EXPECT_NEAR(o.at("r_max", 0), 1, 1e-7);
    EXPECT_NEAR(o.at("tension", 0), 0.4, 1e-14);
    EXPECT_NEAR(o.at("pressure", 0), P, 1e-14);
    EXPECT_NEAR(o.at("free_energy", 0), 4 * pi * (f + 0.4) - P * 4 * pi / 3, 1e-7);
    // A fixed volume measures it; what the model says is what is held.
    const Outcome kept = outcome(sphere, {"model.volume=fixed", "shape.radius=1"});
    EXPECT_NEAR(kept.at("pressure", 0), P, 1e-7);
}

// theory.md (3.24). A cell whose area is held under the pressure 40 (2/V - 1), as held at the volume that it finds.
TEST(EquilibriumCase, restsUnderAPressureOfTheVolume) {
    const std::string single = good.substr(0, good.find("modes = 1"));
    const Outcome o = outcome(single, {"equilibrium.held=area", "model.pressure=40*(2/V - 1)"});
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    const double V = o.at("volume", 0);
    EXPECT_NEAR(o.at("pressure", 0), 40 * (2 / V - 1), 1e-9);
    EXPECT_NEAR(o.at("free_energy", 0), o.at("energy", 0) - 80 * std::log(V) + 40 * (V - 1), 1e-9);
    const Outcome held = outcome(single, {"equilibrium.volume=" + fmt::format("{:.17g}", V)});
    EXPECT_NEAR(held.at("energy", 0), o.at("energy", 0), 1e-6);
    EXPECT_NEAR(held.at("pressure", 0), o.at("pressure", 0), 1e-5);
    EXPECT_NEAR(held.at("tension", 0), o.at("tension", 0), 1e-5);
}

TEST(EquilibriumCase, tubesMirrorThemselves) {
    // Exact: E = (k20/R^2 + k40/R^4) A for the tube of radius R = A/(2 pi length) that the wavy one relaxes to.
    const std::string tube = R"(tier = "axisym"
energy = {k20 = -1.0, k40 = 0.5}
shape = {kind = "tube", radius = 1.0, length = 4.0, mode = [{amplitude = 0.02, n = 1}]}
accuracy = {energy = 1e-9}
equilibrium = {held = "area"}
)";
    const Outcome o = outcome(tube);
    EXPECT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    const auto &z = o.array("z", 0), &r = o.array("r", 0);
    EXPECT_NEAR(z.back() - z.front(), 4, 1e-12);
    EXPECT_NEAR(*std::max_element(r.begin(), r.end()) - *std::min_element(r.begin(), r.end()), 0, 1e-5);
    const double A = o.at("area", 0), R = A / (8 * pi);
    EXPECT_GT(R, 1.0001);
    EXPECT_NEAR(o.at("energy", 0), (-1 / (R * R) + 0.5 / std::pow(R, 4)) * A, 1e-8);
    const std::string slanted = std::string(tube).replace(tube.find("n = 1"), 5, "n = 1, phase = 0.3");
    EXPECT_EQ(refusal(slanted), "case.toml: shape: the curve is not symmetric about the middle of its parameter range");
}

const std::string free_tube = R"(tier = "axisym"
[energy]
k20 = 0.5
k40 = 0.03
k42 = 0.1
H0 = -0.7
[model]
kind = "overdamped"
period = "free"
[shape]
kind = "tube"
radius = 1.05
length = 3.0
[accuracy]
energy = 1e-10
[equilibrium]
descend = false
)";

// theory.md (3.21): the straight tube of radius 1, length 3 in equilibrium under its force, area, volume or both kept.
TEST(EquilibriumCase, straightTubesRestUnderForce) {
    const double h = -0.3, f = 0.5 * h * h + 0.03 * std::pow(h, 4), f_H = h + 0.12 * std::pow(h, 3), tension = 0.2;
    const auto text = [](const char* key, double value) { return fmt::format("{}={:.17g}", key, value); };
    const std::string area = text("equilibrium.area", 6 * pi), volume = text("equilibrium.volume", 3 * pi);
    const auto expect = [&](double sigma, double pressure, double given_tension, std::vector<std::string> sets) {
        const double force = 2 * pi * (f + sigma) - pi * pressure;
        sets.push_back(text("model.force", force));
        const Outcome o = outcome(free_tube, sets);
        EXPECT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        EXPECT_NEAR(o.at("r_max", 0), 1, 1e-8);
        EXPECT_NEAR(o.at("height", 0), 3, 1e-8);
        EXPECT_NEAR(o.at("tension", 0), sigma, 1e-8);
        EXPECT_NEAR(o.at("pressure", 0), pressure, 1e-8);
        EXPECT_EQ(o.at("force", 0), force);
        EXPECT_NEAR(o.at("free_energy", 0), 6 * pi * (f + given_tension) - 3 * force, 1e-7);
        EXPECT_EQ(o.log.frames[0].numbers[1].first, "length");
        EXPECT_NEAR(o.log.frames[0].numbers[1].second, 3, 1e-8);
        EXPECT_NEAR(o.array("z", 0).back(), 3, 1e-8);
    };
    expect(
        tension, f + f_H + tension, tension,
        {"model.kind=gradient-flow", "model.volume=fixed", "model.area=free", text("model.tension", tension), volume});
    expect(-f - f_H, 0, 0, {"model.volume=free", area});
    expect(0.37, f + f_H + 0.37, 0, {area, volume});
    // A period that is kept has the same force.
    const Outcome kept = outcome(free_tube, {"model.period=fixed", "shape.radius=1", "model.volume=free"});
    EXPECT_NEAR(kept.at("force", 0), -2 * pi * f_H, 1e-8);
    EXPECT_NEAR(kept.at("height", 0), 3, 1e-14);
}

// Delaunay's unduloid of radii 1 +- B has H = -1 everywhere, so that no energy k20 (H + 1)^2 and no force. Kenmotsu's
// parametrisation by arc length s in [0, 2 pi]: r = sqrt(1 + B^2 + 2 B sin s), z' = (1 + B sin s)/r; its integrals by
// the trapezoidal rule.
TEST(EquilibriumCase, anUnduloidFindsItsPeriod) {
    const double B = 0.4;
    double area = 0, volume = 0, length = 0;
    constexpr int points = 400;
    for (int i = 0; i < points; ++i) {
        const double sine = std::sin(2 * pi * i / points), r = std::sqrt(1 + B * B + 2 * B * sine),
                     ds = 2 * pi / points;
        area += ds * 2 * pi * r, length += ds * (1 + B * sine) / r, volume += ds * pi * r * (1 + B * sine);
    }
    const std::vector<std::string> unduloid = {"energy.k20=1",
                                               "energy.k40=0",
                                               "energy.k42=0",
                                               "energy.H0=-1",
                                               "equilibrium.descend=true",
                                               "shape.radius=1",
                                               "shape.length=6",
                                               "shape.mode.0.amplitude=-0.35",
                                               "shape.mode.0.n=1",
                                               fmt::format("equilibrium.area={:.17g}", area)};
    for (const bool keeps_volume : {false, true}) {
        std::vector<std::string> sets = unduloid;
        sets.push_back(keeps_volume ? fmt::format("equilibrium.volume={:.17g}", volume) : "model.volume=free");
        const Outcome o = outcome(free_tube, sets);
        EXPECT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        EXPECT_NEAR(o.at("energy", 0), 0, 1e-9);
        EXPECT_NEAR(o.at("height", 0), length, 1e-5);
        EXPECT_NEAR(o.at("volume", 0), volume, 1e-5);
        EXPECT_NEAR(o.at("r_max", 0), 1 + B, 1e-5);
        EXPECT_NEAR(o.at("tension", 0), 0, 1e-5);
        EXPECT_NEAR(o.at("pressure", 0), 0, 1e-5);
        EXPECT_EQ(o.at("negative_directions", 0), 0);
    }
    std::vector<std::string> sets = unduloid;
    sets.push_back("equilibrium.modes=1");
    const Outcome o = outcome(free_tube, sets);
    EXPECT_EQ(std::count(o.names.begin(), o.names.end(), "growth_0"), 0);
    EXPECT_LT(o.at("growth_1", 0), 0);
}

// A tube of constant volume that is pulled: R = 3 pi k20/force by theory.md (3.21).
TEST(EquilibriumCase, branchOverTheForce) {
    const std::string branch = "[equilibrium.branch]\nvary = \"model.force\"\nto = 6.0\nstep = 0.5\n";
    const Outcome o = outcome(free_tube + branch, {"energy.k40=0", "energy.H0=0", "model.kind=gradient-flow",
                                                   "model.volume=fixed", "model.area=free", "model.force=4.5"});
    EXPECT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    ASSERT_EQ(o.log.rows.size(), 4u);
    for (int i = 0; i < 4; ++i) {
        const double force = 4.5 + 0.5 * i, R = 1.5 * pi / force;
        EXPECT_NEAR(o.at("force", i), force, 1e-12);
        EXPECT_NEAR(o.at("r_max", i), R, 1e-8);
        EXPECT_NEAR(o.at("height", i), 3 * 1.05 * 1.05 / (R * R), 1e-6);
    }
}

TEST(EquilibriumCase, refusalsOfFreePeriods) {
    const auto expect = [](const std::string& old_text, const std::string& new_text, const std::string& message) {
        EXPECT_EQ(refusal(std::string(free_tube).replace(free_tube.find(old_text), old_text.size(), new_text)),
                  "case.toml:" + message);
    };
    expect("descend = false", "held = \"nothing\"",
           "17:8: equilibrium.held must hold the area or the volume where model.period is \"free\"");
    expect("descend = false", "modes = 0", "17:9: equilibrium.modes must be an integer >= 1 and <= 100, not 0");
    expect("kind = \"tube\"\nradius = 1.05\nlength = 3.0", "kind = \"sphere\"\nradius = 1.05",
           "9:10: model.period must not be \"free\": only valid with a tube");
    EXPECT_EQ(refusal(with("modes = 1\n[equilibrium.branch]\nvary = \"energy.k42\"",
                           "modes = 1\n[equilibrium.branch]\nvary = \"model.force\"")),
              "case.toml:14:1: equilibrium.branch varies a force at a fixed period: see model.period");
    // A branch over a load begins at its value.
    expect("[shape]", "force = 1.0\n[equilibrium.branch]\nvary = \"model.force\"\nto = 1.0\nstep = 0.5\n[shape]",
           "11:1: equilibrium.branch from 1 to 1 by 0.5 makes 0 steps; the number must be 1 to 10000");
}

TEST(EquilibriumCase, canBeInterrupted) {
    const Outcome o = outcome(good, {}, true);
    EXPECT_EQ(o.summary.stop.reason, Stop::interrupted);
    EXPECT_EQ(o.log.rows.size(), 1u);
}

}  // namespace tubule::axisym::equilibrium_run_test
