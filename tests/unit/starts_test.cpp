// Starts that a case brings along: profiles from files, radii as formulas, noise.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/shapes/ellipsoid.hpp"
#include "common/shapes/formula_shape.hpp"
#include "common/shapes/profile_file.hpp"
#include "tests/support/message_of.hpp"

namespace tubule {
namespace {

using test::message_of;

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
        const std::string all = message_of<ProfileError>([&] { read_profile(path, how); });
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
    return {.path = "p.csv", .length = length, .tolerance = tolerance};
}

TEST_F(ProfileFiles, ComeAsCloseAsStated) {
    // A spheroid and a tube, known everywhere; the points are exact.
    for (const double tolerance : {1e-3, 1e-6, 1e-8}) {
        const SmoothProfile cell = read_profile(points(120, spheroid), within(tolerance));
        EXPECT_EQ(cell.kind, ProfileCurve::Kind::cell);
        EXPECT_LE(cell.distance, tolerance);
        const SmoothProfile tube =
            read_profile(points(80,
                                [](double t) {
                                    return std::array{1 + 0.3 * std::cos(2 * pi * t), 0.5 + 2 * t};
                                }),
                         within(tolerance, 2));
        EXPECT_EQ(tube.kind, ProfileCurve::Kind::tube);
        const ProfileCurve curve = profile_curve(cell);
        for (int i = 0; i <= 500; ++i) {
            const double s = i / 500.0;
            const auto p = point_at(cell, s), q = point_at(tube, s);
            EXPECT_LT(from_spheroid(p[0], p[2]), 2 * tolerance);
            EXPECT_LT(std::abs(q[0] - 1 - 0.3 * std::cos(pi * (q[2] - 0.5))), 2 * tolerance);
            const auto made = profile_at(curve, s);
            EXPECT_LT(from_spheroid(made[0], made[1]), 3 * tolerance);
        }
    }
}

TEST_F(ProfileFiles, NoiseIsSmoothedAway) {
    // 200 points with noise of .01: the curve is nearer to the spheroid than the points, and by far smoother.
    const SmoothProfile fit = read_profile(points(200, spheroid, 0.01), within(0.05));
    EXPECT_LE(fit.distance, 0.05);
    for (int i = 0; i <= 200; ++i) {
        const auto p = point_at(fit, i / 200.0);
        EXPECT_LT(from_spheroid(p[0], p[2]), 0.03);
    }
    EXPECT_NE(fit.note().find("201 points"), std::string::npos);
}

TEST_F(ProfileFiles, RunEitherWayWithOrWithoutTheLastPoint) {
    const SmoothProfile down = read_profile(points(60, [](double t) { return spheroid(1 - t); }), within(1e-4));
    EXPECT_GT(point_at(down, 0.5)[3], 0);  // upwards on the outside
    const auto wave = [](double t) { return std::array{1 + 0.3 * std::cos(2 * pi * t * 63 / 64), 2 * t * 63 / 64}; };
    EXPECT_LE(read_profile(points(63, wave), within(1e-6, 2)).distance, 1e-6);
    const SmoothProfile ring =
        read_profile(points(60,
                            [](double t) {
                                return std::array{2 + 0.5 * std::cos(2 * pi * t), 0.5 * std::sin(2 * pi * t)};
                            }),
                     within(1e-9));
    EXPECT_EQ(ring.kind, ProfileCurve::Kind::ring);
}

TEST_F(ProfileFiles, AreRefusedWithTheirLine) {
    const std::string half = "0,-1\n.5,-.8\n.8,-.5\n", rest = ".9,.1\n.8,.3\n.7,.6\n.5,.8\n.3,.9\n0,1\n";
    EXPECT_EQ(refusal(half + "x,0\n" + rest), "p.csv:4: 'x' is not a finite number");
    EXPECT_EQ(refusal(half + "1,nan\n" + rest), "p.csv:4: 'nan' is not a finite number");
    EXPECT_EQ(refusal(half + "1,0,2\n" + rest), "p.csv:4: has 3 values where 2 are expected: r, z");
    EXPECT_EQ(refusal("a,b\n" + half + rest), "p.csv:1: a heading must name the columns r and z");
    EXPECT_EQ(refusal(half), "p.csv:3: 3 points are too few: a profile needs 9");
    EXPECT_EQ(refusal(half + "-.1,0\n" + rest), "p.csv:4: r = -0.1: the profile meets the axis");
    EXPECT_EQ(refusal(half + ".8,-.5\n" + rest), "p.csv:4: the same point as before");
    EXPECT_NE(refusal(half + "1,0\n.9,-.9\n" + rest).find("p.csv:6: the profile crosses itself"), std::string::npos);
    EXPECT_NE(refusal(half + rest.substr(0, rest.size() - 4) + ".1,1\n").find("p.csv:9: the profile is not closed"),
              std::string::npos);
    EXPECT_NE(refusal(".5,0\n.5,.1\n.5,.2\n.5,.3\n.5,.4\n.5,.5\n.5,.6\n.5,.7\n.5,.8\n.5,2\n", within(1e-3, 1))
                  .find("p.csv:10: the profile rises by 2, more than shape.length = 1"),
              std::string::npos);
    // One point so far away that squares are no numbers: this crashed.
    for (const double far : {1e97, 1e200}) {
        const auto path = points(120, [&](double t) {
            auto point = spheroid(t);
            if (t > 0.02 && t < 0.03) point[1] *= far;
            return point;
        });
        EXPECT_NE(message_of<ProfileError>([&] { read_profile(path, {}); }).find("smooth curve"), std::string::npos) << far;
    }
    // A corner is no smooth curve.
    std::string cone;
    for (int i = 0; i <= 10; ++i) cone += fmt::format("{},{}\n", 0.1 * std::min(i, 10 - i), 0.1 * i);
    EXPECT_NE(refusal(cone, within(1e-6)).find("set shape.tolerance to that"), std::string::npos);
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
        EXPECT_NE(complaint(which).find(words), std::string::npos) << complaint(which);
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
    EXPECT_NE(message_of<CaseError>([&] { read(tube, "axisym"); }).find("shape.noise.0.m must be 0"),
              std::string::npos);
    const std::string large = "kind = \"tube\"\nradius = 1.0\nlength = 2.0\n[[shape.noise]]\namplitude = 2.0\n";
    EXPECT_NE(message_of<CaseError>([&] { read(large); }).find("must have r0(z) > 0 everywhere"), std::string::npos);
}

TEST(StartVelocity, NeedsAFrame) {
    const std::string text =
        "tier = \"surface3d\"\n[energy]\nk20 = 1.0\n[model]\nkind = \"fluid\"\n[velocity]\ninitial = "
        "\"result\"\n[shape]\n"
        "kind = \"sphere\"\nradius = 1.0\n[time]\nend = 1.0\n";
    EXPECT_NE(message_of<CaseError>([&] {
                  parse_case(text, {}, "case.toml");
              }).find("only shape.kind = \"result\" has a velocity"),
              std::string::npos);
}

}  // namespace
}  // namespace tubule
