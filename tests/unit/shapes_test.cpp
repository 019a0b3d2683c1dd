// The shapes a case may begin with: what each tier accepts, what is refused, and that a case reads back as written.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "common/case/read.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::shapes_test {

const std::string energy = "[energy]\nk20 = 1.0\n";             // lines 2, 3
const std::string surface = "tier = \"surface3d\"\n" + energy;  // line 1 and these
const std::string axisym = "tier = \"axisym\"\n" + energy;
const std::string time_span = "[time]\nend = 1.0\n";

std::string refusal(const std::string& text) {
    return test::message_of<CaseError>([&] { parse_case(text, {}, "case.toml"); });
}

std::string shape(const std::string& keys) {
    return "[shape]\n" + keys;  // its keys begin in line 5
}

TEST(ShapeKeys, EveryShapeReadsBackAsWritten) {
    const std::vector<std::string> shapes{
        "kind = \"tube\"\nradius = 1\nlength = 2\n[[shape.mode]]\namplitude = 0.1\nn = 1\nm = -2\nphase = 0.5\n",
        "kind = \"sphere\"\nradius = 1\n[[shape.mode]]\namplitude = 0.5\nl = 5\nm = 3\n",
        "kind = \"ellipsoid\"\na = 1\nb = 1.25\nc = 0.75\n",
        "kind = \"torus\"\nradius = 2\ntube_radius = 0.5\n",
        "kind = \"capsule\"\nradius = 0.5\nlength = 2\n",
        "kind = \"dumbbell\"\n",
        "kind = \"file\"\npath = \"scan.obj\"\nweld = 1e-6\nsmoothing = 2\n",
        "kind = \"result\"\npath = \"run.hdf\"\nframe = -2\n"};
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        const Case c = parse_case(surface + shape(shapes[i]), {}, "case.toml");
        const char* kind = std::visit([](const auto& shape) { return shape.kind; }, c.shape);
        EXPECT_EQ(shapes[i].find(std::string("kind = \"") + kind + "\""), 0u) << kind;
        const std::string written = effective_toml(c);
        EXPECT_EQ(effective_toml(parse_case(written, {}, "again.toml")), written);
        for (const char* value : {"1.25", "scan.obj", "-2", "1e-06"})  // not lost on the way
            if (shapes[i].find(value) != std::string::npos) {
                EXPECT_CONTAINS(written, value);
            }
    }
}

TEST(ShapeKeys, HarmonicsOfHighDegree) {
    // Against the standard library, which also has the sign (-1)^m of Condon and Shortley. (2 l)! overflows a double.
    for (const auto [l, m] : {std::array{100, 100}, std::array{120, 60}, std::array{300, 3}})
        for (const double theta : {0.3, 1.2, 2.0}) {
            const double expected = std::sph_legendre(l, m, theta);
            EXPECT_NEAR(real_harmonic<double>(l, m, {std::sin(theta), 0, std::cos(theta)}), expected,
                        1e-10 * std::abs(expected) + 1e-12)
                << l << " " << m << " " << theta;
        }
}

TEST(ShapeKeys, ManyWavesAreCheckedInNoTime) {
    // So small that no sum of them reaches zero: 10^8 points and more would have to be looked at otherwise.
    EXPECT_EQ(
        refusal(surface + shape("kind = \"sphere\"\nradius = 1\nmode = [{amplitude = 1e-3, l = 1000, m = 500}]\n")),
        "accepted");
    EXPECT_EQ(refusal(surface + shape("kind = \"tube\"\nradius = 1\nlength = 1\n"
                                      "mode = [{amplitude = 0.9, n = 10000, m = 10000}]\n")),
              "accepted");
}

