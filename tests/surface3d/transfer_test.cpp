// From one mesh of a surface to another one: positions, nodal values and energy.
#include "surface3d/meshing/transfer.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/shapes/ellipsoid.hpp"
#include "common/shapes/tube.hpp"
#include "common/solve/sparse.hpp"
#include "surface3d/curvature/bending_force.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/motion/motion_fields.hpp"
#include "tests/surface3d/errors.hpp"

namespace tubule::surface3d::transfer_test {

using Eigen::Vector3d;

const Ellipsoid ellipsoid{1, 0.8, 0.6};

// A smooth motion of space.
Vector3d moved(const Vector3d& x) {
    return x + 0.2 * Vector3d(std::sin(2 * x.y()), std::cos(x.z()), x.x() * x.y());
}
template <class Motion>
CurvedMesh with_motion(CurvedMesh mesh, const Motion& motion) {
    for (Vector3d& x : mesh.nodes) x = motion(x);
    return mesh;
}

double energy_of(const CurvedMesh& mesh) {
    const SurfaceSpace space(mesh);
    const MotionFields f = motion_fields(space, mesh, Projection(space, mesh));
    return observe(space, mesh, {f.normal, {}, f.H, f.K}, {.k = {1, 0, 0.1}, .H0 = 0}).energy;
}

// From 20 n^2 triangles to 20 m^2 of a moved ellipsoid: errors of positions and of the values of a field, root mean
// squares; the jump of the energy.
struct Missed {
    double position = 0, value = 0, energy = 0;
};
Missed missed(int n, int m, int order) {
    const CurvedMesh from = mapped_mesh(icosphere(n), order, map_of(ellipsoid)),
                     to = mapped_mesh(icosphere(m), order, map_of(ellipsoid)), now = with_motion(from, moved);
    const auto field = [](const Vector3d& x) { return std::sin(x.x() + 2 * x.y()); };
    Eigen::MatrixXd nodal(1, from.size());
    for (int i = 0; i < from.size(); ++i) nodal(0, i) = field(from.nodes[i]);
    const std::vector<MeshPoint> places = places_of_nodes(to, from);
    const CurvedMesh out = moved_to(places, now, to);
    const Eigen::MatrixXd values = values_at(places, now, nodal);
    Missed miss;
    for (int i = 0; i < to.size(); ++i) {
        miss.position += (out.nodes[i] - moved(to.nodes[i])).squaredNorm() / to.size();
        miss.value += std::pow(values(0, i) - field(to.nodes[i]), 2) / to.size();
    }
    miss.position = std::sqrt(miss.position), miss.value = std::sqrt(miss.value);
    miss.energy = std::abs(energy_of(out) - energy_of(now));
    return miss;
}

TEST(Transfer, HasTheOrderOfInterpolationAndTheEnergyAnOrderAboveThree) {
    // P_k interpolates with an error of order k + 1; of the jump of the energy: docs/verification.md.
    for (const int order : {2, 3, 4}) {
        SCOPED_TRACE(order);
        const Missed coarse = missed(6, 4, order), fine = missed(12, 8, order);
        EXPECT_LT(fine.position, coarse.position * std::pow(0.5, order + 0.5));
        EXPECT_LT(fine.value, coarse.value * std::pow(0.5, order + 0.5));
        if (order < 3) continue;
        EXPECT_LT(fine.energy, coarse.energy / 8);
        if (order < 4) continue;
        EXPECT_LT(coarse.energy, 1e-3 * energy_of(mapped_mesh(icosphere(4), 4, map_of(ellipsoid))));
    }
}

TEST(Transfer, ToTheSameMeshChangesNothing) {
    const CurvedMesh mesh = mapped_mesh(icosphere(2), 3, map_of(ellipsoid)), now = with_motion(mesh, moved);
    const CurvedMesh out = moved_to(places_of_nodes(mesh, mesh), now, mesh);
    for (int i = 0; i < mesh.size(); ++i) EXPECT_LT((out.nodes[i] - now.nodes[i]).norm(), 1e-12);
}

TEST(Transfer, OfATubeThatHasBeenStretched) {
    // Nodes of one mesh lie in other periods than the nearest points of the other, and periods have become longer.
    const Tube tube{.radius = 0.5, .length = 2, .modes = {{0.1, 1, 0, 0}}};
    const auto mesh_of = [&](int n) {
        return mapped_mesh(tube_rings(tube.radius, tube.length, n, n + 2), 4, map_of(tube));
    };
    const auto stretched = [](const Vector3d& x) {
        return Vector3d(x.x(), x.y(), 1.5 * x.z() + 0.3 * std::sin(pi * x.z()) + 1.9);
    };
    const CurvedMesh from = mesh_of(12), to = mesh_of(8);
    CurvedMesh now = with_motion(from, stretched);
    now.period = 3;
    const CurvedMesh out = moved_to(places_of_nodes(to, from), now, to);
    EXPECT_EQ(out.period, 3);
    for (int cell = 0; cell < to.triangles(); ++cell)
        for (int a = 0; a < to.nodes_per_cell(); ++a)
            EXPECT_LT((out.position(cell, a) - stretched(to.position(cell, a))).norm(), 1e-4);
}

TEST(Transfer, NeedsMeshesOfOneSurface) {
    const CurvedMesh mesh = mapped_mesh(icosphere(2), 2, map_of(ellipsoid));
    EXPECT_THROW(places_of_nodes(mesh, with_motion(mesh, [](const Vector3d& x) { return Vector3d(3 * x); })),
                 SolveError);
    CurvedMesh reversed = mesh;  // the nearest points that face the same way are on the other side
    for (Vector3d& x : reversed.nodes) x = -x;
    EXPECT_THROW(places_of_nodes(mesh, reversed), SolveError);
}

}  // namespace tubule::surface3d::transfer_test
