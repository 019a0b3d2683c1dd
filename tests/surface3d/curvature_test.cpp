// Recovered curvatures: orders, the energies of the paper's cell, and what must not change them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "common/shapes/ellipsoid.hpp"
#include "common/shapes/tube.hpp"
#include "surface3d/curvature/bending_force.hpp"
#include "surface3d/curvature/exact_curvature.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "tests/surface3d/errors.hpp"

namespace tubule::surface3d::curvature_test {

const Bending all_terms{.k = {1, 1, 1}, .H0 = -0.3};

FieldErrors errors_of(int order, int n, Recovery recovery, bool structured = true) {
    const auto map = map_of(Ellipsoid{1, 1.2, 1.5});
    const TriangleMesh base = structured ? icosphere(n) : jittered(icosphere(n), 0.25, 1);
    const CurvedMesh mesh = mapped_mesh(base, order, map);
    const SurfaceSpace space(mesh);
    return field_errors(base, mesh, recover(space, mesh, recovery), map);
}

double order_of(const FieldErrors& coarse, const FieldErrors& fine, double FieldErrors::*which) {
    return std::log2(coarse.*which / fine.*which);
}

TEST(Curvature, DefaultConvergesAtTheOrderOfTheElementsAndOneMore) {
    // Best possible in P_k: k + 1 for H and K, k for their gradients. The paper has 2 and 1 at k = 3.
    for (const bool structured : {true, false})
        for (int k = 2; k <= 4; ++k) {
            SCOPED_TRACE("k = " + std::to_string(k) + (structured ? "" : ", jittered"));
            const auto coarse = errors_of(k, 4, Recovery::patch, structured);
            const auto fine = errors_of(k, 8, Recovery::patch, structured);
            EXPECT_GT(order_of(coarse, fine, &FieldErrors::normal), k + 0.6);
            EXPECT_GT(order_of(coarse, fine, &FieldErrors::H), k + 0.6);
            EXPECT_GT(order_of(coarse, fine, &FieldErrors::K), k + 0.6);
            EXPECT_GT(order_of(coarse, fine, &FieldErrors::grad_H), k - 0.4);
            EXPECT_GT(order_of(coarse, fine, &FieldErrors::grad_K), k - 0.4);
        }
}

TEST(Curvature, ComparedOnesHaveTheirOrders) {
    // Second derivatives of P3 are of order 2; what is averaged from them gains a factor, not an order.
    const auto best = errors_of(3, 8, Recovery::patch);
    for (const Recovery recovery : {Recovery::elementwise, Recovery::normal, Recovery::weak, Recovery::lifted}) {
        SCOPED_TRACE(static_cast<int>(recovery));
        const auto coarse = errors_of(3, 4, recovery), fine = errors_of(3, 8, recovery);
        EXPECT_GT(order_of(coarse, fine, &FieldErrors::K), 1.7);
        EXPECT_LT(order_of(coarse, fine, &FieldErrors::K), 2.7);
        EXPECT_GT(order_of(coarse, fine, &FieldErrors::grad_K), 0.7);
        EXPECT_GT(fine.K, 5 * best.K);
        EXPECT_GT(fine.grad_K, 5 * best.grad_K);
    }
    const auto nodal = errors_of(3, 8, Recovery::patch_nodal);
    EXPECT_LT(nodal.K, 2 * best.K);
}

TEST(Curvature, EnergiesOfThePerturbedSphere) {
    // theory.md (7.10); 5120 triangles of order 3, 1e-5 relative.
    const CurvedMesh mesh = mapped_mesh(icosphere(16), 3, map_of(perturbed_sphere()));
    const SurfaceSpace space(mesh);
    const Observables o = observe(space, mesh, recover(space, mesh), {.k = {1, 0, 1}});
    EXPECT_NEAR(o.energy_term[0] / perturbed_H2, 1, 1e-5);
    EXPECT_NEAR(o.energy_term[2] / perturbed_K2, 1, 1e-5);
    EXPECT_NEAR(o.area / perturbed_area, 1, 2e-6);
    EXPECT_NEAR(o.volume / perturbed_volume, 1, 2e-6);
    EXPECT_NEAR(gauss_bonnet_defect(o, mesh), 0, 1e-3);
    EXPECT_GT(o.integral_H2, willmore_bound);
}

TEST(Curvature, SmoothingDampsEigenfunctionsAsItMust) {
    // On the unit sphere z + 2 becomes z/(1 + 2 eps) + 2. Its gradient is e_z - z n, with components
    // -xz, -yz, 2/3 - (z^2 - 1/3): what is of order 2 becomes 1/(1 + 6 eps) of it.
    const CurvedMesh mesh = mapped_mesh(icosphere(4), 3, map_of(Sphere{}));
    const SurfaceSpace space(mesh);
    CurvatureField field = recover(space, mesh);
    for (int i = 0; i < mesh.size(); ++i) field.H[i] = mesh.nodes[i].z() + 2, field.K[i] = 3;
    const double eps = 0.1;
    const CurvatureGradients gradients = smooth(space, mesh, eps, field);
    for (int i = 0; i < mesh.size(); ++i) {
        const Eigen::Vector3d n = mesh.nodes[i];
        EXPECT_NEAR(field.H[i], n.z() / (1 + 2 * eps) + 2, 1e-4);  // the surface is one of P3
        EXPECT_NEAR(field.K[i], 3, 1e-12);
        Eigen::Vector3d second = -n.z() * n;
        second.z() += 1.0 / 3;
        const Eigen::Vector3d exact = second / (1 + 6 * eps) + 2.0 / 3 * Eigen::Vector3d::UnitZ();
        EXPECT_LT((gradients.H.col(i) - exact).norm(), 1e-3);
        EXPECT_LT(gradients.K.col(i).norm(), 1e-11);
    }
    EXPECT_THROW(smooth(space, mesh, -1e-9, field), std::invalid_argument);
}

TEST(Curvature, ExactNodesAreInterpolated) {
    // Interpolation in P_k: order k + 1 for values, k for gradients. No recovery is far better than it; the default is
    // as good up to a factor.
    const auto map = map_of(Ellipsoid{1, 1.2, 1.5});
    FieldErrors errors[2];
    for (int i : {0, 1}) {
        const TriangleMesh base = icosphere(4 * (i + 1));
        const CurvedMesh mesh = mapped_mesh(base, 3, map);
        errors[i] = field_errors(base, mesh, exact_curvature(mesh, exact_nodes(base, 3, map)), map);
    }
    for (const auto which : {&FieldErrors::normal, &FieldErrors::H, &FieldErrors::K})
        EXPECT_GT(order_of(errors[0], errors[1], which), 3.6);
    EXPECT_GT(order_of(errors[0], errors[1], &FieldErrors::grad_K), 2.6);
    const FieldErrors found = errors_of(3, 8, Recovery::patch);
    EXPECT_LT(found.K, 2 * errors[1].K);
    EXPECT_LT(found.grad_K, 2 * errors[1].grad_K);
}

// Energies, area, volume, integrals; smoothed by eps unless that is 0.
Eigen::VectorXd scalars(const CurvedMesh& mesh, Recovery recovery, double eps = 0) {
    const SurfaceSpace space(mesh);
    CurvatureField field = recover(space, mesh, recovery);
    if (eps > 0) smooth(space, mesh, eps, field);
    const Observables o = observe(space, mesh, field, all_terms);
    Eigen::VectorXd out(7);
    out << o.energy_term[0], o.energy_term[1], o.energy_term[2], o.area, o.volume, o.integral_H2, o.integral_K;
    return out;
}

TEST(Curvature, NeitherRigidMotionNorNumberingMatters) {
    const CurvedMesh mesh = mapped_mesh(jittered(icosphere(4), 0.2, 5), 3, map_of(perturbed_sphere()));

    CurvedMesh moved = mesh;
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.234, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
    for (Eigen::Vector3d& x : moved.nodes) x = turn * x + Eigen::Vector3d(0.3, -0.1, 0.7);

    // Nodes in another order, triangles in another order, each with its corners turned by one.
    CurvedMesh renumbered = mesh;
    std::vector<int> number(mesh.size());
    std::iota(number.begin(), number.end(), 0);
    std::reverse(number.begin(), number.end());
    std::rotate(number.begin(), number.begin() + mesh.size() / 3, number.end());
    for (int i = 0; i < mesh.size(); ++i) renumbered.nodes[number[i]] = mesh.nodes[i];
    const int turned[10] = {1, 2, 0, 5, 6, 7, 8, 3, 4, 9};
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int a = 0; a < 10; ++a)
            renumbered.cells[(mesh.triangles() - 1 - cell) * 10 + a] = number[mesh.node(cell, turned[a])];

