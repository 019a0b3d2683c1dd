// The linear system of a step of the moving surface: its force against the energy, the evolution of H and K against
// surfaces that move, its symmetry, and how it is solved.
#include "surface3d/motion/motion_forms.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/shapes/sphere.hpp"
#include "common/shapes/tube.hpp"
#include "common/solve/bordered.hpp"
#include "common/solve/dense.hpp"
#include "common/solve/sparse.hpp"
#include "surface3d/curvature/bending_force.hpp"
#include "surface3d/fem/mesh_quality.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "tests/surface3d/motion.hpp"
#include "tests/surface3d/smooth_field.hpp"

namespace tubule::surface3d::motion_forms_test {

const Sphere wavy{.radius = 1, .modes = {{0.15, 2, 1}, {0.1, 3, 2}}};
const SurfaceLaw gradient_flow = motion_law({});
const SurfaceLaw fluid = motion_law({.kind = ModelKind::fluid, .Re = 2, .gamma = 0.5, .keeps_volume = {}});

// Component by component, as a velocity in MotionUnknowns.
Eigen::VectorXd stacked(const VectorField& v) {
    return Eigen::MatrixXd(v.transpose()).reshaped();
}

// The system of a step te on a surface at rest.
struct AtRest {
    AtRest(const CurvedMesh& on, const SurfaceLaw& law, const Bending& bending, double te)
        : mesh(on), space(mesh), law(law), bending(bending), unknowns(mesh, law, bending) {
        base.mesh = &mesh;
        base.fields = fields_of(mesh);
        base.displacement.setZero(3, mesh.size());
        base.mesh_velocity.setZero(3, mesh.size());
        base.velocity.setZero(law.components() * mesh.size());
        base.past = base.velocity;
        base.te = te;
    }
    const StepSystem& assembled() {
        assemble(space, unknowns, law, bending, base, system);
        return system;
    }
    // The rows and columns of two fields, by their first numbers and sizes.
    Eigen::MatrixXd block(int row, int rows, int column, int columns) const {
        return Eigen::MatrixXd(system.A.block(row, column, rows, columns));
    }

