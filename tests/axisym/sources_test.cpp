// Sources in tier axisym: theory.md (3.26), (3.27). Expected values: tests/support/inflating_sphere.hpp.
#include <gtest/gtest.h>

#include "common/case/read.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/support/inflating_sphere.hpp"

namespace tubule::axisym {
namespace sources_test {

Outcome run_text(const std::string& text) {
    return run_case(parse_case("tier = \"axisym\"\n" + text, {}, "case.toml"));
}

TEST(Sources, MoveASphereInEachModel) {
    for (const std::string kind : {"fluid", "stokes", "overdamped"}) {
        InflatingSphere sphere{.inertia = kind == "fluid", .flows = kind != "overdamped"};
        const Outcome o = run_text(
            "[energy]\nk20 = 0.3\nH0 = -1\n[model]\nkind = \"" + kind + "\"\ngamma = 0.5\n" + sphere.model(false) +
            "[shape]\nkind = \"sphere\"\nradius = 1\n[accuracy]\nenergy = 1e-5\n[time]\nend = 1\n");
        SCOPED_TRACE(kind);
        const double E_ref = o.summary.reference_energy, R = InflatingSphere::R(1);
        EXPECT_NEAR(o.last("energy"), sphere.energy(1), 1e-5 * E_ref);
        EXPECT_NEAR(o.last("area"), 4 * pi * R * R, 2e-4);
        EXPECT_NEAR(o.last("tension"), 1 - 0.4 * R * R / 3, 1e-4);  // -p in the mean
        EXPECT_LT(std::abs(o.last("identity_defect")), 2e-4);
        if (kind != "fluid") continue;
        EXPECT_NEAR(o.last("kinetic_energy"), sphere.kinetic(1), 1e-3);
        EXPECT_NEAR(o.last("dissipation"), sphere.dissipation(1), 5e-3);
    }
}

// Without inertia, viscosity and p: u.nu = b + the force along the normal.
TEST(Sources, PushAGradientFlow) {
    const std::string still =
        "[energy]\nk20 = 1\n[shape]\nkind = \"sphere\"\nradius = 1\n[time]\nend = 0.2\n[model.source]\n";
    const std::string out = "\"0.5*", in = "/sqrt(r^2+z^2)\"\n";
    const Outcome o = run_text(still + "force_r = " + out + "r" + in + "force_z = " + out + "z" + in);
    EXPECT_NEAR(o.last("r_max"), 1.1, 1e-5);  // b = 0
    // A tube, moved along its axis and not at all by a force along it.
    const Outcome tube = run_text(
        "[energy]\nk20 = 1\nH0 = -1\n[shape]\nkind = \"tube\"\nradius = 1\nlength = 3\n"
        "[time]\nend = 0.1\n[model.source]\nforce_r = \"0.1*cos(2*pi*z/3)\"\nforce_z = \"1\"\n");
    EXPECT_GT(tube.last("r_max"), 1.003);
    EXPECT_LT(tube.last("r_min"), 0.997);
    EXPECT_LT(std::abs(tube.last("identity_defect")), 1e-4);
}

// In gradient flow a force along the membrane moves nothing, nor the points that carry H0.
TEST(Sources, LeaveH0WhereItIs) {
    const std::string tube =
        "[energy]\nk20 = 1\nH0 = \"-1 + 0.2*sin(2*pi*z/3)\"\n[shape]\nkind = \"tube\"\nradius = 1\n"
        "length = 3\n[time]\nend = 0.01\n[accuracy]\nenergy = 1e-5\n";
    const Outcome free = run_text(tube), pushed = run_text(tube + "[model.source]\nforce_z = \"20*sin(2*pi*z/3)\"\n");
    // Where the tube is no longer straight the force has a small normal part.
    EXPECT_NEAR(pushed.last("energy"), free.last("energy"), 0.02 * (free["energy"].front() - free.last("energy")));
}

TEST(Sources, HaveThePeriodOfATube) {
    try {
        run_text(
            "[energy]\nk20 = 1\n[shape]\nkind = \"tube\"\nradius = 1\nlength = 3\n[time]\nend = 0.1\n"
            "[model.source]\nforce_z = \"z\"\n");
        FAIL() << "accepted";
    } catch (const CaseError& error) {
        EXPECT_NE(std::string(error.what()).find("must have the period 3 of the tube"), std::string::npos);
    }
}

TEST(Sources, StopWhereTheyAreNotDefined) {
    const Outcome o = run_text(
        "[energy]\nk20 = 1\n[shape]\nkind = \"sphere\"\nradius = 1\n[time]\nend = 2\n[model.source]\n"
        "force_z = \"1 + 0.1*sqrt(1.3-z)\"\n");
    EXPECT_EQ(o.summary.stop.reason, Stop::undefined);
    EXPECT_NE(o.summary.stop.message.find("a formula is hardly defined any more"), std::string::npos);
}

}  // namespace sources_test
}  // namespace tubule::axisym
