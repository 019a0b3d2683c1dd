// Starts that a case brings along: profiles from files, radii as formulas, noise.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include "common/case/input_file.hpp"
#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/shapes/ellipsoid.hpp"
#include "common/shapes/formula_shape.hpp"
#include "common/shapes/profile_file.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::starts_test {

using test::message_of;

FittedProfile profile_in(const std::filesystem::path& path, const ProfileFile& how) {
    return read_profile(path, read_input(path, megabyte), how);
}

class Files : public testing::Test {
protected:
    Files() : folder_(std::filesystem::temp_directory_path() / ("starts_" + std::to_string(std::random_device()()))) {
        std::filesystem::create_directory(folder_);
    }
    ~Files() override { std::filesystem::remove_all(folder_); }

    std::filesystem::path write(const std::string& text) const {
        std::ofstream(folder_ / "p.csv") << text;
        return folder_ / "p.csv";
    }
    // n + 1 points of a curve, moved at random by about `noise` but at its ends.
    std::filesystem::path points(int n, const std::function<std::array<double, 2>(double)>& at,
                                 double noise = 0) const {
        std::mt19937 random(7);
        std::normal_distribution<double> normal;
        std::ofstream file(folder_ / "p.csv");
        file.precision(17);
        file << "# r, z\nr,z\n";
        for (int i = 0; i <= n; ++i) {
            const double moved = i > 0 && i < n ? noise : 0;
            const auto [r, z] = at(static_cast<double>(i) / n);
            file << r + moved * normal(random) << ", " << z + moved * normal(random) << "\n";
        }
        return folder_ / "p.csv";
    }
    // The message about this text, without the folder.
    std::string refusal(const std::string& text, const ProfileFile& how = {}) const {
        const std::filesystem::path path = write(text);
        const std::string all = message_of<ProfileError>([&] { profile_in(path, how); });
        return all.starts_with(path.string()) ? all.substr(folder_.string().size() + 1) : all;
    }

private:
    std::filesystem::path folder_;
};
using ProfileFiles = Files;

std::array<double, 2> spheroid(double t) {
    return {std::sin(pi * t), -1.6 * std::cos(pi * t)};
}
double from_spheroid(double r, double z) {
    return std::abs(std::hypot(r, z / 1.6) - 1);
}

ProfileFile within(double tolerance, std::optional<double> length = {}) {
    return {.path = "p.csv", .length = length, .tolerance = tolerance, .H0_tolerance = {}};
}

TEST_F(ProfileFiles, ComeAsCloseAsStated) {
    // A spheroid and a tube, known everywhere; the points are exact.
    for (const double tolerance : {1e-3, 1e-6, 1e-8}) {
        const FittedProfile cell = profile_in(points(120, spheroid), within(tolerance));
        EXPECT_EQ(cell.curve.topology, Topology::cell);
        EXPECT_LE(cell.distance, tolerance);
        const FittedProfile tube = profile_in(points(80,
                                                     [](double t) {
                                                         return std::array{1 + 0.3 * std::cos(2 * pi * t), 0.5 + 2 * t};
                                                     }),
                                              within(tolerance, 2));
        EXPECT_EQ(tube.curve.topology, Topology::tube);
        const PerturbedCurve curve = curve_through(cell);
        for (int i = 0; i <= 500; ++i) {
            const double s = i / 500.0;
            const auto p = cell.curve.at(s), q = tube.curve.at(s);
            EXPECT_LT(from_spheroid(p[0], p[2]), 2 * tolerance);
            EXPECT_LT(std::abs(q[0] - 1 - 0.3 * std::cos(pi * (q[2] - 0.5))), 2 * tolerance);
            const auto made = profile_at(curve, s);
            EXPECT_LT(from_spheroid(made[0], made[1]), 3 * tolerance);
        }
    }
}