    for (const auto& [recovery, eps] : {std::pair{Recovery::elementwise, 0.0},
                                        {Recovery::elementwise, 1e-3},
                                        {Recovery::normal, 0.0},
                                        {Recovery::weak, 0.0},
                                        {Recovery::lifted, 0.0},
                                        {Recovery::patch_nodal, 0.0},
                                        {Recovery::patch, 0.0}}) {
        SCOPED_TRACE(static_cast<int>(recovery));
        const Eigen::VectorXd reference = scalars(mesh, recovery, eps);
        const Eigen::VectorXd after_motion = scalars(moved, recovery, eps);
        const Eigen::VectorXd after_numbering = scalars(renumbered, recovery, eps);
        EXPECT_LT(((after_motion - reference).cwiseQuotient(reference)).cwiseAbs().maxCoeff(), 1e-12);
        EXPECT_LT(((after_numbering - reference).cwiseQuotient(reference)).cwiseAbs().maxCoeff(), 1e-12);
    }
}

TEST(Curvature, ATubeHasNoSeam) {
    // The same surface with its period cut elsewhere.
    const Tube tube{.radius = 0.6, .length = 2, .modes = {{0.1, 1, 1, 0.3}}};
    const TriangleMesh base = tube_rings(0.6, 2, 8, 12);
    TriangleMesh cut = base;
    for (Eigen::Vector3d& p : cut.points)
        if (p.z() < 0.9) p.z() += 2;
    for (std::size_t t = 0; t < cut.triangles.size(); ++t)
        for (int c = 0; c < 3; ++c)
            if (base.points[cut.triangles[t][c]].z() < 0.9) --cut.shifts[t][c];
    for (const Recovery recovery : {Recovery::lifted, Recovery::patch}) {
        const Eigen::VectorXd here = scalars(mapped_mesh(base, 3, map_of(tube)), recovery);
        const Eigen::VectorXd there = scalars(mapped_mesh(cut, 3, map_of(tube)), recovery);
        EXPECT_LT((here - there).cwiseAbs().maxCoeff(), 1e-11);
    }
}

}  // namespace tubule::surface3d::curvature_test
