#include "common/model/model.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "common/case/read.hpp"

namespace tubule::model_test {

// What docs/case_files.md says about each model. Without `default`: a model that is missing here does not compile.
#pragma GCC diagnostic error "-Wswitch"
MotionLaw documented(ModelKind kind) {
    switch (kind) {
        case ModelKind::gradient_flow:
            return {.friction = 1, .inextensible = false, .keeps_volume = false};
        case ModelKind::overdamped:
            return {.friction = 0.3};
        case ModelKind::stokes:
            return {.viscosity = 0.25, .friction = 0.3};
        case ModelKind::fluid:
        case ModelKind::automatic:
            return {.inertia = 1, .viscosity = 0.25, .friction = 0.3};
    }
    return {};
}

TEST(Model, hasTheDocumentedLaw) {
    for (const ModelEntry& m : models) {
        Model model{.kind = m.kind, .Re = 4, .gamma = 0.3, .keeps_volume = {}};
        const MotionLaw found = motion_law(model), expected = documented(m.kind);
        EXPECT_EQ(found.inertia, expected.inertia) << m.name;
        EXPECT_EQ(found.viscosity, expected.viscosity) << m.name;
        EXPECT_EQ(found.friction, expected.friction) << m.name;
        EXPECT_EQ(found.inextensible, expected.inextensible) << m.name;
        EXPECT_EQ(found.keeps_volume, expected.keeps_volume) << m.name;
        model.gamma.reset();
        EXPECT_EQ(motion_law(model).friction, m.viscous ? 0 : 1) << m.name;
        model.keeps_volume = !expected.keeps_volume;  // a case may say otherwise
        EXPECT_EQ(motion_law(model).keeps_volume, !expected.keeps_volume) << m.name;
    }
}

TEST(Model, turnsWhatIsHeldIntoTheLaw) {
    const MotionLaw held = motion_law({.keeps_volume = {}, .area = AreaRule::fixed});
    EXPECT_TRUE(held.keeps_area && !held.unconstrained() && !held.area_is_free());
    const Model fed{.kind = ModelKind::fluid, .keeps_volume = false, .area = AreaRule::reservoir, .tension = 0.3};
    const MotionLaw law = motion_law(fed);
    EXPECT_TRUE(law.reservoir && law.inextensible && law.area_is_free() && !law.keeps_volume && !law.keeps_area);
    EXPECT_EQ(law.tension.at(5), 0.3);
    EXPECT_FALSE(law.without_loads());
    const MotionLaw pulled = motion_law({.keeps_volume = true, .free_period = true, .force = 2});
    EXPECT_TRUE(pulled.free_period && pulled.force.at(0) == 2 && !pulled.without_loads());
}

std::shared_ptr<const Formula> of_volume(const std::string& text) {
    const std::string_view variables[]{"V"};
    return std::make_shared<const Formula>(parse_formula(text, variables));
}

// theory.md (3.24). Exact integrals from V = 1; a step of P that few points would miss; a pole in between.
TEST(Loads, havePressuresThatAreFormulasOfTheVolume) {
    Loads osmosis{.tension = 0.3};
    osmosis.of_volume = of_volume("4*(0.5/V - 1)");
    EXPECT_DOUBLE_EQ(osmosis.pressure_at(2), -3);
    EXPECT_DOUBLE_EQ(osmosis.pressure_slope(2), -0.5);
    for (const double V : {1e-3, 0.2, 1.0, 5.0, 4000.0})
        EXPECT_NEAR(osmosis.energy(7, V, 0), 0.3 * 7 - 2 * std::log(V) + 4 * (V - 1), 1e-12 * (1 + V)) << V;
    EXPECT_DOUBLE_EQ(osmosis.scale(7, 2, 0), 0.3 * 7 + 6);
    Loads step, pole, number{.pressure = 0.4};
    step.of_volume = of_volume("tanh((V - 3)/0.01)");
    EXPECT_NEAR(step.energy(0, 5, 0), 0, 1e-12);
    pole.of_volume = of_volume("1/(V - 3)");
    EXPECT_TRUE(std::isfinite(pole.energy(0, 2.9, 0)));
    EXPECT_TRUE(std::isnan(pole.energy(0, 5, 0)));
    EXPECT_TRUE(std::isnan(osmosis.energy(1, -1, 0)));
    EXPECT_EQ(number.pressure_at(5), 0.4);
    EXPECT_EQ(number.pressure_slope(5), 0);
    EXPECT_EQ(number.energy(0, 5, 0), -2);
}

TEST(Loads, knowHowFarTheFormulaIsFromItsLimits) {
    MotionLaw law;
    EXPECT_FALSE(pressure_domain(law, 2).is_small());
    law.pressure_of_volume = of_volume("1/(V - 3)");
    EXPECT_FALSE(pressure_domain(law, 3.1).is_small());
    EXPECT_TRUE(pressure_domain(law, 3.0001).is_small());
    EXPECT_EQ(pressure_domain(law, 3.0001).place, 3.0001);
    EXPECT_FALSE(law.without_loads());
    EXPECT_FALSE(law.loads_change());
}

TEST(Ramp, isLinearBetweenItsTimesAndConstantOutside) {
    const Ramp ramp({1, 2, 4}, {0, 3, -1});
    const double times[] = {0, 1, 1.5, 2, 3, 4, 9}, values[] = {0, 0, 1.5, 3, 1, -1, -1},
                 slopes[] = {0, 3, 3, -2, -2, 0, 0};  // after a kink
    for (int i = 0; i < 7; ++i) {
        EXPECT_EQ(ramp.at(times[i]), values[i]) << times[i];
        EXPECT_EQ(ramp.slope(times[i]), slopes[i]) << times[i];
    }
    EXPECT_EQ(ramp.next_kink(0), 1);
    EXPECT_EQ(ramp.next_kink(1), 2);
    EXPECT_EQ(ramp.next_kink(2.5), 4);
    EXPECT_EQ(ramp.next_kink(4), HUGE_VAL);
    EXPECT_EQ(ramp.largest(), 3);
    EXPECT_FALSE(ramp.is_constant() || ramp.is_zero());
}

TEST(Ramp, mayBeANumber) {
    const Ramp constant = -2;
    EXPECT_EQ(constant.at(-1), -2);
    EXPECT_EQ(constant.at(7), -2);
    EXPECT_EQ(constant.slope(0), 0);
    EXPECT_EQ(constant.next_kink(0), HUGE_VAL);
    EXPECT_EQ(constant.largest(), 2);
    EXPECT_TRUE(constant.is_constant() && !constant.is_zero() && Ramp().is_zero());
    EXPECT_EQ(Ramp({3}, {0.5}).at(0), 0.5);
    EXPECT_EQ(Ramp({0, 1}, {2, 2}).next_kink(0), HUGE_VAL);
}

TEST(Ramp, refusesTimesThatDoNotAscend) {
    EXPECT_THROW(Ramp({0, 1}, {1}), std::invalid_argument);
    EXPECT_THROW(Ramp({}, {}), std::invalid_argument);
    EXPECT_THROW(Ramp({1, 1}, {0, 1}), std::invalid_argument);
    EXPECT_THROW(Ramp({2, 1}, {0, 1}), std::invalid_argument);
}

TEST(Model, isNamedInCaseFilesAndTakesItsKeys) {
    for (const ModelEntry& m : models) {
        const std::string text =
            "tier = \"axisym\"\nenergy.k20 = 1\nshape.kind = \"sphere\"\nshape.radius = 1\n"
            "time.end = 1\nmodel.kind = \"" +
            std::string(m.name) + "\"\n";
        EXPECT_EQ(parse_case(text, {}, "case.toml").model.kind, m.kind);
        const std::string viscous = text + "model.Re = 2\n", rubbing = text + "model.gamma = 3\n",
                          spinning = text + "velocity = {initial = \"rotation\", omega = 1}\n";
        if (m.viscous)
            EXPECT_EQ(motion_law(parse_case(viscous, {}, "case.toml").model).viscosity, 0.5);
        else
            EXPECT_THROW(parse_case(viscous, {}, "case.toml"), CaseError) << m.name;
        if (m.inextensible)
            EXPECT_EQ(motion_law(parse_case(rubbing, {}, "case.toml").model).friction, 3);
        else
            EXPECT_THROW(parse_case(rubbing, {}, "case.toml"), CaseError) << m.name;
        if (m.inertia)
            EXPECT_EQ(parse_case(spinning, {}, "case.toml").velocity.initial, InitialVelocity::rotation);
        else
            EXPECT_THROW(parse_case(spinning, {}, "case.toml"), CaseError) << m.name;
    }
}

TEST(Model, ThatIsChosenIsTheOneWithThatName) {
    // docs/case_files.md: the run is that of the model with the Re and gamma of the case.
    const std::string text =
        "tier = \"axisym\"\nenergy.k20 = 1\nshape.kind = \"sphere\"\nshape.radius = 1\ntime.end = 1\n"
        "model = {kind = \"auto\", Re = 2, gamma = 3, volume = \"free\"}\n";
    for (const ModelEntry& m : models) {
        if (!m.inextensible || m.kind == ModelKind::automatic) continue;
        const Case chosen = parse_case(text, {fmt::format("model.chosen={}", m.name)}, "case.toml");
        std::vector<std::string> sets{fmt::format("model.kind={}", m.name)};
        std::string named_text = text;
        if (!m.viscous) named_text.erase(named_text.find("Re = 2, "), 8);
        EXPECT_EQ(effective_toml(chosen), effective_toml(parse_case(named_text, sets, "case.toml")));
    }
}

}  // namespace tubule::model_test