TEST_F(ProfileFiles, NoiseIsSmoothedAway) {
    // 200 points with noise of .01: the curve is nearer to the spheroid than the points, and by far smoother.
    const FittedProfile fit = profile_in(points(200, spheroid, 0.01), within(0.05));
    EXPECT_LE(fit.distance, 0.05);
    for (int i = 0; i <= 200; ++i) {
        const auto p = fit.curve.at(i / 200.0);
        EXPECT_LT(from_spheroid(p[0], p[2]), 0.03);
    }
    EXPECT_CONTAINS(fit.note(), "201 points");
}

TEST_F(ProfileFiles, RunEitherWayWithOrWithoutTheLastPoint) {
    const FittedProfile down = profile_in(points(60, [](double t) { return spheroid(1 - t); }), within(1e-4));
    EXPECT_GT(down.curve.at(0.5)[3], 0);  // upwards on the outside
    const auto wave = [](double t) { return std::array{1 + 0.3 * std::cos(2 * pi * t * 63 / 64), 2 * t * 63 / 64}; };
    EXPECT_LE(profile_in(points(63, wave), within(1e-6, 2)).distance, 1e-6);
    const FittedProfile ring =
        profile_in(points(60,
                          [](double t) {
                              return std::array{2 + 0.5 * std::cos(2 * pi * t), 0.5 * std::sin(2 * pi * t)};
                          }),
                   within(1e-9));
    EXPECT_TRUE(curve_through(ring).is_ring());
}

TEST_F(ProfileFiles, AreRefusedWithTheirLine) {
    const std::string half = "0,-1\n.5,-.8\n.8,-.5\n", rest = ".9,.1\n.8,.3\n.7,.6\n.5,.8\n.3,.9\n0,1\n";
    EXPECT_EQ(refusal(half + "x,0\n" + rest), "p.csv:4:1: 'x' is not a finite number");
    EXPECT_EQ(refusal(half + "1,nan\n" + rest), "p.csv:4:3: 'nan' is not a finite number");
    EXPECT_EQ(refusal(half + "1,0,2\n" + rest), "p.csv:4:5: has 3 values where 2 are expected: r, z");
    EXPECT_EQ(refusal("a,b\n" + half + rest), "p.csv:1:1: a heading must name the columns r and z");
    EXPECT_EQ(refusal(half), "p.csv:3:1: 3 points are too few: a profile needs 9");
    EXPECT_EQ(refusal(half + "1,0;2,0\n" + rest),
              "p.csv:4:5: has 4 values where 2 are expected: r, z; decimals have a point, not a comma");
    const std::string open = "0,-1\n.1,-1\n.2,-.9\n.3,-.8\n.4,-.7\n.5,-.6\n.6,-.4\n.5,-.2\n";
    EXPECT_EQ(refusal(open + "0,9\n.4,0\n"),
              "p.csv:9:1: is 9.21 from the point before: points must be in order along the profile");
    EXPECT_EQ(refusal(open + "-.2,0\n"),
              "p.csv:9:1: r = -0.2 is below 0, but it is the distance from the axis: give the half of the outline with "
              "r >= 0");
    EXPECT_EQ(refusal("-1,0\n-1,.1\n-.9,.2\n-.8,.3\n-.7,.4\n-.6,.5\n-.4,.6\n-.2,.5\n.2,0\n"),
              "p.csv:1:1: r = -1 is below 0, but it is the distance from the axis: are the columns r and z swapped?");
    EXPECT_EQ(refusal(half + "-.1,0\n" + rest),
              "p.csv:4:1: r = -0.1: the profile meets the axis within; give one half of the "
              "outline, r >= 0, from pole to pole");
    EXPECT_EQ(refusal(half + ".8,-.5\n" + rest), "p.csv:4:1: the same point as before; remove one of the two");
    EXPECT_CONTAINS(refusal(half + "1,0\n.9,-.9\n" + rest), "p.csv:6:1: the profile crosses itself");
    EXPECT_CONTAINS(refusal(half + rest.substr(0, rest.size() - 4) + ".1,1\n"), "p.csv:9:1: the profile is not closed");
    EXPECT_CONTAINS(refusal(".5,0\n.5,.1\n.5,.2\n.5,.3\n.5,.4\n.5,.5\n.5,.6\n.5,.7\n.5,.8\n.5,2\n", within(1e-3, 1)),
                    "p.csv:10:1: the profile rises by 2, more than shape.length = 1");
    // One point so far away that squares are no numbers: this crashed.
    for (const double far : {1e97, 1e200}) {
        const auto path = points(120, [&](double t) {
            auto point = spheroid(t);
            if (t > 0.02 && t < 0.03) point[1] *= far;
            return point;
        });
        EXPECT_NE(message_of<ProfileError>([&] { profile_in(path, {}); }).find("smooth curve"), std::string::npos)
            << far;
    }
    // A corner is no smooth curve.
    std::string cone;
    for (int i = 0; i <= 10; ++i) cone += fmt::format("{},{}\n", 0.1 * std::min(i, 10 - i), 0.1 * i);
    EXPECT_CONTAINS(refusal(cone, within(1e-6)), "set shape.tolerance to 0.029");
}

