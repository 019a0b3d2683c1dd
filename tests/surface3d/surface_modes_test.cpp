// Amplitudes of waves on curved meshes of surfaces that are given by their waves.
#include "surface3d/curvature/surface_modes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "common/geometry/profile_point.hpp"
#include "common/shapes/sphere.hpp"
#include "common/shapes/tube.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/run/mesh_record.hpp"

namespace tubule::surface3d::surface_modes_test {

template <class Shape>
CurvedMesh surface(const TriangleMesh& base, const Shape& shape, int order = 3) {
    return mapped_mesh(base, order, [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(position(shape, p)); });
}

TEST(SurfaceModes, ofATube) {
    // Exact, up to the interpolation by this mesh: the amplitudes that the shape was given, whatever their phase; waves
    // that turn both ways count together.
    const Tube tube{
        0.8, 2, {{0.03, 1, 0, 0.4}, {0.02, 2, 1, 1.1}, {0.01, 1, 2, 0.2}, {0.015, 1, -2, 2}, {0.025, 0, 3, 1}}};
    const CurvedMesh mesh = surface(jittered(tube_rings(0.8, 2, 16, 20), 0.2, 1), tube);
    EXPECT_NEAR(tube_mode_amplitude(mesh, 0, 0), 0.8, 1e-5);
    EXPECT_NEAR(tube_mode_amplitude(mesh, 1, 0), 0.03, 1e-5);
    EXPECT_NEAR(tube_mode_amplitude(mesh, 2, 1), 0.02, 1e-5);
    EXPECT_NEAR(tube_mode_amplitude(mesh, 1, 2), std::hypot(0.01, 0.015), 1e-5);
    EXPECT_NEAR(tube_mode_amplitude(mesh, 0, 3), 0.025, 1e-5);
    EXPECT_NEAR(tube_mode_amplitude(mesh, 3, 1), 0, 1e-5);
    EXPECT_THROW(tube_mode_amplitude(surface(icosphere(2), Sphere{}), 1, 0), std::invalid_argument);
}

TEST(SurfaceModes, convergeWithTheGeometry) {
    // Theorem: interpolation of order k errs by h^(k+1).
    const Tube tube{0.8, 2, {{0.1, 1, 2, 0.4}}};
    for (const int order : {2, 3, 4}) {
        double error[2];
        for (int i = 0; i < 2; ++i)
            error[i] = std::abs(
                tube_mode_amplitude(surface(jittered(tube_rings(0.8, 2, 8 << i, 10 << i), 0.2, 1), tube, order), 1, 2) -
                0.1);
        EXPECT_GT(std::log2(error[0] / error[1]), order + 0.5) << error[0] << " " << error[1];
        EXPECT_LT(error[1], order == 2 ? 5e-5 : 1e-5);
    }
}

TEST(SurfaceModes, ofASphere) {
    // Exact, as above; Y_l^m of l > 0 have no mean. A shift by d is seen only as its square.
    const Sphere sphere{1.3, {{0.02, 3, 0}, {0.01, 4, 2}}};
    CurvedMesh mesh = surface(icosphere(6), sphere);
    const double shift = 1e-3;
    for (const double moved : {0.0, shift}) {
        for (Eigen::Vector3d& x : mesh.nodes) x += Eigen::Vector3d(moved, 0, 2 * moved);
        EXPECT_NEAR(sphere_mode_amplitude(mesh, 0, 0), 1.3, 1e-5 + 3 * moved * moved);
        // The middle of the area is off by the product of the two waves: 1e-4.
        EXPECT_NEAR(sphere_mode_amplitude(mesh, 3, 0), 0.02, 2e-5);
        EXPECT_NEAR(sphere_mode_amplitude(mesh, 4, 2), 0.01, 2e-5);
        EXPECT_NEAR(sphere_mode_amplitude(mesh, 5, 1), 0, 2e-5);
    }
    // Turned about z by any angle.
    for (Eigen::Vector3d& x : mesh.nodes) x = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()) * x;
    EXPECT_NEAR(sphere_mode_amplitude(mesh, 4, 2), 0.01, 2e-5);
    EXPECT_THROW(sphere_mode_amplitude(mesh, 1, 0), std::invalid_argument);
    EXPECT_THROW(sphere_mode_amplitude(mesh, 3, 4), std::invalid_argument);
}

TEST(SurfaceModes, ofAFrame) {
    const Tube tube{0.8, 2, {{0.1, 1, 0, 0.4}}};
    const CurvedMesh mesh = surface(tube_rings(0.8, 2, 8, 10), tube);
    const SurfaceCells cells{mesh.order, mesh.nodes.size(), mesh.cells, mesh.period, mesh.shifts};
    Record frame;
    EXPECT_THROW(frame_surface(frame, cells), std::invalid_argument);
    Array points{"points", {mesh.nodes.size(), 3}, {}};
    for (const Eigen::Vector3d& x : mesh.nodes) points.data.insert(points.data.end(), x.begin(), x.end());
    frame.arrays = {points};
    EXPECT_EQ(tube_mode_amplitude(frame_surface(frame, cells), 1, 0), tube_mode_amplitude(mesh, 1, 0));
}

}  // namespace tubule::surface3d::surface_modes_test
