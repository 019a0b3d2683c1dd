#include "surface3d/mesh_motion.hpp"

#include <algorithm>

namespace tubule::surface3d {

MeshMotion::MeshMotion(const CurvedMesh& mesh)
    : unknowns_(mesh, 4), A_(unknowns_.pattern()), solver_(unknowns_.pattern(), unknowns_.node_of_unknown()) {}

VectorField MeshMotion::velocity(const SurfaceSpace& space, const CurvedMesh& mesh, const CurvedMesh& from,
                                 const VectorField& normal, const Eigen::VectorXd& flux, double relaxation, double te) {
    const Tabulation& table = space.tabulation();
    const int n = space.width(), nodes = space.size();
    std::fill_n(A_.valuePtr(), A_.nonZeros(), 0.0);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(unknowns_.size());
    b.tail(nodes) = flux;
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell), Y = cell_nodes(from, cell), nu = space.gather(normal, cell);
        Eigen::MatrixXd block = Eigen::MatrixXd::Zero(4 * n, 4 * n);
        CellMatrix stiffness = CellMatrix::Zero(n, n);
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const double dS = table.weight[q] * p.area;
            const CellColumns<3> grad = gradients(p, table, q);
            const auto phi = table.value.col(q);
            stiffness.noalias() += dS * (grad.transpose() * grad);
            const Eigen::Vector3d normal_here = (nu * phi).normalized();
            const CellMatrix mass = dS * phi * phi.transpose();
            for (int d = 0; d < 3; ++d) block.block(3 * n, d * n, n, n) += normal_here[d] * mass;
        }
        const CellColumns<3> pull = Y * stiffness / -(relaxation + te);
        for (int d = 0; d < 3; ++d) {
            block.block(d * n, d * n, n, n) = stiffness;
            block.block(d * n, 3 * n, n, n) = block.block(3 * n, d * n, n, n).transpose();
        }
        unknowns_.add(A_, cell, block);
        for (int a = 0; a < n; ++a) {
            const int i = space.node(cell, a);
            for (int d = 0; d < 3; ++d) b[d * nodes + i] += pull(d, a);
        }
    });
    const Eigen::VectorXd x = solver_.solve(A_, b).x;
    VectorField out(3, nodes);
    for (int d = 0; d < 3; ++d) out.row(d) = x.segment(d * nodes, nodes).transpose();
    return out;
}

}  // namespace tubule::surface3d