// ---- H0 of each point

double domains(double area) {
    return -2 - std::tanh((area - 0.6) / 0.1);
}
// Rows "r,z,H0" of n + 1 points of the unit sphere, where (1 + z)/2 is the part of the area below; H0 may be disturbed.
std::string sphere_rows(
    int n, const std::function<double(int)>& disturbed = [](int) { return 0.0; }) {
    std::string out = "r,z,H0\n";
    for (int i = 0; i <= n; ++i) {
        const double t = pi * i / n, r = i == 0 || i == n ? 0 : std::sin(t), z = -std::cos(t);
        out += fmt::format("{:.17g},{:.17g},{:.17g}\n", r, z, domains((1 + z) / 2) + disturbed(i));
    }
    return out;
}

TEST_F(ProfileFiles, H0OfThePointsIsAFunctionOfTheAreaBelow) {
    // Definition of the points, and derivatives by differences. A bound on the error between points is not stated: five
    // times the tolerance is what this one keeps.
    for (const double tolerance : {1e-4, 1e-7}) {
        ProfileFile how = within(1e-9);
        how.H0_tolerance = tolerance;
        const FittedProfile fit = profile_in(write(sphere_rows(200)), how);
        ASSERT_TRUE(fit.H0);
        EXPECT_LE(fit.H0_distance, tolerance);
        using J = Jet<double, 1, 2>;
        for (int i = 0; i <= 1000; ++i) {
            const double area = i / 1000.0, h = 1e-4;
            const J H0 = evaluate(*fit.H0, std::array{J::variable(area, 0)}.data());
            EXPECT_NEAR(H0.v, domains(area), 5 * tolerance);
            const auto at = [&](double a) { return evaluate(*fit.H0, &a); };
            EXPECT_NEAR(H0.d[0], (at(area + h) - at(area - h)) / (2 * h), 1e-3);
            EXPECT_NEAR(H0.dd[0], (at(area + h) - 2 * at(area) + at(area - h)) / (h * h), 1e-2);
        }
        // The same on the curve that tier surface3d makes of it: c = -cos(pi s) = z.
        const PerturbedCurve curve = curve_through(fit);
        const CurveFunctions area = area_below(fit, curve);
        for (const double z : {-1.0, -0.99, -0.3, 0.2, 0.8, 1.0})
            EXPECT_NEAR(value_at(area, z)[1], (1 + z) / 2, 1e-8) << z;
    }
    // From the north to the south, the same.
    std::string rows;
    for (int i = 80; i >= 0; --i) {
        const double t = pi * i / 80;
        rows += fmt::format("{:.17g} {:.17g} {:.17g}\n", -std::cos(t), i % 80 == 0 ? 0 : std::sin(t), -std::cos(t));
    }
    const FittedProfile down = profile_in(write("z r H0\n" + rows), within(1e-9));
    EXPECT_NEAR(evaluate(*down.H0, std::array{0.25}.data()), -0.5, 1e-4);
}

