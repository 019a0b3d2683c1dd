// Sources in tier surface3d: theory.md (3.26), (3.27). Expected values: tests/support/inflating_sphere.hpp; further
// flows, and orders on finer meshes, are those of tests/studies/surface3d/sources_study.py.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/inflating_sphere.hpp"
#include "tests/surface3d/run_case.hpp"

namespace tubule::surface3d {
namespace sources_test {

struct Scheme {
    const char *kind, *name;
    double order;
    InflatingSphere::Flow flow;
};

Outcome run_flow(const Scheme& s, const InflatingSphere& sphere, double step) {
    return run_case(
        fmt::format("[energy]\nk20 = 0.3\nH0 = -1\n[model]\nkind = \"{}\"\ngamma = 0.5\n{}"
                    "[shape]\nkind = \"sphere\"\nradius = 1\n[time]\nend = 0.4\n"
                    "[accuracy]\nenergy = 0.1\nestimate = false\n"
                    "[discretisation]\nelements = 80\norder = 4\nscheme = \"{}\"\nstep = {}\n",
                    s.kind, sphere.model(true), s.name, step));
}

TEST(Sources, GiveEachSchemeItsOrder) {
    using enum InflatingSphere::Flow;
    for (const Scheme& s : {Scheme{"fluid", "alpha", 2, octahedral},
                            {"stokes", "bdf2", 2, shear},
                            {"overdamped", "bdf2", 2, octahedral}}) {
        SCOPED_TRACE(fmt::format("{} {}", s.kind, s.name));
        const std::string kind = s.kind;
        const InflatingSphere sphere{.flow = s.flow, .inertia = kind == "fluid", .flows = kind != "overdamped"};
        const double area = 4 * pi * std::pow(InflatingSphere::R(0.4), 2);
        const Outcome coarse = run_flow(s, sphere, 0.1), fine = run_flow(s, sphere, 0.05);
        const double error = std::abs(fine.last("area") / area - 1);
        EXPECT_NEAR(std::log2(std::abs(coarse.last("area") / area - 1) / error), s.order, 0.3);
        EXPECT_LT(error, 4e-3);
        EXPECT_NEAR(fine.last("energy"), sphere.energy(0.4), 5e-3 * fine.summary.reference_energy);
        EXPECT_NEAR(fine.last("dissipation"), sphere.dissipation(0.4), 0.1 * sphere.dissipation(0.4));
        EXPECT_LT(std::abs(fine.last("identity_defect")), 0.2);
        if (kind != "fluid") continue;
        EXPECT_NEAR(fine.last("kinetic_energy"), sphere.kinetic(0.4), 0.02);
    }
}

TEST(Sources, StopWhereTheyAreNotDefined) {
    const Outcome o = run_case(
        "[energy]\nk20 = 1\n[shape]\nkind = \"sphere\"\nradius = 1\n[time]\nend = 2\n"
        "[accuracy]\nenergy = 0.1\nestimate = false\n[discretisation]\nelements = 80\n[model.source]\n"
        "force_z = \"1 + 0.1*sqrt(1.3-z)\"\n");
    EXPECT_EQ(o.summary.stop.reason, Stop::undefined);
    EXPECT_NE(o.summary.stop.message.find("a formula is hardly defined any more"), std::string::npos);
}

}  // namespace sources_test
}  // namespace tubule::surface3d
