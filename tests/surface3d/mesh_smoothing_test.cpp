// Smoothing of triangle meshes: waves on a sphere keep what the formula says, spheres and thin tubes stay, noise goes,
// volumes come out; distances of meshes against closed forms.
#include "surface3d/import/mesh_smoothing.hpp"

#include <gtest/gtest.h>

#include "surface3d/import/import_check.hpp"
#include "surface3d/import/mesh_distance.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "tests/surface3d/import_samples.hpp"

namespace tubule::surface3d::mesh_smoothing_test {

using namespace samples;

// The amplitude of P_l(z) in the radii, by integrals over the triangles.
double amplitude(const TriangleMesh& mesh, int l) {
    double product = 0, square = 0;
    for (const auto& t : mesh.triangles) {
        const Vector3d &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
        const double area = (b - a).cross(c - a).norm();
        for (const Vector3d& x : {a, b, c}) {
            const double wave = std::legendre(unsigned(l), x[2] / x.norm());
            product += area * (x.norm() - 1) * wave, square += area * wave * wave;
        }
    }
    return product / square;
}

// A wave of wavelength w keeps 1/(1 + (halved/w)^4) of its height. On the sphere w = 2 pi/sqrt(l (l + 1)), up to
// O(1/l).
TEST(MeshSmoothing, WavesKeepWhatTheFormulaSays) {
    const int l = 9;
    const double w = 2 * std::numbers::pi / std::sqrt(l * (l + 1.0)), height = 1e-3;
    TriangleMesh mesh = geodesic_sphere(24);
    for (Vector3d& x : mesh.points) x *= 1 + height * std::legendre(unsigned(l), x[2]);
    const double before = amplitude(mesh, l);
    EXPECT_NEAR(amplitude(smoothed(mesh, w / 2), l) / before, 16.0 / 17, 0.04);
    EXPECT_NEAR(amplitude(smoothed(mesh, w), l) / before, 1.0 / 2, 0.04);
    EXPECT_NEAR(amplitude(smoothed(mesh, 2 * w), l) / before, 1.0 / 17, 0.04);
}

TEST(MeshSmoothing, SpheresStay) {
    const TriangleMesh sphere = smoothed(geodesic_sphere(16), 1.5);
    double worst = 0;
    for (const Vector3d& x : sphere.points) worst = std::max(worst, std::abs(x.norm() - 1));
    EXPECT_LT(worst, 5e-3);  // the triangles deviate from the sphere by 1e-3
}

// A ring whose circumference, 0.94, is little more than the length. Smoothed positions would shrink it by
// (0.8/0.94)^4/(1 + (0.8/0.94)^4) = 34 percent.
TEST(MeshSmoothing, ThinTubesStay) {
    const Torus ring{1.0, 0.15};
    const TriangleMesh mesh = torus_grid(ring, 200, 30);
    double least = 1, most = 0;
    for (const Vector3d& x : smoothed(mesh, 0.8).points) {
        const double r = std::hypot(std::hypot(x[0], x[1]) - 1, x[2]) / 0.15;
        least = std::min(least, r), most = std::max(most, r);
    }
    EXPECT_GT(least, 0.95);
    EXPECT_LT(most, 1.05);
}

// Vertices displaced by 0.2 mean edges in every direction, normally distributed.
TEST(MeshSmoothing, NoiseGoes) {
    TriangleMesh mesh = geodesic_sphere(22);
    const double edge = even_edge(mesh_area(mesh), double(mesh.triangles.size()));
    std::mt19937 random(3);
    const auto uniform = [&] { return double(random()) / 4294967295.0; };
    for (Vector3d& x : mesh.points)
        for (double& coordinate : x) {
            double sum = -6;
            for (int i = 0; i < 12; ++i) sum += uniform();
            coordinate += 0.2 * edge * sum;
        }
    const auto rms = [](const TriangleMesh& m) {
        double sum = 0, mean = 0;
        for (const Vector3d& x : m.points) mean += x.norm() / double(m.points.size());
        for (const Vector3d& x : m.points) sum += std::pow(x.norm() - mean, 2) / double(m.points.size());
        return std::sqrt(sum);
    };
    EXPECT_NEAR(rms(mesh) / edge, 0.2, 0.01);
    EXPECT_LT(rms(smoothed(mesh, 12 * edge)), rms(mesh) / 5);
}

// Radii with noise as large as an edge: neighbours face away from each other, and no longer do.
TEST(MeshSmoothing, FoldsArePulledOut) {
    TriangleMesh mesh = geodesic_sphere(12);
    const double edge = even_edge(mesh_area(mesh), double(mesh.triangles.size()));
    std::mt19937 random(4);
    for (Vector3d& x : mesh.points) x *= 1 + 2 * edge * (double(random()) / 4294967295.0 - 0.5);
    const auto sharpest = [](const TriangleMesh& m) {
        ImportedMesh closed = imported(m);
        return close_mesh(closed).kink_max;
    };
    EXPECT_GT(sharpest(mesh), 120);
    EXPECT_LT(sharpest(unfolded(mesh, 8 * edge)), 45);
}

TEST(MeshSmoothing, TheVolumeComesOut) {
    const TriangleMesh mesh = irregular({.axes = {1, 0.8, 0.6}}, 8);
    for (const double factor : {0.9, 1.0, 1.1}) {
        const TriangleMesh out = with_volume(mesh, factor * mesh_volume(mesh));
        EXPECT_NEAR(mesh_volume(out) / mesh_volume(mesh), factor, 1e-9);
        // All moved equally far.
        for (std::size_t i = 1; i < out.points.size(); ++i)
            EXPECT_NEAR((out.points[i] - mesh.points[i]).norm(), (out.points[0] - mesh.points[0]).norm(), 1e-12);
    }
}

TEST(MeshSmoothing, MeasuresAreThoseOfAnOctahedron) {
    TriangleMesh mesh;
    mesh.points = {{7, 0, 0}, {5, 0, 0}, {6, 1, 0}, {6, -1, 0}, {6, 0, 1}, {6, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    EXPECT_NEAR(mesh_volume(mesh), 4.0 / 3, 1e-14);
    EXPECT_NEAR(mesh_area(mesh), 4 * std::sqrt(3.0), 1e-14);
    EXPECT_NEAR(even_edge(mesh_area(mesh), 8), std::sqrt(2.0), 1e-14);
}

// One triangle: points above it, beside an edge, before a corner.
TEST(MeshDistances, OfPointsFromATriangle) {
    TriangleMesh mesh;
    mesh.points = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}};
    mesh.triangles = {{0, 1, 2}};
    const MeshDistance distance(mesh);
    EXPECT_DOUBLE_EQ(distance({0.5, 0.5, -3}), 3);
    EXPECT_DOUBLE_EQ(distance({1, -3, 4}), 5);
    EXPECT_DOUBLE_EQ(distance({-1, -2, 2}), 3);
    EXPECT_DOUBLE_EQ(distance({2, 2, 0}), std::sqrt(2.0));
    mesh.triangles = {{1, 2, 2}};  // a segment
    EXPECT_DOUBLE_EQ(MeshDistance(mesh)({0, 0, 0}), std::sqrt(2.0));
    mesh.triangles = {};
    EXPECT_EQ(MeshDistance(mesh)({0, 0, 0}), HUGE_VAL);
}

TEST(MeshDistances, OfConcentricSpheres) {
    const TriangleMesh inner = geodesic_sphere(6);
    TriangleMesh outer = geodesic_sphere(20);
    for (Vector3d& x : outer.points) x *= 1.1;
    double area = 0, most = 0;
    for (const DistanceSample& sample : distances(inner, outer, 0.1)) {
        area += sample.area, most = std::max(most, sample.distance);
        EXPECT_GT(sample.distance, 0.098);
    }
    EXPECT_NEAR(area, mesh_area(inner), 1e-12);
    // The middle of an inner triangle is farthest, 1 - its height above the centre more than 0.1.
    double lowest = 1;
    for (const auto& [a, b, c] : inner.triangles)
        lowest = std::min(lowest, (inner.points[a] + inner.points[b] + inner.points[c]).norm() / 3);
    EXPECT_NEAR(most, 1.1 - lowest, 2e-3);
}

}  // namespace tubule::surface3d::mesh_smoothing_test