TEST_F(ProfileFiles, H0OfTubesAndRingsRepeatsItself) {
    // A straight tube, whose area grows with z; a torus, whose area over the angle t from the outside is
    // 2 t + sin(t)/2 of 4 pi, with radii 2 and 0.5.
    const auto H0 = [](double area) { return -1 + 0.3 * std::cos(2 * pi * area) + 0.2 * std::sin(4 * pi * area); };
    const auto check = [&](const FittedProfile& fit) {
        for (int i = 0; i <= 100; ++i) {
            const double area = i / 100.0;
            EXPECT_NEAR(evaluate(*fit.H0, &area), H0(area), 1e-6) << i;
        }
        // The whole way around once.
        const PerturbedCurve curve = curve_through(fit);
        const CurveFunctions below = area_below(fit, curve);
        EXPECT_NEAR(value_at(below, 0.0)[1], value_at(below, 1.0)[1], 1e-12);
    };
    for (const int last : {39, 40}) {  // without and with the point that is the first one moved up
        std::string rows = "r,z,H0\n";
        for (int i = 0; i <= last; ++i) rows += fmt::format("1,{:.17g},{:.17g}\n", i / 20.0, H0(i / 40.0));
        check(profile_in(write(rows), within(1e-6, 2)));
    }
    std::string rows = "r,z,H0\n";
    for (int i = 0; i <= 80; ++i) {
        const double t = 2 * pi * (i % 80) / 80;
        rows += fmt::format("{:.17g},{:.17g},{:.17g}\n", 2 + 0.5 * std::cos(t), 0.5 * std::sin(t),
                            H0((2 * t + 0.5 * std::sin(t)) / (4 * pi)));
    }
    check(profile_in(write(rows), within(1e-8)));
}

TEST_F(ProfileFiles, H0IsSmoothedToItsOwnTolerance) {
    // Every other value is off by 0.02: beyond the default tolerance, within another one.
    const std::string noisy = sphere_rows(200, [](int i) { return i % 2 == 0 ? 0.02 : -0.02; });
    EXPECT_CONTAINS(refusal(noisy), "no smooth H0 comes within 0.000302 of all 201 values: the best is 0.0");
    ProfileFile how;
    how.H0_tolerance = 0.05;
    const FittedProfile fit = profile_in(write(noisy), how);
    EXPECT_CONTAINS(fit.note(), "a smooth H0 at most 0.0");
    for (int i = 0; i <= 100; ++i)
        EXPECT_NEAR(evaluate(*fit.H0, std::array{i / 100.0}.data()), domains(i / 100.0), 0.05);
    // A jump has no smooth function nearby; it is refused where it is.
    const std::string jump = sphere_rows(100, [](int i) { return i > 50 ? 1 : 0; });
    const std::string refused = refusal(jump);
    EXPECT_TRUE(refused.starts_with("p.csv:52:") || refused.starts_with("p.csv:53:")) << refused;
    EXPECT_CONTAINS(refused, "set shape.H0_tolerance to that, or give transitions a width");
    // So is a tube whose ends differ.
    std::string rows = "r,z,H0\n";
    for (int i = 0; i <= 40; ++i) rows += fmt::format("1,{:.17g},{:.17g}\n", i / 20.0, -1 - 0.01 * i);
    EXPECT_CONTAINS(refusal(rows, within(1e-6, 2)), "no smooth H0");
}

