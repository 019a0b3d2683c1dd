#include "surface3d/motion/mesh_motion.hpp"

#include <array>
#include <cmath>

#include "common/solve/dense.hpp"

namespace tubule::surface3d {
namespace {

// Measured choices: docs/decisions/surface_motion.md, "Surfaces in motion".
constexpr double most = 4;  // bound of the wanted density of triangles, relative to the mean, and of its inverse
constexpr double tolerance = 1e-5;  // of the velocity along the surface
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
    VectorField pull;                                 // -(beta grad X, grad Z)
};

System assemble(const SurfaceSpace& space, const CurvedMesh& mesh, const VectorField& normal,
                const Eigen::VectorXd& weight) {
    const Tabulation& table = space.tabulation();
    const int n = space.width(), points = table.points();
    System out{space.pattern(), {}, VectorField::Zero(3, space.size())};
    out.flux.fill(out.L);
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
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
        const Eigen::MatrixX3d blocks = space.products() * dS_nu;
        for (int d = 0; d < 3; ++d) space.add(out.flux[d], cell, blocks.col(d).reshaped(n, n));
        const CellColumns<3> pull = X * stiffness * -weight[cell];
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

// The translation whose flux is nearest to that given. A tube may be nearly straight: none along its axis.
Eigen::Vector3d translation(const System& system, const VectorField& normal, const Eigen::VectorXd& flux, bool tube) {
    const int free = tube ? 2 : 3;
    Eigen::MatrixXd of_unit(flux.size(), free);
    for (int d = 0; d < free; ++d) of_unit.col(d) = system.flux[d] * Eigen::VectorXd::Ones(flux.size());
    const Eigen::MatrixXd across = normal.topRows(free);
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    out.head(free) = solve_dense(across * of_unit, across * flux);
    return out;
}

// Tangential motions of the nodes. A uniform motion along a tube is excluded: nothing resists it on a straight tube,
// and on a nearly straight one it would be amplified noise.
struct AlongSurface {
    const VectorField& normal;
    VectorField running;  // of norm 1; zero on a closed surface

    AlongSurface(const VectorField& normal, bool tube) : normal(normal), running(VectorField::Zero(3, normal.cols())) {
        if (!tube) return;
        running.row(2).setOnes();
        running = tangential(running, normal).normalized();
    }
    VectorField operator()(const VectorField& v) const {
        const VectorField out = tangential(v, normal);
        return out - running * out.cwiseProduct(running).sum();
    }
};

// Changes w along the nodal normals until (w.nu, phi) = flux.
void meet_flux(const System& system, const Projection& project, const VectorField& normal, const Eigen::VectorXd& flux,
               VectorField& w) {
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        Eigen::VectorXd missing = flux;
        for (int d = 0; d < 3; ++d) missing -= system.flux[d] * w.row(d).transpose();
        w += normal * project(Row(missing.transpose())).asDiagonal();
    }
}

// The tangential part of r: r - (m nu, Z), with the multiplier m such that nothing is left along the nodal normals.
// Without m, testing with nodal tangents alone, the curvature vector of the mesh, which is not exactly normal, would
// move nodes indefinitely: a mesh at rest would deform.
VectorField without_multiplier(const System& system, const Projection& project, const VectorField& normal,
                               const AlongSurface& along_surface, VectorField r) {
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        const Eigen::VectorXd m = project(along(r, normal)).transpose();
        for (int d = 0; d < 3; ++d) r.row(d) -= (system.flux[d] * m).transpose();
    }
    return along_surface(r);
}

// Conjugate gradients for the s along the surface with (grad s, grad Z) = (r, Z) for all such Z, preconditioned by the
// Laplacian of each component.
VectorField solve_along(const AlongSurface& along_surface, const Eigen::SparseMatrix<double>& L,
                        const SparseCholesky& laplacian, VectorField r) {
    const auto precondition = [&](const VectorField& v) {
        return along_surface(laplacian.solve(v.transpose().eval()).transpose());
    };
    VectorField s = VectorField::Zero(3, r.cols()), z = precondition(r), direction = z;
    double size = r.cwiseProduct(z).sum();
    const double enough = tolerance * tolerance * size;
    for (int k = 0; size > enough; ++k) {
        if (k == most_iterations) throw SolveError("the motion of the mesh along the surface does not converge");
        const VectorField image = along_surface(times(L, direction));
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

VectorField MeshMotion::velocity(const SurfaceSpace& space, const CurvedMesh& mesh, const MotionFields& fields,
                                 const Projection& project, const Eigen::VectorXd& flux, double relaxation) {
    const VectorField& normal = fields.normal;
    const System system = assemble(
        space, mesh, normal, follows_curvature_ ? weights(space, mesh, fields) : Eigen::VectorXd::Ones(space.cells()));
    Eigen::SparseMatrix<double> shifted = system.L;
    shifted.diagonal().array() += shift / space.size();
    laplacian_.factor(shifted);

    // Relative to a frame that moves with the surface, so that a motion does not depend on the frame.
    const bool tube = mesh.period > 0;
    const VectorField frame = translation(system, normal, flux, tube).replicate(1, space.size());
    Eigen::VectorXd relative = flux;
    for (int d = 0; d < 3; ++d) relative -= system.flux[d] * frame.row(d).transpose();

    VectorField w = VectorField::Zero(3, space.size());
    meet_flux(system, project, normal, relative, w);
    const VectorField left = system.pull / relaxation - times(system.L, w);
    const AlongSurface along_surface(normal, tube);
    w += solve_along(along_surface, system.L, laplacian_,
                     without_multiplier(system, project, normal, along_surface, left));
    meet_flux(system, project, normal, relative, w);
    return w + frame;
}

}  // namespace tubule::surface3d
