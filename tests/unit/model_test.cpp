#include "common/model/model.hpp"

#include <gtest/gtest.h>

#include "common/case/read.hpp"

namespace tubule {
namespace {

// What docs/case_files.md says about each model. Without `default`: a model that is missing here does not compile.
#pragma GCC diagnostic error "-Wswitch"
MotionLaw documented(ModelKind kind) {
    switch (kind) {
        case ModelKind::gradient_flow:
            return {.friction = 1, .inextensible = false, .keeps_volume = false};
        case ModelKind::overdamped:
            return {.friction = 1};
        case ModelKind::stokes:
            return {.viscosity = 0.25, .friction = 0.3};
        case ModelKind::fluid:
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
        model.keeps_volume = !expected.keeps_volume;  // a case may say otherwise
        EXPECT_EQ(motion_law(model).keeps_volume, !expected.keeps_volume) << m.name;
    }
}

TEST(Model, isNamedInCaseFilesAndTakesItsKeys) {
    for (const ModelEntry& m : models) {
        const std::string text =
            "tier = \"axisym\"\nenergy.k20 = 1\nshape.kind = \"sphere\"\nshape.radius = 1\n"
            "time.end = 1\nmodel.kind = \"" +
            std::string(m.name) + "\"\n";
        EXPECT_EQ(parse_case(text, {}, "case.toml").model.kind, m.kind);
        const std::string viscous = text + "model.Re = 2\nmodel.gamma = 3\n",
                          spinning = text + "velocity = {initial = \"rotation\", omega = 1}\n";
        if (m.viscous)
            EXPECT_EQ(motion_law(parse_case(viscous, {}, "case.toml").model).viscosity, 0.5);
        else
            EXPECT_THROW(parse_case(viscous, {}, "case.toml"), CaseError) << m.name;
        if (m.inertia)
            EXPECT_TRUE(parse_case(spinning, {}, "case.toml").velocity.rotates);
        else
            EXPECT_THROW(parse_case(spinning, {}, "case.toml"), CaseError) << m.name;
    }
}

}  // namespace
}  // namespace tubule