TEST_F(ProfileFiles, BadColumnsOfH0AreRefusedWithTheirPlace) {
    const std::string rows = sphere_rows(20);
    const auto with_line_5 = [&](const std::string& line) {
        std::size_t from = 0;
        for (int i = 1; i < 5; ++i) from = rows.find('\n', from) + 1;
        return rows.substr(0, from) + line + rows.substr(rows.find('\n', from));
    };
    EXPECT_EQ(refusal(with_line_5(".5,-.8,")), "p.csv:5:8: H0 is missing: complete the line, or leave it out");
    EXPECT_EQ(refusal(with_line_5(".5,-.8, , ")), "p.csv:5:10: has 4 values where 3 are expected: r, z, H0");
    EXPECT_EQ(refusal(with_line_5(".5 -.8")), "p.csv:5:4: has 2 values where 3 are expected: r, z, H0");
    EXPECT_EQ(refusal(with_line_5(".5,-.8,nan")), "p.csv:5:8: 'nan' is not a finite number");
    EXPECT_EQ(refusal(with_line_5(".5,-.8,  inf")), "p.csv:5:10: 'inf' is not a finite number");
    EXPECT_EQ(refusal(with_line_5(".5,-.8,lots")), "p.csv:5:8: 'lots' is not a finite number");
    EXPECT_EQ(refusal("r,z,H_0" + rows.substr(6)),
              "p.csv:1:5: there is no column 'H_0': the spontaneous curvature is called H0");
    EXPECT_EQ(refusal("r,z,r" + rows.substr(6)), "p.csv:1:5: a second column r");
    // Others are ignored, but that of H0 without a name is one value too many.
    EXPECT_FALSE(profile_in(write("r,z,weight" + rows.substr(6)), {}).H0);
    EXPECT_EQ(refusal(rows.substr(7)).substr(0, 25), "p.csv:1:6: has 3 values w");
}

TEST_F(ProfileFiles, H0OfACaseIsThatOfItsFile) {
    const std::string file = write(sphere_rows(100)).filename().string(),
                      folder = write(sphere_rows(100)).parent_path();
    const auto text = [&](const std::string& energy, const std::string& more = "[time]\nend = 1.0\n",
                          const std::string& tier = "axisym") {
        return fmt::format("tier = \"{}\"\n[energy]\nk20 = 0.5\n{}[shape]\nkind = \"profile\"\npath = \"{}\"\n{}", tier,
                           energy, file, more);
    };
    const auto parsed = [&](const std::string& of, const std::vector<std::string>& sets = {}) {
        return parse_case(of, sets, folder + "/case.toml");
    };
    const auto refused = [&](const std::string& of, const std::vector<std::string>& sets = {}) {
        const std::string all = message_of<CaseError>([&] { parsed(of, sets); });
        return all.starts_with(folder) ? all.substr(folder.size() + 1) : all;
    };
    const Case c = parsed(text(""));
    ASSERT_TRUE(c.energy.H0_from_points());
    EXPECT_NEAR(evaluate(*c.energy.H0_formula, std::array{0.3}.data()), domains(0.3), 1e-3);
    // What stands in the case alone is written, and read again.
    const std::string written = effective_toml(c);
    EXPECT_EQ(written.find("H0 ="), std::string::npos);
    EXPECT_EQ(effective_toml(parsed(written)), written);
    EXPECT_TRUE(parsed(written).energy.H0_from_points());

    EXPECT_EQ(refused(text("H0 = -1.0\n")),
              "case.toml:4:6: energy.H0 must be absent: " + folder + "/p.csv:1:5 has H0 in a column; or take that out");
    EXPECT_EQ(refused(text(""), {"energy.H0=-1"}).substr(0, 46), "--set energy.H0=-1: energy.H0 must be absent: ");
    // What has no law for it.
    const std::string still =
        "shape.path has a column H0, but H0 must be a number: what varies is only valid with a table [time]";
    EXPECT_CONTAINS(refused(text("", "", "surface3d")), still);
    const std::string automatic =
        "case.toml:6:8: shape.path has a column H0, but H0 must be a number: what varies is only valid with tier";
    EXPECT_TRUE(refused(text("", "[time]\nend = 1.0\n", "auto")).starts_with(automatic));
    EXPECT_CONTAINS(refused(text("", "[equilibrium]\nmodes = 1\n")),
                    "only valid with a case without equilibrium.modes");
    EXPECT_CONTAINS(refused(text("", "[time]\nend = 1.0\n[discretisation]\nparametrisation = \"even\"\n")),
                    "must not be \"even\": only valid with a number energy.H0");
    // A file that is wrong says so with its place.
    write(sphere_rows(20) + "1,2\n");
    EXPECT_TRUE(refused(text("")).starts_with("p.csv:23:3: has 2 values"));
}