TEST(ShapeKeys, ChoicesOfTheSurface) {
    const Case c = parse_case(surface + shape("kind = \"dumbbell\"\n") +
                                  "[discretisation]\nelements = 500\norder = 4\nmesh = \"graded\"\n"
                                  "recovery = \"elementwise\"\nsmoothing = 1e-3\n",
                              {}, "case.toml");
    EXPECT_EQ(c.surface.elements, 500);
    EXPECT_EQ(c.surface.order, 4);
    EXPECT_EQ(c.surface.mesh, MeshKind::graded);
    EXPECT_EQ(c.surface.recovery, Recovery::elementwise);
    EXPECT_EQ(c.surface.smoothing, 1e-3);
    EXPECT_EQ(refusal(surface + shape("kind = \"dumbbell\"\n") + "[discretisation]\norder = 5\n"),
              "case.toml:7:9: discretisation.order must be one of 2, 3, 4, not 5");
    EXPECT_EQ(refusal(surface + shape("kind = \"dumbbell\"\n") + "[discretisation]\nsymmetry = true\n"),
              "case.toml:7:1: unknown key discretisation.symmetry: only tier \"axisym\" has it. Allowed here: "
              "elements, order, mesh, recovery, "
              "smoothing, scheme, step, time_tolerance, relaxation, follow_curvature, coarsen");
}

TEST(ShapeKeys, ImpossibleShapes) {
    const auto refused = [](const std::string& keys) { return refusal(surface + shape(keys)); };
    EXPECT_EQ(refused("kind = \"sphere\"\nradius = 1\n[[shape.mode]]\namplitude = 0.1\nl = 2\nm = 3\n"),
              "case.toml:10:5: shape.mode.0.m must be an integer >= 0 and <= 2 (l), not 3");
    EXPECT_CONTAINS(refused("kind = \"sphere\"\nradius = 1\n[[shape.mode]]\namplitude = 9\nl = 2\nm = 0\n"),
                    "case.toml:4:1: shape must have a positive radius everywhere, but it is -");
    EXPECT_EQ(refused("kind = \"torus\"\nradius = 1\ntube_radius = 1\n"),
              "case.toml:7:15: shape.tube_radius must be below shape.radius: the torus intersects itself");
    EXPECT_EQ(refused("kind = \"file\"\n"), "case.toml:4:1: missing key shape.path: a string");
    // A mode m = 1 that the meridian theta = 0 does not show: r0 = 1 - 1.1 sin(theta).
    EXPECT_EQ(refused("kind = \"tube\"\nradius = 1\nlength = 2\n[[shape.mode]]\namplitude = 1.1\nn = 0\nm = 1\n"
                      "phase = 1.5707963267948966\n"),
              "case.toml:4:1: shape must have r0 > 0 everywhere, but r0 = -0.0162675 at z = 0, theta = 1.1781");
}

TEST(ShapeKeys, WhatEachTierTakes) {
    const auto refused = [](const std::string& keys) { return refusal(axisym + shape(keys) + time_span); };
    EXPECT_EQ(
        refused("kind = \"sphere\"\nradius = 1\n[[shape.mode]]\namplitude = 0.1\nl = 2\nm = 1\n"),
        "case.toml:10:5: shape.mode.0.m must be 0, not 1: tier \"axisym\" is axisymmetric and has no modes m > 0");
    EXPECT_EQ(refused("kind = \"ellipsoid\"\na = 1\nb = 2\nc = 1\n"),
              "case.toml:7:5: shape.b must be a = 1, not 2: tier \"axisym\" is axisymmetric about z");
    EXPECT_EQ(refused("kind = \"file\"\npath = \"scan.obj\"\n"),
              "case.toml:5:8: shape.kind must not be \"file\": meshes need tier = \"surface3d\"");
    const auto still = [](const std::string& more) { return refusal(surface + shape("kind = \"dumbbell\"\n") + more); };
    EXPECT_EQ(still(time_span), "accepted");
    EXPECT_EQ(still("[model]\nkind = \"fluid\"\n"),
              "case.toml:6:1: model must be absent: only valid with a table [time]; nothing moves without it");
    EXPECT_EQ(still("[discretisation]\nstep = 0.1\n"),
              "case.toml:7:8: discretisation.step must be absent: only valid with a table [time]");
    EXPECT_EQ(still(time_span + "[discretisation]\nrecovery = \"patch\"\n"),
              "case.toml:9:12: discretisation.recovery must be absent: only valid with a single surface, without "
              "[time]; the scheme determines the curvatures of a surface in motion");
    EXPECT_EQ(still(time_span + "[discretisation]\nscheme = \"paper\"\n"),
              "case.toml:9:10: discretisation.scheme must not be \"paper\": only valid with discretisation.step; it "
              "does not adapt the step");
    const std::string by_bdf = "[discretisation]\nscheme = \"bdf\"\n";
    EXPECT_EQ(still(time_span + "[model]\nkind = \"stokes\"\n" + by_bdf), "accepted");
    EXPECT_EQ(still(time_span + "[model]\nkind = \"fluid\"\n" + by_bdf),
              "case.toml:11:10: discretisation.scheme must not be \"bdf\": only valid with a model without inertia; "
              "bending waves grow in its steps");
    EXPECT_EQ(still("[accuracy]\nr_min = 0.1\n"),
              "case.toml:7:9: accuracy.r_min must be absent: only valid with a table [time]; nothing moves without it");
}

