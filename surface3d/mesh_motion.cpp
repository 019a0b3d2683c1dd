#include "surface3d/mesh_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tubule::surface3d {
namespace {

// Measured choices: docs/decisions.md, "Surfaces in motion".
constexpr double most = 4;          // density of triangles, wanted: so many times the mean, or its inverse
constexpr double tolerance = 1e-5;  // of the velocity along the surface
constexpr double rounding = 1e-9;   // what pulls along it, over what pulls at all: nothing but rounding
constexpr int most_iterations = 300;
constexpr int sweeps = 3;     // nodal normals for their integrals: each leaves a twentieth on 320 triangles
constexpr double shift = 12;  // of the Laplacian, over the number of nodes: about 1/R^2 times the mass

using Row = Eigen::Matrix<double, 1, Eigen::Dynamic>;

// The factor a of each triangle.
Eigen::VectorXd weights(const SurfaceSpace& space, const CurvedMesh& mesh, const MotionFields& fields) {
    const Tabulation& table = space.tabulation();
    const Eigen::VectorXd B2 = fields.H.cwiseAbs2() - 2 * fields.K;
    Eigen::VectorXd area = Eigen::VectorXd::Zero(space.cells()), curved = area;
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        const auto at_nodes = space.gather(B2, cell);
        for (int q = 0; q < table.points(); ++q) {
            const double dS = table.weight[q] * tangent_point(X, table, q).area;
            area[cell] += dS;
            curved[cell] += dS * at_nodes.dot(table.value.col(q));
        }
    });
    const double mean = curved.sum() / area.sum();
    const Eigen::VectorXd density = curved.cwiseQuotient(area).cwiseMax(mean / most).cwiseMin(mean * most);
    return density.cwiseProduct(area) / density.dot(area) * static_cast<double>(space.cells());
}

struct System {
    Eigen::SparseMatrix<double> L;                    // (grad phi_i, grad phi_j)
    std::array<Eigen::SparseMatrix<double>, 3> flux;  // (nu_d phi_i, phi_j)
    VectorField pull;                                 // -(a grad X, grad Z)
};

System assemble(const SurfaceSpace& space, const CurvedMesh& mesh, const CurvedMesh& from, const VectorField& normal,
                const Eigen::VectorXd& weight) {
    const Tabulation& table = space.tabulation();
    const int n = space.width(), points = table.points();
    System out{space.pattern(), {}, VectorField::Zero(3, space.size())};
    out.flux.fill(out.L);
    Eigen::MatrixXd products(n * n, points);
    for (int q = 0; q < points; ++q) products.col(q) = (table.value.col(q) * table.value.col(q).transpose()).reshaped();
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell), Y = cell_nodes(from, cell);
        const CellColumns<3> nu = space.gather(normal, cell);
        Eigen::MatrixX3d dS_nu(points, 3);
        Eigen::MatrixXd grad(n, 3 * points);  // times the root of dS
        for (int q = 0; q < points; ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const double dS = table.weight[q] * p.area;
            dS_nu.row(q) = dS * (nu * table.value.col(q)).normalized().transpose();
            grad.middleCols<3>(3 * q) = std::sqrt(dS) * gradients(p, table, q).transpose();
        }
        const CellMatrix stiffness = grad * grad.transpose();
        space.add(out.L, cell, stiffness);
        const Eigen::MatrixX3d blocks = products * dS_nu;
        for (int d = 0; d < 3; ++d) space.add(out.flux[d], cell, blocks.col(d).reshaped(n, n));
        const CellColumns<3> pull = Y * stiffness * -weight[cell];
        for (int a = 0; a < n; ++a) out.pull.col(space.node(cell, a)) += pull.col(a);
    });
    return out;
}

VectorField times(const Eigen::SparseMatrix<double>& A, const VectorField& v) {
    return (A * v.transpose()).transpose();
}

Row along(const VectorField& v, const VectorField& normal) {
    return v.cwiseProduct(normal).colwise().sum();
}

VectorField tangential(const VectorField& v, const VectorField& normal) {
    return v - normal * along(v, normal).asDiagonal();
}

// Changes w along the nodal normals until (w.nu, phi) = flux.
void meet_flux(const System& system, const Projection& project, const VectorField& normal, const Eigen::VectorXd& flux,
               VectorField& w) {
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        Eigen::VectorXd missing = flux;
        for (int d = 0; d < 3; ++d) missing -= system.flux[d] * w.row(d).transpose();
        w += normal * project(Row(missing.transpose())).asDiagonal();
    }
}

// What r does along the surface: r - (m nu, Z), with m such that nothing is left along the nodal normals. Leaving out
// m, and testing with nodal tangents alone, would let the curvature vector of the mesh, which is not quite normal, pull
// nodes for ever: a cell at rest deforms.
VectorField without_multiplier(const System& system, const Projection& project, const VectorField& normal,
                               VectorField r) {
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        const Eigen::VectorXd m = project(along(r, normal)).transpose();
        for (int d = 0; d < 3; ++d) r.row(d) -= (system.flux[d] * m).transpose();
    }
    return tangential(r, normal);
}

// Conjugate gradients for the tangential s with (grad s, grad Z) = (r, Z) for tangential Z, preconditioned by the
// Laplacian of each component. Nothing resists a translation along a straight tube: what is less than `negligible` in
// the norm of the preconditioner is left as it is.
VectorField along_surface(const Eigen::SparseMatrix<double>& L, const SparseCholesky& laplacian,
                          const VectorField& normal, VectorField r, double negligible) {
    const auto precondition = [&](const VectorField& v) {
        return tangential(laplacian.solve(v.transpose().eval()).transpose(), normal);
    };
    VectorField s = VectorField::Zero(3, r.cols()), z = precondition(r), direction = z;
    double size = r.cwiseProduct(z).sum();
    const double enough = std::max(tolerance * tolerance * size, negligible);
    for (int k = 0; size > enough; ++k) {
        if (k == most_iterations) throw SolveError("the motion of the mesh along the surface does not converge");
        const VectorField image = tangential(times(L, direction), normal);
        const double step = size / direction.cwiseProduct(image).sum();
        s += step * direction;
        r -= step * image;
        z = precondition(r);
        const double before = size;
        size = r.cwiseProduct(z).sum();
        direction = z + size / before * direction;
    }
    return s;
}

}  // namespace

VectorField MeshMotion::velocity(const SurfaceSpace& space, const CurvedMesh& mesh, const CurvedMesh& from,
                                 const MotionFields& fields, const Projection& project, const Eigen::VectorXd& flux,
                                 double relaxation, double te) {
    const VectorField& normal = fields.normal;
    const System system =
        assemble(space, mesh, from, normal,
                 follows_curvature_ ? weights(space, mesh, fields) : Eigen::VectorXd::Ones(space.cells()));
    Eigen::SparseMatrix<double> shifted = system.L;
    shifted.diagonal().array() += shift / space.size();
    laplacian_.factor(shifted);

    VectorField w = VectorField::Zero(3, space.size());
    meet_flux(system, project, normal, flux, w);
    const VectorField left = system.pull / (relaxation + te) - times(system.L, w);
    const double negligible =
        rounding * rounding * left.cwiseProduct(laplacian_.solve(left.transpose().eval()).transpose()).sum();
    w += along_surface(system.L, laplacian_, normal, without_multiplier(system, project, normal, left), negligible);
    meet_flux(system, project, normal, flux, w);
    return w;
}

}  // namespace tubule::surface3d