FormulaShape shape(const std::string& r, std::optional<double> length = {}) {
    return {std::make_shared<const Formula>(parse_formula(r, length ? FormulaShape::of_tube : FormulaShape::of_cell)),
            length};
}

TEST(FormulaShapes, AreTheBuiltInOnes) {
    const FormulaShape tube = shape("1 + 0.2*cos(pi*z + 0.3) + 0.1*cos(2*pi*z - 3*theta)", 2);
    const Tube same{1, 2, {{0.2, 1, 0, 0.3}, {0.1, 2, -3, 0}}};
    // The spheroid r = 1/sqrt(sin^2/a^2 + cos^2/c^2).
    const FormulaShape ball = shape("1/sqrt(sin(theta)^2 + cos(theta)^2/1.6^2)");
    using J = Jet<double, 3, 2>;
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.7, -0.4, 0.3), Eigen::Vector3d(-0.2, 0.9, 1.4)}) {
        Vector3<J> at;
        for (int i = 0; i < 3; ++i) at[i] = J::variable(p[i], i);
        const Vector3<J> x = position(tube, at), y = position(same, at);
        for (int i = 0; i < 3; ++i) {
            EXPECT_NEAR(x[i].v, y[i].v, 1e-14);
            for (int k = 0; k < 3; ++k) EXPECT_NEAR(x[i].d[k], y[i].d[k], 1e-12);
            for (int k = 0; k < 6; ++k) EXPECT_NEAR(x[i].dd[k], y[i].dd[k], 1e-10);
        }
        const Eigen::Vector3d on = position(ball, p);
        EXPECT_NEAR(on[0] * on[0] + on[1] * on[1] + on[2] * on[2] / 2.56, 1, 1e-14);
    }
    EXPECT_NEAR(position(ball, Eigen::Vector3d(0, 0, -3))[2], -1.6, 1e-14);
    const auto pole = meridian(ball).at(0), equator = meridian(ball).at(0.5);
    EXPECT_NEAR(pole[0], 0, 1e-14);
    EXPECT_NEAR(pole[2], -1.6, 1e-14);
    EXPECT_NEAR(equator[0], 1, 1e-14);
    EXPECT_NEAR(narrowest(shape("1 + 0.2*cos(pi*z)", 2)).radius, 0.8, 1e-12);
}

TEST(FormulaShapes, ThatAreNoSurfacesAreRefused) {
    const auto expect = [](const FormulaShape& which, const std::string& words) {
        EXPECT_CONTAINS(complaint(which), words);
    };
    EXPECT_EQ(complaint(shape("1 + 0.1*cos(pi*z)*cos(2*theta)", 2)), "");
    EXPECT_EQ(complaint(shape("1 + 0.1*sin(theta)*cos(phi) + 0.05*cos(theta)")), "");
    expect(shape("1 + 1.2*cos(pi*z)", 2), "must be positive everywhere, but it is");
    expect(shape("1e-120", 2), "must be between 1e-100 and 1e+100 everywhere, but it is 1e-120 at z = 0");
    expect(shape("sqrt(z - 1)", 2), "must be defined everywhere, but not at z = 0");
    expect(shape("1 + 0.1*z", 2), "must repeat itself in z after 2, but it is 1 at 0 and 1.2 there");
    expect(shape("1 + 0.1*(z - 1)^2", 2), "has a kink where it repeats itself in z");
    expect(shape("1 + 0.1*sin(theta/2)", 2), "kink where it repeats itself in theta");
    expect(shape("1 + 0.1*sin(theta)"), "has a tip at the pole");
    expect(shape("1 + 0.1*cos(phi)"), "must have one value at each pole");
    EXPECT_EQ(asymmetry(shape("1 + 0.1*cos(theta)", 2)).first, "shape.r");
    EXPECT_EQ(asymmetry(shape("1 + 0.1*cos(theta)")).first, "");
}

