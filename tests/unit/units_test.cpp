// Physical units of a case: theory.md (12.1), (12.2) written out again with SI numbers of this file.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "common/case/read.hpp"
#include "tests/support/message_of.hpp"

namespace tubule {
namespace units_test {

const std::string tube =
    "tier = \"axisym\"\n"
    "[units]\n"                                                    // 2
    "length = \"0.05 \u00b5m\"\n"                                  // 3
    "bending_rigidity = \"20 kT\"\n"                               // 4
    "[energy]\nk20 = 0.25\nH0 = -1\n[model]\nkind = \"stokes\"\n"  // 5 to 9
    "Re = 2\ngamma = 0.5\n"                                        // 10, 11
    "[shape]\nkind = \"tube\"\nradius = 1\nlength = 6\n[time]\nend = 1\n";

constexpr double R = 50e-9, kT = 1.380649e-23 * 298.15, E = 2 * 20 * kT;  // k20 = 1/4: kappa is half a unit of energy

Case with(const std::vector<std::string>& sets) {
    return parse_case(tube, sets, "case.toml");
}
double time_with(const std::vector<std::string>& sets) {
    return scales_of(with(sets)).time.value_or(0);
}
std::string refusal(const std::vector<std::string>& sets) {
    return test::message_of<CaseError>([&] { with(sets); });
}

TEST(Units, ScalesFollowFromRigidityAndLength) {
    const Scales s = scales_of(with({}));
    EXPECT_DOUBLE_EQ(s.length, R);
    EXPECT_DOUBLE_EQ(s.kT, kT);
    EXPECT_DOUBLE_EQ(s.energy, E);
    EXPECT_FALSE(s.time);
    const Scales other = scales_of(with({"units.bending_rigidity=82 pN nm", "units.temperature=310 K"}));
    EXPECT_DOUBLE_EQ(other.energy, 2 * 82e-21);
    EXPECT_DOUBLE_EQ(other.kT, 1.380649e-23 * 310);
    EXPECT_EQ(known_scales(parse_case(tube.substr(0, 16) + tube.substr(tube.find("[energy]")), {}, "a.toml")),
              std::nullopt);
}

// Each quantity, in a model that has it, alone fixes the unit of time.
TEST(Units, TimeFollowsFromViscosityDensityOrFriction) {
    const std::string density = "units.density=5 mg/m^2", friction = "units.friction=20 kPa s/m",
                      viscosity = "units.viscosity=3 nN s/m", fluid = "model.kind=fluid";
    const double by_viscosity = 2 * 3e-9 * R * R / E, by_friction = 2e4 * std::pow(R, 4) / E / 0.5,
                 by_density = std::sqrt(5e-6 * std::pow(R, 4) / E);
    for (const std::string kind : {"stokes", "fluid", "auto"})
        EXPECT_DOUBLE_EQ(time_with({"model.kind=" + kind, viscosity}), by_viscosity);
    for (const std::string kind : {"stokes", "fluid"})
        EXPECT_DOUBLE_EQ(time_with({"model.kind=" + kind, friction}), by_friction);
    EXPECT_DOUBLE_EQ(time_with({fluid, density}), by_density);
    // What was chosen for "auto" keeps the unit.
    EXPECT_DOUBLE_EQ(time_with({"model.kind=auto", "model.chosen=overdamped", viscosity}), by_viscosity);
    const std::string text = tube.substr(0, tube.find("Re =")) + tube.substr(tube.find("[shape]"));
    for (const std::string kind : {"gradient-flow", "overdamped"})
        EXPECT_DOUBLE_EQ(*scales_of(parse_case(text, {"model.kind=" + kind, friction}, "case.toml")).time,
                         by_friction / 2);
    // More of them must agree with the numbers of the case, within 5 %.
    const double gamma = by_friction / 2 / by_viscosity;
    EXPECT_DOUBLE_EQ(time_with({viscosity, friction, fmt::format("model.gamma={}", gamma * 1.04)}), by_viscosity);
    EXPECT_EQ(refusal({viscosity, friction}),
              fmt::format("--set {}: units.friction makes model.gamma {:.4g} with units.viscosity, not 0.5: change "
                          "model.gamma, or leave one of the two out",
                          friction, gamma));
    EXPECT_EQ(refusal({fluid, density, viscosity}),
              fmt::format("--set {}: units.viscosity makes model.Re {:.4g} with units.density, not 2: change model.Re, "
                          "or leave one of the two out",
                          viscosity, by_density / by_viscosity * 2));
    EXPECT_EQ(refusal({friction, "model.gamma=0"}),
              "--set " + friction + ": units.friction needs model.gamma > 0, for which it stands");
}

TEST(Units, EveryDimensionHasAUnit) {
    const Scales s = scales_of(with({"units.viscosity=3e-9 Pa s m"}));
    const double T = *s.time, us = T / 1e-6;
    const std::map<std::string, LabUnit> expected{
        {"energy", {40, "kT"}},
        {"length", {50, "nm"}},
        {"length^3", {125e3, "nm^3"}},
        {"1/length^2", {1 / 2500.0, "1/nm^2"}},
        {"time", {us, "us"}},
        {"1/time", {1 / us, "1/us"}},
        {"length/time", {R / T * 1e6, "um/s"}},
        {"energy/length", {E / R * 1e12, "pN"}},
        {"energy/length^2", {E / (R * R) * 1e6, "uN/m"}},
        {"energy/length^3", {E / (R * R * R) / 1e3, "kPa"}},
        {"energy/time", {40 / us, "kT/us"}},
        {"energy time/length", {40 * us / 50, "kT us/nm"}},
    };
    for (const auto& [dimensions, unit] : expected) {
        EXPECT_EQ(lab_unit(s, dimensions).name, unit.name) << dimensions;
        EXPECT_NEAR(lab_unit(s, dimensions).scale, unit.scale, 1e-13 * unit.scale) << dimensions;
    }
    for (const char* none : {"1", "radian", "s", "that of the key"}) EXPECT_EQ(lab_unit(s, none).name, "") << none;
    EXPECT_EQ(lab_unit(std::nullopt, "energy").name, "");
    EXPECT_EQ(lab_unit(scales_of(with({})), "length/time").name, "");  // the unit of time is not known
    // Prefixes by numbers
    for (const auto& [number, name] :
         std::map<double, std::string>{{-1e3, "mN/m"}, {0, "uN/m"}, {1e-15, "uN/m"}, {1e-3, "nN/m"}})
        EXPECT_EQ(lab_unit(s, "energy/length^2", number).name, name) << number;
    EXPECT_EQ(lab_unit(s, "energy/length", 1e3).name, "nN");
    EXPECT_EQ(lab_unit(s, "energy", 1e3).name, "kT");
    // Prefixes at their ends
    const auto length = [](const std::string& text) {
        const LabUnit unit = lab_unit(scales_of(with({"units.length=" + text})), "length");
        return fmt::format("{:.6g} {}", unit.scale, unit.name);
    };
    for (const std::string text : {"1 um", "999 nm", "1 nm", "1 m"}) EXPECT_EQ(length(text), text);
    EXPECT_EQ(length("2000 m"), "2000 m");
    EXPECT_EQ(length("1e-20 m"), "0.01 am");
}

}  // namespace units_test
}  // namespace tubule