    CurvedMesh mesh;
    SurfaceSpace space;
    SurfaceLaw law;
    Bending bending;
    MotionUnknowns unknowns;
    StepBase base;
    StepSystem system;
};

// Every term alone, so that no error hides behind a larger one; and all of them.
const std::vector<Bending> energies{{.k = {1, 0, 0}, .H0 = -0.5},
                                    {.k = {0, 1, 0}, .H0 = -0.5},
                                    {.k = {0, 0, 1}, .H0 = 0},
                                    {.k = {1, 0.1, 1}, .H0 = -0.5}};

// The rate of fall between two meshes, and what is left on the finer one.
struct Fall {
    double rate = 0, left = 0;
};

template <class Gap>  // of a mesh
Fall fall_of(int order, const Gap& gap) {
    const int coarse = 2, fine = 4;
    const double a = gap(mesh_of(wavy, icosphere(coarse), order)), b = gap(mesh_of(wavy, icosphere(fine), order));
    return {std::log(a / b) / std::log(static_cast<double>(fine) / coarse), b};
}

TEST(MotionForce, ApproachesTheRateOfTheDiscreteEnergy) {
    // theory.md (2.9): (b, v) = -dE[v], up to the error of the fields; E is INT f(H, K) with the fields that the force
    // is made of. An error in any part of the form would stay with refinement.
    for (const Bending& bending : energies) {
        const Fall fall = fall_of(4, [&](const CurvedMesh& mesh) {
            const VectorField v = smooth_at(mesh);
            const double rate = rate_of(mesh, v, [&](const CurvedMesh& m) { return observed(m, bending).energy; });
            AtRest rest(mesh, fluid, bending, 1);
            const double force = rest.assembled().force.head(3 * mesh.size()).dot(stacked(v));
            // What moves along the normal alone has the normal components of the same force.
            AtRest normal(mesh, gradient_flow, bending, 1);
            const Eigen::VectorXd along = v.cwiseProduct(rest.base.fields.normal).colwise().sum().transpose();
            EXPECT_NEAR(normal.assembled().force.head(mesh.size()).dot(along), force, 0.02 * std::abs(force));
            return std::abs(force + rate) / std::abs(rate);
        });
        EXPECT_GT(fall.rate, 3);
        EXPECT_LT(fall.left, 1e-4);
    }
}

TEST(MotionForce, OtherOrders) {
    for (const auto& [order, least, most] : {std::tuple{2, 1.5, 0.05}, {3, 2.0, 5e-3}}) {
        const Fall fall = fall_of(order, [&](const CurvedMesh& mesh) {
            const VectorField v = smooth_at(mesh);
            const double rate =
                rate_of(mesh, v, [&](const CurvedMesh& m) { return observed(m, energies.back()).energy; });
            AtRest rest(mesh, fluid, energies.back(), 1);
            return std::abs(rest.assembled().force.head(3 * mesh.size()).dot(stacked(v)) + rate) / std::abs(rate);
        });
        EXPECT_GT(fall.rate, least) << order;
        EXPECT_LT(fall.left, most) << order;
    }
}

TEST(MotionForce, IsTheNegativeResidualOfTheStepAtRest) {
    // With H and K those of the surface, the momentum rows leave b: A x - b = -(b, v) for x = (0, H*, K*).
    AtRest rest(mesh_of(wavy, icosphere(2), 3), fluid, energies.back(), 0.1);
    rest.assembled();
    const int n = rest.mesh.size();
    Eigen::VectorXd x = Eigen::VectorXd::Zero(rest.unknowns.size());
    x.segment(rest.unknowns.H, n) = rest.base.fields.H;
    x.segment(rest.unknowns.K, n) = rest.base.fields.K;
    const Eigen::VectorXd left = (rest.system.A * x - rest.system.b).head(3 * n);
    EXPECT_LT((left + rest.system.force.head(3 * n)).norm(), 1e-12 * left.norm());
}

TEST(CurvatureEvolution, IsThatOfASurfaceThatMoves) {
    // theory.md (2.4), (2.5): dH = Lap w + |B|^2 w, dK = div((HP-B) grad w) + H K w for a displacement w nu: tested
    // with a smooth function against differences of the fields of displaced surfaces.
    const double te = 0.3;
    for (const SurfaceLaw& law : {gradient_flow, fluid}) {
        double H_rate = 0, K_rate = 0, of_H = 0, of_K = 0;
        for (const bool K : {false, true}) {
            const Fall fall = fall_of(4, [&](const CurvedMesh& mesh) {
                AtRest rest(mesh, law, energies.back(), te);
                rest.assembled();
                const int n = mesh.size(), nv = law.components() * n, rows = K ? rest.unknowns.K : rest.unknowns.H;
                const MotionFields& f = rest.base.fields;
                Eigen::VectorXd w(n), test(n);
                for (int i = 0; i < n; ++i) {
                    w[i] = smooth(mesh.nodes[i])[0];
                    test[i] = smooth(mesh.nodes[i])[1];
                }
                const VectorField v = f.normal * w.asDiagonal();
                const Eigen::VectorXd u = law.flows ? stacked(v) : w;
                const Eigen::VectorXd rate = rate_of(mesh, v, [&](const CurvedMesh& m) {
                    const MotionFields at = fields_of(m);
                    return K ? at.K : at.H;
                });
                const double exact = test.dot(mass_matrix(rest.space, mesh) * rate);
                const Eigen::VectorXd Au = rest.system.A.block(rows, 0, n, nv) * u;
                return std::abs(test.dot(Au) / te + exact) / std::abs(exact);
            });
            (K ? K_rate : H_rate) = fall.rate;
            (K ? of_K : of_H) = fall.left;
        }
        EXPECT_GT(H_rate, 3);
        EXPECT_LT(of_H, 1e-4);
        EXPECT_GT(K_rate, 3);
        EXPECT_LT(of_K, 1e-4);
    }
}

TEST(CurvatureEvolution, FollowsTheDisplacementThatIsExpected) {
    // Where u = w*: H at the end is H* whatever the displacement was, for then X = X*.
    AtRest rest(mesh_of(wavy, icosphere(2), 3), fluid, energies.back(), 0.1);
    const int n = rest.mesh.size();
    rest.base.displacement = 0.1 * smooth_at(rest.mesh);
    rest.base.mesh_velocity = smooth_at(rest.mesh);
    rest.base.velocity.setZero();
    rest.base.curvature_stabilisation = 0.3;
    rest.assembled();
    Eigen::VectorXd x = Eigen::VectorXd::Zero(rest.unknowns.size());
    x.segment(rest.unknowns.H, n) = rest.base.fields.H;
    x.segment(rest.unknowns.K, n) = rest.base.fields.K;
    const Eigen::VectorXd left = rest.system.A * x - rest.system.b;
    for (const int rows : {rest.unknowns.H, rest.unknowns.K})
        EXPECT_LT(left.segment(rows, n).norm(), 1e-12 * rest.system.b.segment(rows, n).norm());
}

TEST(CurvatureEvolution, IsStifferByTheWidthOfTriangles) {
    // On a sphere of radius 2 |B| = sqrt(2)/2; w = u.nu is tested with itself: te (grad w, grad w)
    // curvature_stabilisation |B| width more.
    const double te = 0.1, stabilisation = 0.3;
    Eigen::MatrixXd block[2];
    for (int i : {0, 1}) {
        AtRest rest(mesh_of(Sphere{.radius = 2, .modes = {}}, icosphere(2), 3), gradient_flow, energies.back(), te);
        rest.base.curvature_stabilisation = i * stabilisation;
        rest.assembled();
        block[i] = rest.block(rest.unknowns.H, rest.mesh.size(), 0, rest.mesh.size());
    }
    const CurvedMesh mesh = mesh_of(Sphere{.radius = 2, .modes = {}}, icosphere(2), 3);
    const Eigen::VectorXd width = mesh_quality(mesh).width, w = smooth_at(mesh).row(0).transpose();
    const double slopes = w.dot(stiffness_matrix(SurfaceSpace(mesh), mesh) * w);
    const double more = w.dot((block[1] - block[0]) * w) / (te * slopes * stabilisation * std::sqrt(0.5));
    EXPECT_GT(more, 0.95 * width.minCoeff());  // the widths are the largest within each triangle
    EXPECT_LT(more, width.maxCoeff());
}

// |M - N^T| relative to |M|.
double distance(const Eigen::MatrixXd& M, const Eigen::MatrixXd& N) {
    return (M - N.transpose()).norm() / M.norm();
}

TEST(StepMatrix, IsSymmetricWhereNothingStretches) {
    // The evolution times -f_HH/te and -f_KK/te is the transpose of the force except (H f_H v.nu, phi) and the like,
    // which vanish with f_H and f_K: at H = H0 and K = 0.
    Bending bending{.k = {1, 0, 1}, .H0 = -0.5};
    const double te = 0.1;
    for (const SurfaceLaw& law : {gradient_flow, fluid}) {
        AtRest rest(mesh_of(wavy, icosphere(1), 3), law, bending, te);
        rest.base.fields.H.setConstant(bending.H0);
        rest.base.fields.K.setZero();
        rest.assembled();
        const MotionUnknowns& at = rest.unknowns;
        const int n = rest.mesh.size(), nv = law.components() * n;
        const double f_HH = 2 * bending.k[0], f_KK = 2 * bending.k[2];
        EXPECT_LT(distance(rest.block(0, nv, at.H, n), -f_HH / te * rest.block(at.H, n, 0, nv)), 1e-12);
        EXPECT_LT(distance(rest.block(0, nv, at.K, n), -f_KK / te * rest.block(at.K, n, 0, nv)), 1e-12);
        EXPECT_LT(distance(rest.block(0, nv, 0, nv), rest.block(0, nv, 0, nv)), 1e-12);
        if (!law.inextensible) continue;
        const int p = at.size() - at.p;
        EXPECT_LT(distance(rest.block(0, nv, at.p, p), rest.block(at.p, p, 0, nv)), 1e-12);
    }
}

TEST(StepMatrix, WhatIsNotSymmetricIsCurvature) {
    // On a sphere of radius R, with f_H = 2 k20 H: summed over all entries the part is -INT H f_H, H^2 = 4/R^2 and
    // 4 pi R^2 its area: -32 pi k20.
    const double te = 0.1;
    AtRest rest(mesh_of(Sphere{.radius = 1.5, .modes = {}}, icosphere(2), 4), gradient_flow, {.k = {1, 0, 0}}, te);
    rest.assembled();
    const int n = rest.mesh.size(), H = rest.unknowns.H;
    EXPECT_NEAR((rest.block(0, n, H, n) + 2 / te * rest.block(H, n, 0, n).transpose()).sum(), -32 * pi, 1e-2);
}

TEST(StepMatrix, ConvectionIsSkewInARigidRotation) {
    // ((u* - w*).grad u, v) of a velocity without divergence on a closed surface: (a.grad u, v) = -(a.grad v, u). The
    // rest of the block of the velocity is symmetric. Rotation is a polynomial: what is left is quadrature.
    AtRest rest(mesh_of(Sphere{}, icosphere(2), 4), fluid, energies[0], 0.1);
    const int n = rest.mesh.size();
    rest.assembled();
    const Eigen::MatrixXd without = rest.block(0, n, 0, n);
    for (int i = 0; i < n; ++i) {
        rest.base.velocity[i] = -rest.mesh.nodes[i].y();
        rest.base.velocity[n + i] = rest.mesh.nodes[i].x();
    }
    rest.assembled();
    const Eigen::MatrixXd convection = rest.block(0, n, 0, n) - without;
    EXPECT_GT(convection.norm(), 1e-2 * without.norm());
    EXPECT_LT((convection + convection.transpose()).norm(), 1e-3 * convection.norm());
    // The mesh that moves along feels none.
    rest.base.mesh_velocity.row(0) = rest.base.velocity.head(n).transpose();
    rest.base.mesh_velocity.row(1) = rest.base.velocity.segment(n, n).transpose();
    rest.assembled();
    EXPECT_LT((rest.block(0, n, 0, n) - without).norm(), 1e-13 * without.norm());
}

// The least beta with sup_u (q, div_P u)/||u|| >= beta ||q||, where ||u||^2 = INT |u|^2 + |D(u)|^2 dS.
double inf_sup(const CurvedMesh& mesh) {
    const SurfaceLaw law = motion_law({.kind = ModelKind::stokes, .Re = 2, .gamma = 1, .keeps_volume = false});
    AtRest rest(mesh, law, {.k = {1, 0, 0}}, 1);
    rest.assembled();
    const int nv = 3 * mesh.size(), p = rest.unknowns.size() - rest.unknowns.p;
    const Eigen::SparseMatrix<double> norm = rest.system.A.block(0, 0, nv, nv);
    const Eigen::MatrixXd B = rest.block(0, nv, rest.unknowns.p, p);
    const SurfaceSpace pressures(rest.unknowns.last_mesh());
    const Eigen::MatrixXd mass = mass_matrix(pressures, rest.unknowns.last_mesh());
    SparseLu factors;
    factors.factor(norm);
    const Eigen::MatrixXd schur = B.transpose() * factors.solve(B);
    return std::sqrt(eigenpairs(schur, mass)->values[0]);
}

TEST(InfSupStudy, HoldsOnFinerMeshesOfEveryOrder) {
    for (const int order : {2, 3, 4})
        for (const int n : {1, 2, 3})
            EXPECT_GT(inf_sup(mesh_of(wavy, icosphere(n), order)), 0.9) << "order " << order << ", mesh " << n;
}

TEST(InfSup, HoldsOnEveryMeshThatARunAccepts) {
    // Triangles nearly as bad as those that end a run (quality 0.03, guards.cpp), long or irregular: no run
    // comes to a mesh without this stability before it stops for its mesh.
    for (const int order : {2, 3, 4}) {
        const CurvedMesh thin = mesh_of(Tube{1, 6, {{0.2, 1, 0, 0}}}, tube_rings(1, 6, 2, 48), order);
        EXPECT_LT(mesh_quality(thin).worst, 0.07);
        EXPECT_GT(inf_sup(thin), 0.6) << order;
        const CurvedMesh irregular = mesh_of(wavy, jittered(icosphere(2), 0.8, 1), order);
        EXPECT_LT(mesh_quality(irregular).worst, 0.1);
        EXPECT_GT(inf_sup(irregular), 0.9) << order;
    }
}

TEST(StepMatrix, FluxAndPressureLoad) {
    // The flux of x through a closed surface is three times its volume; INT div_P x = 2 area.
    AtRest rest(mesh_of(wavy, icosphere(3), 4), fluid, energies[0], 0.1);
    rest.assembled();
    const int n = rest.mesh.size();
    VectorField x(3, n);
    for (int i = 0; i < n; ++i) x.col(i) = rest.mesh.nodes[i];
    const Observables o = observe(rest.space, rest.mesh,
                                  {rest.base.fields.normal, {}, rest.base.fields.H, rest.base.fields.K}, energies[0]);
    EXPECT_NEAR(rest.system.flux.head(3 * n).dot(stacked(x)) / (3 * o.volume), 1, 1e-5);
    const int p = rest.unknowns.size() - rest.unknowns.p;
    EXPECT_NEAR(rest.system.pressure_load.tail(p).sum() / o.area, 1, 1e-12);
    const Eigen::VectorXd divergence = rest.system.A.block(rest.unknowns.p, 0, p, 3 * n) * stacked(x);
    EXPECT_NEAR(divergence.sum() / (-2 * o.area), 1, 1e-10);
}

// The same answer by LU factors of the whole, border included.
Eigen::VectorXd by_lu(const Eigen::SparseMatrix<double>& A, const Eigen::VectorXd& b, const Eigen::MatrixXd& C,
                      const Eigen::VectorXd& d) {
    const Eigen::Index n = b.size(), m = C.cols();
    std::vector<Eigen::Triplet<double>> entries;
    for (int j = 0; j < A.outerSize(); ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(A, j); it; ++it)
            entries.emplace_back(it.row(), it.col(), it.value());
    for (Eigen::Index j = 0; j < m; ++j)
        for (Eigen::Index i = 0; i < n; ++i)
            if (C(i, j) != 0) entries.emplace_back(i, n + j, C(i, j)), entries.emplace_back(n + j, i, C(i, j));
    Eigen::SparseMatrix<double> whole(n + m, n + m);
    whole.setFromTriplets(entries.begin(), entries.end());
    Eigen::VectorXd rhs(n + m);
    rhs.head(n) = b;
    if (m > 0) rhs.tail(m) = d;
    SparseLuLarge lu;
    lu.factor(whole);
    return lu.solve(rhs, 2);
}

Eigen::VectorXd joined(const BorderedSolver::Answer& answer) {
    Eigen::VectorXd all(answer.x.size() + answer.y.size());
    all << answer.x, answer.y;
    return all;
}

// As StepSolver scales it.
void scale(AtRest& rest) {
    Eigen::VectorXd by = Eigen::VectorXd::Ones(rest.unknowns.size());
    const int n = rest.mesh.size();
    if (rest.unknowns.H >= 0) by.segment(rest.unknowns.H, n).setConstant(-2 * rest.bending.k[0] / rest.base.te);
    if (rest.unknowns.K >= 0) by.segment(rest.unknowns.K, n).setConstant(-2 * rest.bending.k[2] / rest.base.te);
    rest.system.A = by.asDiagonal() * rest.system.A;
    rest.system.b = by.asDiagonal() * rest.system.b;
}

TEST(StepSolve, AgreesWithLu) {
    const Bending bending{.k = {1, 0, 0.5}, .H0 = -0.5};
    for (const SurfaceLaw& law :
         {gradient_flow, SurfaceLaw(motion_law({.kind = ModelKind::overdamped, .keeps_volume = {}})), fluid}) {
        AtRest rest(mesh_of(wavy, icosphere(2), 3), law, bending, 1e-3);
        rest.assembled();
        scale(rest);
        const Eigen::MatrixXd C = rest.system.flux;
        const Eigen::VectorXd d = Eigen::VectorXd::Constant(1, 0.01);
        for (const bool bordered : {false, true}) {
            BorderedSolver solver(rest.unknowns.pattern(), rest.unknowns.node_of_unknown());
            const auto answer = bordered ? solver.solve(rest.system.A, rest.system.b, C, d)
                                         : solver.solve(rest.system.A, rest.system.b);
            const Eigen::VectorXd exact =
                bordered ? by_lu(rest.system.A, rest.system.b, C, d)
                         : by_lu(rest.system.A, rest.system.b, Eigen::MatrixXd(rest.system.b.size(), 0), {});
            const Eigen::VectorXd mine = joined(answer);
            const Eigen::Index nv = law.components() * rest.mesh.size();
            // GMRES stops at a residual of 1e-11; what it leaves is larger by the condition of the matrix.
            EXPECT_LT((mine - exact).head(nv).norm(), 1e-6 * exact.head(nv).norm());
            if (bordered) {
                EXPECT_NEAR(mine.tail(1)[0], exact.tail(1)[0], 1e-6 * std::abs(exact.tail(1)[0]));
            }
            EXPECT_EQ(solver.fallbacks(), 0);
        }
    }
}

TEST(StepSolve, TakesRowsThatAreNotItsColumns) {
    // As those of a stretch of the period; the residual of all equations, by GMRES and by factors.
    AtRest rest(mesh_of(wavy, icosphere(2), 3), gradient_flow, {.k = {1, 0, 0.5}, .H0 = -0.5}, 1e-3);
    rest.assembled();
    scale(rest);
    const Eigen::Index n = rest.system.b.size();
    BorderedSolver::Border border{Eigen::MatrixXd::Zero(n, 2), Eigen::MatrixXd::Zero(n, 2), Eigen::MatrixXd(2, 2),
                                  Eigen::Vector2d(0.02, -0.3)};
    border.C.col(0) = border.R.col(0) = rest.system.flux;
    for (Eigen::Index i = 0; i < n; ++i)
        border.C(i, 1) = 0.01 * std::sin(0.7 * i), border.R(i, 1) = 0.02 * std::cos(0.3 * i);
    border.D << 0, 0.4, 0.7, 1.5;
    Eigen::SparseMatrix<double> twisted = rest.system.A;
    for (int j = 0; j < twisted.outerSize(); ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(twisted, j); it; ++it)
            it.valueRef() = it.row() == j ? 1e-6 : (it.row() < j ? 1 : -1) * (1 + 0.3 * std::sin(it.row() + 2.0 * j));
    for (const bool directly : {false, true}) {
        const Eigen::SparseMatrix<double>& A = directly ? twisted : rest.system.A;
        BorderedSolver solver(rest.unknowns.pattern(), rest.unknowns.node_of_unknown());
        const auto [x, y] = solver.solve(A, rest.system.b, border);
        EXPECT_EQ(solver.fallbacks(), directly);
        EXPECT_LT((A * x + border.C * y - rest.system.b).norm(), 1e-8 * rest.system.b.norm());
        EXPECT_LT((border.R.transpose() * x + border.D * y - border.d).norm(), 1e-8);
    }
}

TEST(StepSolve, HoldsRigidMotions) {
    // Stokes flow without friction: the matrix is singular, or nearly so, in the six rigid motions, which the border
    // holds at the rates given.
    SurfaceLaw law = motion_law({.kind = ModelKind::stokes, .keeps_volume = {}});
    law.friction = 1e-5;
    AtRest rest(mesh_of(wavy, icosphere(2), 3), law, {.k = {1, 0, 0}}, 1e-3);
    rest.assembled();
    scale(rest);
    const int n = rest.mesh.size();
    const Eigen::SparseMatrix<double> mass = mass_matrix(rest.space, rest.mesh);
    Eigen::MatrixXd C = Eigen::MatrixXd::Zero(rest.unknowns.size(), 7);
    for (int motion = 0; motion < 6; ++motion) {
        VectorField r(3, n);
        const Eigen::Vector3d e = Eigen::Vector3d::Unit(motion % 3);
        for (int i = 0; i < n; ++i) r.col(i) = motion < 3 ? e : Eigen::Vector3d(e.cross(rest.mesh.nodes[i]));
        for (int c = 0; c < 3; ++c) C.col(motion).segment(c * n, n) = mass * r.row(c).transpose();
    }
    C.col(6) = rest.system.flux;
    const Eigen::VectorXd d = Eigen::VectorXd::LinSpaced(7, -0.3, 0.3);
    BorderedSolver solver(rest.unknowns.pattern(), rest.unknowns.node_of_unknown());
    const auto answer = solver.solve(rest.system.A, rest.system.b, C, d);
    EXPECT_LT((C.transpose() * answer.x - d).norm(), 1e-8);
    const Eigen::VectorXd exact = by_lu(rest.system.A, rest.system.b, C, d);
    EXPECT_LT((joined(answer) - exact).head(3 * n).norm(), 1e-5 * exact.head(3 * n).norm());
}

TEST(StepSolve, FallsBackToLu) {
    // A matrix of the same pattern that is far from symmetric: no preconditioner made of its symmetric part helps, for
    // that is a millionth of it.
    AtRest rest(mesh_of(wavy, icosphere(2), 2), gradient_flow, {.k = {1, 0, 0}}, 1e-3);
    const Eigen::SparseMatrix<double>& A = rest.assembled().A;
    Eigen::SparseMatrix<double> twisted = A;
    for (int j = 0; j < twisted.outerSize(); ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(twisted, j); it; ++it)
            it.valueRef() =
                it.row() == it.col() ? 1e-6 : (it.row() < j ? 1 : -1) * (1 + 0.3 * std::sin(it.row() + 2.0 * j));
    BorderedSolver solver(rest.unknowns.pattern(), rest.unknowns.node_of_unknown());
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(A.rows(), -1, 1);
    const Eigen::MatrixXd C = rest.system.flux;
    const Eigen::VectorXd d = Eigen::VectorXd::Constant(1, 0.1);
    const auto answer = solver.solve(twisted, b, C, d);
    EXPECT_EQ(solver.fallbacks(), 1);
    EXPECT_LT((twisted * answer.x + C * answer.y - b).norm(), 1e-8 * b.norm());
    EXPECT_NEAR((C.transpose() * answer.x)[0], 0.1, 1e-8);
    // The next matrix that is well-behaved needs none.
    rest.assembled();
    scale(rest);
    solver.solve(rest.system.A, rest.system.b, C, d);
    EXPECT_EQ(solver.fallbacks(), 1);
}

TEST(StepUnknowns, AreThoseOfTheModel) {
    // A model assembles and solves only the unknowns it has: velocity of one or three components, H where f depends on
    // it, K likewise, the pressure of P_k-1 where it flows and of P_k where it slips.
    const CurvedMesh mesh = mesh_of(Sphere{}, icosphere(1), 3);
    const int n = mesh.size();
    EXPECT_EQ(n, 92);  // 10 k^2 + 2
    EXPECT_EQ(MotionUnknowns(mesh, gradient_flow, {.k = {1, 0, 0}}).size(), 2 * n);
    EXPECT_EQ(MotionUnknowns(mesh, gradient_flow, {.k = {0, 0, 1}}).size(), 2 * n);
    EXPECT_EQ(MotionUnknowns(mesh, gradient_flow, {.k = {0, 1, 1}}).size(), 3 * n);
    EXPECT_EQ(
        MotionUnknowns(mesh, motion_law({.kind = ModelKind::overdamped, .keeps_volume = {}}), {.k = {1, 0, 0}}).size(),
        3 * n);
    EXPECT_EQ(MotionUnknowns(mesh, fluid, {.k = {1, 0, 1}}).size(), 5 * n + 42);  // 10 (k-1)^2 + 2
}

}  // namespace tubule::surface3d::motion_forms_test