Case read(const std::string& shape, const std::string& tier = "surface3d") {
    return parse_case("tier = \"" + tier + "\"\n[energy]\nk20 = 1.0\n[shape]\n" + shape +
                          (tier == "axisym" ? "[time]\nend = 1.0\n" : ""),
                      {}, "case.toml");
}

TEST(Noise, BecomesModesOfTheAmplitudeAskedFor) {
    const std::string tube =
        "kind = \"tube\"\nradius = 1.0\nlength = 2.0\n[[shape.noise]]\namplitude = 0.01\nn = 3\nm = 2\n";
    const Case c = read(tube + "seed = 5\n");
    const Tube& made = std::get<Tube>(c.shape);
    EXPECT_EQ(made.modes.size(), 3u * 5 + 1);  // n = 1, 2, 3 with m = -2 ... 2, and n = 0 with m = 2
    double square = 0;                         // average over the tube
    for (int i = 0; i < 40; ++i)
        for (int j = 0; j < 40; ++j) square += std::pow(radius_at(made, 2 * i / 40.0, 2 * pi * j / 40) - 1, 2) / 1600;
    EXPECT_NEAR(std::sqrt(square), 0.01, 1e-12);
    const auto same = [&](const std::string& other) {
        return std::get<Tube>(read(tube + other).shape).modes[0].amplitude == made.modes[0].amplitude;
    };
    EXPECT_TRUE(same("seed = 5\n"));
    EXPECT_FALSE(same("seed = 6\n"));
    EXPECT_EQ(effective_toml(parse_case(effective_toml(c), {}, "case.toml")), effective_toml(c));
    // The generator is that of the standard (mt19937_64), whose 10000th number from seed 5489 the standard gives.
    std::mt19937_64 generator(5489);
    generator.discard(9999);
    EXPECT_EQ(generator(), 9981545732273789042ull);
}

TEST(Noise, OfSpheresLeavesRadiusAndPlace) {
    const Case c = read("kind = \"sphere\"\nradius = 2.0\n[[shape.noise]]\namplitude = 0.01\nl = 4\nm = 4\n");
    const Sphere& made = std::get<Sphere>(c.shape);
    double square = 0, mean = 0;
    const int n = 60;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < 2 * n; ++j) {
            const double z = -1 + (2 * i + 1.0) / n, phi = pi * j / n, rho = std::sqrt(1 - z * z);
            const Eigen::Vector3d x(rho * std::cos(phi), rho * std::sin(phi), z);
            const double r = position(made, x).norm() / 2 - 1;
            square += r * r / (2 * n * n), mean += r / (2 * n * n);
        }
    EXPECT_NEAR(std::sqrt(square), 0.01, 2e-5);
    EXPECT_NEAR(mean, 0, 2e-5);
}

TEST(Noise, AroundTheAxisNeedsThreeDimensions) {
    const std::string tube = "kind = \"tube\"\nradius = 1.0\nlength = 2.0\n[[shape.noise]]\namplitude = 0.01\nm = 2\n";
    EXPECT_CONTAINS(message_of<CaseError>([&] { read(tube, "axisym"); }), "shape.noise.0.m must be 0");
    const std::string large = "kind = \"tube\"\nradius = 1.0\nlength = 2.0\n[[shape.noise]]\namplitude = 2.0\n";
    EXPECT_CONTAINS(message_of<CaseError>([&] { read(large); }), "must have r0(z) > 0 everywhere");
}

TEST(StartVelocity, NeedsAFrame) {
    const std::string text =
        "tier = \"surface3d\"\n[energy]\nk20 = 1.0\n[model]\nkind = \"fluid\"\n[velocity]\ninitial = "
        "\"result\"\n[shape]\n"
        "kind = \"sphere\"\nradius = 1.0\n[time]\nend = 1.0\n";
    EXPECT_CONTAINS(message_of<CaseError>([&] { parse_case(text, {}, "case.toml"); }),
                    "must not be \"result\": only valid with shape.kind = \"result\"");
}

}  // namespace tubule::starts_test