TEST(ModelKeys, WhatGoesTogether) {
    const auto tube = [](const std::string& model, const std::string& more = "") {
        return refusal("tier = \"axisym\"\n[energy]\nk20 = 1.0\n[shape]\nkind = \"tube\"\nradius = 1\nlength = 2\n" +
                       time_span + "[model]\n" + model + more);
    };
    EXPECT_EQ(tube("kind = \"fluid\"\nRe = 2\ngamma = 0.5\n[velocity]\ninitial = \"rotation\"\nomega = 1\n"),
              "accepted");
    EXPECT_EQ(tube("kind = \"fluid\"\nRe = 0\n"), "case.toml:12:6: model.Re must be a number > 0, not 0");
    EXPECT_EQ(tube("kind = \"overdamped\"\ngamma = 1\n"), "accepted");
    EXPECT_EQ(tube("kind = \"overdamped\"\ngamma = 0\n"), "case.toml:12:9: model.gamma must be a number > 0, not 0");
    EXPECT_EQ(tube("kind = \"gradient-flow\"\ngamma = 1\n"),
              "case.toml:12:9: model.gamma must be absent: only valid with model.kind = \"overdamped\" or \"stokes\" "
              "or \"fluid\" or \"auto\"");
    EXPECT_EQ(tube("kind = \"auto\"\ngamma = 1\nchosen = \"overdamped\"\n"), "accepted");
    EXPECT_EQ(tube("kind = \"auto\"\nchosen = \"gradient-flow\"\n"),
              "case.toml:12:10: model.chosen must be one of \"overdamped\", \"stokes\", \"fluid\", not "
              "\"gradient-flow\"");
    EXPECT_EQ(
        tube("kind = \"fluid\"\nchosen = \"stokes\"\n"),
        "case.toml:12:10: model.chosen must be absent: only valid with model.kind = \"auto\"; it says what is chosen");
    EXPECT_EQ(tube("kind = \"auto\"\nchosen = \"overdamped\"\n"),
              "case.toml:12:10: model.chosen must not be \"overdamped\": only valid with model.gamma > 0; nothing else "
              "would resist the motion");
    EXPECT_EQ(tube("kind = \"auto\"\nchosen = \"stokes\"\n", "[velocity]\ninitial = \"rotation\"\nomega = 1\n"),
              "case.toml:14:11: velocity.initial must not be \"rotation\": only valid with model.chosen = \"fluid\"");
    EXPECT_EQ(tube("kind = \"stokes\"\n", "[velocity]\ninitial = \"rest\"\n"),
              "case.toml:13:11: velocity.initial must be absent: only valid with model.kind = \"fluid\" or \"auto\"");
    EXPECT_EQ(tube("kind = \"fluid\"\n", "[velocity]\ninitial = \"rotation\"\n"),
              "case.toml:12:1: missing key velocity.omega: a finite number");
    EXPECT_EQ(tube("kind = \"fluid\"\n", "[discretisation]\nparametrisation = \"graph\"\n"),
              "case.toml:13:19: discretisation.parametrisation must not be \"graph\": only valid with a graph r(z): "
              "the gradient flow of a tube, free volume and area, constant tension and pressure");
    EXPECT_EQ(tube("kind = \"gradient-flow\"\n", "[discretisation]\nparametrisation = \"material\"\n"),
              "case.toml:13:19: discretisation.parametrisation must not be \"material\": only valid with a flow along "
              "the membrane: an inextensible model, or H0 that varies");
}

}  // namespace tubule::shapes_test
