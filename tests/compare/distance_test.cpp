// Distances of curved surfaces, where they are known in closed form or by other means.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "common/shapes/ellipsoid.hpp"
#include "common/shapes/sphere.hpp"
#include "common/shapes/torus.hpp"
#include "common/shapes/tube.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/mesh/reference_triangle.hpp"
#include "tests/support/message_of.hpp"
#include "tools/compare/alignment.hpp"
#include "tools/compare/surfaces.hpp"

namespace tubule::compare::distance_test {

using Eigen::Vector3d;
using surface3d::CurvedMesh;
using surface3d::icosphere;
using surface3d::jittered;
using surface3d::mapped_mesh;
using surface3d::torus_grid;
using surface3d::tube_rings;

TriangleSurface surface(const CurvedMesh& mesh) {
    return TriangleSurface(mesh);
}
template <class Shape>
TriangleSurface surface(const surface3d::TriangleMesh& base, int order, const Shape& shape) {
    return surface(mapped_mesh(base, order, [&](const Vector3d& p) { return Vector3d(position(shape, p)); }));
}

CurvedMesh moved(CurvedMesh mesh, const RigidMotion& motion) {
    for (Vector3d& x : mesh.nodes) x = motion(x);
    return mesh;
}

// x^2/a^2 + y^2/a^2 + z^2/c^2 = 1 from points of its profile. They lie within 1e-9 of it: profile_curve_test.
RevolutionSurface spheroid(double a, double c, double height = 0, int points = 241) {
    std::vector<double> r, z;
    for (int i = 0; i < points; ++i) {
        const double angle = pi * i / (points - 1);
        r.push_back(i == 0 || i == points - 1 ? 0 : a * std::sin(angle));
        z.push_back(height - c * std::cos(angle));
    }
    return RevolutionSurface(curve_through(r, z, 0));
}

// r = 1 + amplitude cos(2 pi (z - shift)/length), as points of a profile.
RevolutionSurface wave(double amplitude, double length, double shift = 0) {
    std::vector<double> r, z;
    for (int i = 0; i <= 240; ++i) {
        z.push_back(length * i / 240);
        r.push_back(1 + amplitude * std::cos(2 * pi * (i / 240.0 - shift / length)));
    }
    r.back() = r.front();
    return RevolutionSurface(curve_through(r, z, length));
}

// A cubic spline through nothing in particular: B-splines sum up to one, so equal coefficients are a cylinder.
PerturbedCurve spline(double length, const std::vector<double>& values) {
    const int n = static_cast<int>(values.size());
    std::vector<double> knots, coefficients = values;
    coefficients.insert(coefficients.end(), values.begin(), values.begin() + 3);
    for (int i = 0; i < n + 7; ++i) knots.push_back(length * (i - 3) / n);
    return spline_curve(3, length, knots, coefficients);
}

RigidMotion some_motion(double angle) {
    return {Eigen::AngleAxisd(angle, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix(), Vector3d(0.1, -0.3, 0.2)};
}

// ---- nearest points

TEST(NearestPoint, OfFlatFacesEdgesAndCorners) {
    // The triangle (0,0,0), (1,0,0), (0,1,0) in every order: what is nearest is plain geometry.
    for (int order = 1; order <= 4; ++order) {
        SCOPED_TRACE(order);
        CurvedMesh mesh{order, {}, {}, 0, {}};
        for (const auto& [i, j, l] : surface3d::lattice(order)) {
            mesh.cells.push_back(mesh.size());
            mesh.nodes.emplace_back(double(j) / order, double(l) / order, 0);
        }
        const TriangleSurface triangle(mesh);
        struct Expected {
            Vector3d from, nearest;
        };
        for (const auto& [from, nearest] : {Expected{{0.3, 0.2, 0.5}, {0.3, 0.2, 0}},  // inside
                                            Expected{{0.4, -2, 1}, {0.4, 0, 0}},       // edges
                                            Expected{{1, 1, 0}, {0.5, 0.5, 0}}, Expected{{-3, 0.9, -1}, {0, 0.9, 0}},
                                            Expected{{-1, -1, 0}, {0, 0, 0}},  // corners
                                            Expected{{3, 0.5, 1}, {1, 0, 0}}, Expected{{-0.5, 4, 0}, {0, 1, 0}}}) {
            const Foot foot = triangle.foot(from);
            EXPECT_LT((foot.point - nearest).norm(), 1e-14);
            EXPECT_NEAR(foot.distance, (from - nearest).norm(), 1e-14);
        }
    }
}

TEST(NearestPoint, IsNearerThanAnySample) {
    // A torus of few, strongly curved triangles, and points all around: the foot is where it says, and no point of a
    // fine sampling is nearer. The mesh is its own reference.
    const TriangleSurface torus = surface(torus_grid({1, 0.4}, 8, 4), 3, Torus{1, 0.4});
    std::vector<Vector3d> fine;
    constexpr int parts = 30;
    for (int cell = 0; cell < 64; ++cell)
        for (int i = 0; i <= parts; ++i)
            for (int j = 0; j <= parts - i; ++j)
                fine.push_back(torus.at({cell, {double(i) / parts, double(j) / parts}}));
    std::mt19937 random(1);
    std::uniform_real_distribution<double> in(-1.8, 1.8);
    for (int i = 0; i < 300; ++i) {
        const Vector3d x(in(random), in(random), in(random) / 2);
        const Foot foot = torus.foot(x);
        EXPECT_NEAR((x - foot.point).norm(), foot.distance, 1e-14);
        double least = 10;
        for (const Vector3d& y : fine) least = std::min(least, (x - y).norm());
        EXPECT_LE(foot.distance, least + 1e-12) << x.transpose();
        double off = 10;  // of the foot from the surface; the samples are that close together
        for (const Vector3d& y : fine) off = std::min(off, (foot.point - y).norm());
        EXPECT_LT(off, 0.03) << x.transpose();
    }
}

TEST(NearestPoint, OfProfilesIsThatOfTheSpheroid) {
    // On the normal of x(angle) at distance d, inside the evolute: the nearest point is x.
    const RevolutionSurface surface = spheroid(1, 0.6);
    for (int i = 0; i <= 20; ++i)
        for (const double d : {-0.2, 1e-7, 0.5}) {
            const double angle = pi * i / 20, theta = 0.7 * i;
            const Eigen::Vector2d x(std::sin(angle), -0.6 * std::cos(angle)),
                n = Eigen::Vector2d(0.6 * std::sin(angle), -std::cos(angle)).normalized(), at = x + d * n;
            const Foot foot = surface.foot({at[0] * std::cos(theta), at[0] * std::sin(theta), at[1]});
            EXPECT_NEAR(foot.distance, std::abs(d), 1e-8);
            EXPECT_LT((foot.point - Vector3d(x[0] * std::cos(theta), x[0] * std::sin(theta), x[1])).norm(), 1e-6);
        }
}

TEST(NearestPoint, SeesTheImagesOfATube) {
    const Tube shape{.radius = 0.5, .length = 2, .modes = {{0.1, 1, 0, 0.3}}};
    const TriangleSurface tube = surface(tube_rings(0.5, 2, 8, 12), 3, shape);
    const Vector3d x(0.7, 0.1, 0.3);
    const Foot here = tube.foot(x);
    for (const int periods : {-3, -1, 1, 20}) {
        const Vector3d away(0, 0, 2 * periods);
        EXPECT_NEAR(tube.foot(x + away).distance, here.distance, 1e-13);
        EXPECT_LT((tube.foot(x + away).point - here.point - away).norm(), 1e-7);
    }
}

// ---- distances in closed form

TEST(Distance, OfConcentricSpheres) {
    const Distance d = distance(spheroid(1, 1), spheroid(1.1, 1.1));
    EXPECT_NEAR(d.hausdorff, 0.1, 1e-9);
    EXPECT_NEAR(d.l2, 0.1, 1e-9);
    EXPECT_NEAR(d.size, 1, 1e-8);
    // Triangles of order 4 on an icosahedron's edges in 3: the mesh is off by 5e-6, as the test of the order below
    // finds.
    const TriangleSurface mesh = surface(icosphere(3), 4, Sphere{1.1, {}});
    for (const Distance& e : {distance(spheroid(1, 1), mesh), distance(mesh, spheroid(1, 1))}) {
        EXPECT_NEAR(e.hausdorff, 0.1, 1e-5);
        EXPECT_NEAR(e.l2, 0.1, 5e-6);
    }
}

TEST(Distance, OfTubes) {
    const RevolutionSurface one(spline(2, std::vector<double>(8, 1.0))), other(spline(2, std::vector<double>(5, 1.2)));
    const Distance d = distance(one, other);
    EXPECT_NEAR(d.hausdorff, 0.2, 1e-14);
    EXPECT_NEAR(d.l2, 0.2, 1e-14);
    EXPECT_NEAR(d.size, 1, 1e-13);
    // A wave is nowhere farther than its amplitude from its cylinder, and that far at its crests.
    EXPECT_NEAR(distance(wave(0.1, 2), one).hausdorff, 0.1, 1e-8);
    EXPECT_NEAR(distance(one, wave(0.1, 2, 0.3)).hausdorff, 0.1, 1e-8);
}

TEST(Distance, OfSphereAndSpheroid) {
    // Farthest at the poles of the longer one. L2: an independent computation (400 Gauss points on each meridian,
    // nearest points by Newton's method from closed forms, checked against 2001 points each).
    constexpr double l2 = 0.12457301632316;
    const Distance d = distance(spheroid(1, 1), spheroid(1, 1.3));
    EXPECT_NEAR(d.hausdorff, 0.3, 1e-8);
    EXPECT_NEAR(d.l2, l2, 1e-8);
    const TriangleSurface mesh = surface(jittered(icosphere(4), 0.2, 1), 3, Ellipsoid{1, 1, 1.3});
    const Distance e = distance(spheroid(1, 1), mesh);
    EXPECT_NEAR(e.hausdorff, 0.3, 2e-4);
    EXPECT_NEAR(e.l2, l2, 2e-5);
}

// ---- the same surface in two ways

struct Rates {
    double hausdorff, l2;
};
Rates rates(const Distance& coarse, const Distance& fine) {
    return {std::log2(coarse.hausdorff / fine.hausdorff), std::log2(coarse.l2 / fine.l2)};
}

TEST(Distance, FallsAtTheOrderOfTheElements) {
    // Interpolation by P_k is off by order k + 1 at least; along the normal of a sphere, even orders by one more.
    const RevolutionSurface exact = spheroid(1, 1);
    const double largest[] = {0, 0, 2e-4, 1e-4, 1.5e-6}, order[] = {0, 0, 4, 4, 6};
    for (int k = 2; k <= 4; ++k) {
        SCOPED_TRACE(k);
        const Distance coarse = distance(exact, surface(icosphere(2), k, Sphere{})),
                       fine = distance(exact, surface(icosphere(4), k, Sphere{}));
        EXPECT_LT(fine.hausdorff, largest[k]);
        EXPECT_LT(fine.l2, fine.hausdorff);
        EXPECT_GT(rates(coarse, fine).hausdorff, order[k] - 0.3);
        EXPECT_GT(rates(coarse, fine).l2, order[k] - 0.2);
    }
}

TEST(Distance, OfTwoMeshesOfOneSurfaceFalls) {
    const Ellipsoid shape{1, 0.8, 1.2};
    const auto apart = [&](int n) {
        return distance(surface(icosphere(n), 3, shape), surface(jittered(icosphere(n + 1), 0.2, 1), 3, shape));
    };
    const Distance coarse = apart(3), fine = apart(6);
    EXPECT_LT(fine.l2, 1e-5);
    EXPECT_GT(rates(coarse, fine).l2, 3.5);  // order 4; the irregular ones are not similar
    EXPECT_GT(rates(coarse, fine).hausdorff, 3);
}

TEST(Distance, OfAProfileFromItsMeshFalls) {
    const PerturbedCurve profile = spline(2, {1, 1.1, 1.2, 1.15, 1, 0.9, 0.85, 0.92});
    const RevolutionSurface exact(profile);
    const auto apart = [&](int n) {
        return distance(exact, surface(mapped_mesh(tube_rings(1, 2, n, 2 * n), 3, [&](const auto& p) {
                            return Vector3d(position(profile, Torus{}, p));
                        })));
    };
    // A cubic spline has jumps of its third derivative at multiples of 1/4, where rings of 8 and 16 have nodes.
    const Distance coarse = apart(8), fine = apart(16);
    EXPECT_LT(fine.hausdorff, 1e-4);
    EXPECT_GT(rates(coarse, fine).l2, 3.7);
    EXPECT_GT(rates(coarse, fine).hausdorff, 3.5);
}

// ---- alignment

// Before and after.
void expect_left(const Surface& a, const Surface& b, double before, double most) {
    EXPECT_GT(distance(a, b).hausdorff, before);
    const RigidMotion motion = alignment(a, b);
    const Distance left = distance(a, b, motion);
    EXPECT_LT(left.hausdorff, most);
    EXPECT_LT((motion.rotation * motion.rotation.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
}

// What is left is rounding.
void expect_none_left(const Surface& a, const Surface& b, double before) {
    expect_left(a, b, before, 1e-8);
}

TEST(Alignment, FindsMovedCopies) {
    const auto on = [](const auto& shape) {
        return [shape](const Vector3d& p) { return Vector3d(position(shape, p)); };
    };
    const CurvedMesh ellipsoid = mapped_mesh(icosphere(2), 3, on(Ellipsoid{1, 0.8, 1.3})),
                     threefold = mapped_mesh(icosphere(4), 2, on(Sphere{.radius = 1, .modes = {{0.3, 3, 3}}})),
                     torus = mapped_mesh(torus_grid({1, 0.4}, 16, 8), 3, on(Torus{1, 0.4}));
    const double angle = 3;
    expect_none_left(surface(ellipsoid), surface(moved(ellipsoid, some_motion(angle))), 0.1);
    expect_none_left(surface(threefold), surface(moved(threefold, some_motion(angle))), 0.1);
    // Only the triangles, which are off by up to 1e-3, tell one turn of it from another.
    expect_left(surface(torus), surface(moved(torus, some_motion(angle))), 0.1, 2e-3);
}

TEST(Alignment, SlidesAndTurnsTubes) {
    const Tube shape{.radius = 1, .length = 2, .modes = {{0.1, 1, 2, 0.3}, {0.05, 2, 0, 0}}};
    const CurvedMesh tube =
        mapped_mesh(tube_rings(1, 2, 6, 14), 3, [&](const auto& p) { return Vector3d(position(shape, p)); });
    for (const double slide : {0.2, -3.3})
        expect_none_left(surface(tube),
                         surface(moved(tube, {Eigen::AngleAxisd(2 * slide, Vector3d::UnitZ()).toRotationMatrix(),
                                              Vector3d(0.1, -0.05, slide)})),
                         0.05);
    expect_none_left(wave(0.1, 2), wave(0.1, 2, 0.83), 0.05);
}

TEST(Alignment, OfClosedProfilesKeepsTheAxis) {
    expect_none_left(spheroid(1, 0.6), spheroid(1, 0.6, 0.7), 0.1);
    const RigidMotion motion = alignment(spheroid(1, 0.6), spheroid(1, 0.6, 0.7));
    EXPECT_LT((motion(Vector3d(0, 0, 0.7))).norm(), 1e-7);
}

TEST(Alignment, OfTheOtherTierLeavesTheErrorOfTheMesh) {
    // A mesh somewhere against the profile: what is left is the error of the mesh.
    const CurvedMesh mesh = mapped_mesh(icosphere(4), 3, [](const auto& p) {
        return Vector3d(position(Ellipsoid{1, 1, 0.6}, p));
    });
    const RevolutionSurface profile = spheroid(1, 0.6);
    const double still = distance(profile, surface(mesh)).l2;
    const TriangleSurface away = surface(moved(mesh, some_motion(1.2)));
    EXPECT_NEAR(distance(profile, away, alignment(profile, away)).l2, still, 0.01 * still);
    EXPECT_NEAR(distance(away, profile, alignment(away, profile)).l2, still, 0.01 * still);
}

TEST(Distance, RefusesWhatCannotBeCompared) {
    const auto message = [](const Surface& a, const Surface& b) {
        return test::message_of<std::invalid_argument>([&] { distance(a, b); });
    };
    EXPECT_EQ(message(wave(0.1, 2), spheroid(1, 1)), "one is a tube of period 2.000000, the other is a closed surface");
    EXPECT_EQ(message(wave(0.1, 2), wave(0.1, 3)),
              "one is a tube of period 2.000000, the other is a tube of period 3.000000");
}

}  // namespace tubule::compare::distance_test
