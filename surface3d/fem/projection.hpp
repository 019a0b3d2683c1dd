// Right-hand sides over a surface, and the L2 projection onto P_k.
#pragma once

#include "common/solve/sparse.hpp"
#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {

// Sums of integrals at the nodes: work(cell, cell nodes, q, out) adds what quadrature point q contributes to the
// columns of `out`, one for each node of the cell.
template <int rows, class Work>
Eigen::Matrix<double, rows, Eigen::Dynamic> load(const SurfaceSpace& space, const CurvedMesh& mesh, Work&& work) {
    Eigen::Matrix<double, rows, Eigen::Dynamic> total =
        Eigen::Matrix<double, rows, Eigen::Dynamic>::Zero(rows, space.size());
    const Tabulation& table = space.tabulation();
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        CellColumns<rows> out = CellColumns<rows>::Zero(rows, space.width());
        for (int q = 0; q < table.points(); ++q) work(cell, X, q, out);
        for (int a = 0; a < space.width(); ++a) total.col(space.node(cell, a)) += out.col(a);
    });
    return total;
}

// Nodal values from integrals against the functions of P_k. SolveError if the mesh is degenerate.
class Projection {
public:
    Projection(const SurfaceSpace& space, const CurvedMesh& mesh) { update(space, mesh); }

    // For nodes that have moved; the ordering stays while the triangles do.
    void update(const SurfaceSpace& space, const CurvedMesh& mesh) { mass_.factor(mass_matrix(space, mesh)); }

    template <int rows>
    Eigen::Matrix<double, rows, Eigen::Dynamic> operator()(const Eigen::Matrix<double, rows, Eigen::Dynamic>& b) const {
        return mass_.solve(b.transpose().eval()).transpose();
    }

private:
    SparseCholesky mass_;
};

}  // namespace tubule::surface3d
