// The continuous functions P_k on the triangles of a curved mesh: numbering, tables and matrix pattern, which stay
// while the nodes move.
#pragma once

#include <Eigen/SparseCore>
#include <array>
#include <cmath>
#include <vector>

#include "common/geometry/surface_point.hpp"
#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
#include "surface3d/mesh/curved_mesh.hpp"
#include "surface3d/mesh/reference_triangle.hpp"

namespace tubule::surface3d {

// Small matrices with one column, or row and column, for each node of a cell: on the stack.
template <int rows>
using CellColumns =
    Eigen::Matrix<double, rows, Eigen::Dynamic, rows == 1 ? Eigen::RowMajor : Eigen::ColMajor, rows, max_cell_nodes>;
using CellMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, max_cell_nodes, max_cell_nodes>;

// Nodal values of a vector or a symmetric tensor (xx, xy, xz, yy, yz, zz), one column a node.
using VectorField = Eigen::Matrix<double, 3, Eigen::Dynamic>;
using TensorField = Eigen::Matrix<double, 6, Eigen::Dynamic>;

inline Eigen::Matrix<double, 6, 1> packed_tensor(const Eigen::Matrix3d& B) {
    Eigen::Matrix<double, 6, 1> out;
    out << B(0, 0), (B(0, 1) + B(1, 0)) / 2, (B(0, 2) + B(2, 0)) / 2, B(1, 1), (B(1, 2) + B(2, 1)) / 2, B(2, 2);
    return out;
}
template <class Packed>
Eigen::Matrix3d tensor(const Packed& b) {
    Eigen::Matrix3d out;
    out << b[0], b[1], b[2], b[1], b[3], b[4], b[2], b[4], b[5];
    return out;
}

// Quadrature for integrals of curvatures, by default of this degree: there the error of the rule stays below that of
// P_k (docs/curvature.md).
int default_degree(int order);

class SurfaceSpace {
public:
    explicit SurfaceSpace(const CurvedMesh& mesh) : SurfaceSpace(mesh, default_degree(mesh.order)) {}
    SurfaceSpace(const CurvedMesh& mesh, int degree);

    int order() const { return order_; }
    int size() const { return size_; }
    int cells() const { return static_cast<int>(cells_.size()) / width_; }
    int width() const { return width_; }  // nodes of a cell
    int node(int cell, int a) const { return cells_[cell * width_ + a]; }
    const Tabulation& tabulation() const { return tabulation_; }
    // phi_a phi_b at each point, one column each, entry (a, b) at b * width() + a: a cell's integrals of such products
    // are this times what stands before them, point by point.
    const Eigen::MatrixXd& products() const { return products_; }
    // At the same points, functions of another order.
    Tabulation tabulation(int order) const;

    // Runs `cell_work(cell)` for every cell, on all threads; ends early with Paused. No two cells that share a node are
    // under way at once, and those that do always come in the same order: work may add to nodal values, with the same
    // sum to the last bit.
    template <class CellWork>
    void for_each_cell(CellWork&& cell_work) const {
        SharedPause pause;
        for (const std::vector<int>& colour : colours_)
            parallel_for(colour.size(), [&](std::size_t i) {
                if (!pause.look(i)) cell_work(colour[i]);
            });
        pause.check();
    }

    // A zero matrix of the right pattern, and the sum of cell matrices into it.
    const Eigen::SparseMatrix<double>& pattern() const { return pattern_; }
    void add(Eigen::SparseMatrix<double>& A, int cell, const CellMatrix& block) const {
        const int* slot = &slots_[static_cast<std::size_t>(cell) * width_ * width_];
        for (int i = 0; i < width_ * width_; ++i) A.valuePtr()[slot[i]] += block.data()[i];
    }

    // The columns of the cell's nodes, in the order of the cell.
    template <int rows>
    CellColumns<rows> gather(const Eigen::Matrix<double, rows, Eigen::Dynamic>& nodal, int cell) const {
        CellColumns<rows> out(rows, width_);
        for (int a = 0; a < width_; ++a) out.col(a) = nodal.col(node(cell, a));
        return out;
    }
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_cell_nodes, 1> gather(const Eigen::VectorXd& nodal,
                                                                          int cell) const {
        Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_cell_nodes, 1> out(width_);
        for (int a = 0; a < width_; ++a) out[a] = nodal[node(cell, a)];
        return out;
    }

private:
    void set_colours();
    void set_pattern();

    int order_, size_, width_;
    std::vector<int> cells_;
    Tabulation tabulation_;
    Eigen::MatrixXd products_;
    std::vector<std::vector<int>> colours_;
    Eigen::SparseMatrix<double> pattern_;
    std::vector<int> slots_;  // of each entry of each cell matrix, column by column
};

// All nodes, one column each, and the same mesh with its nodes there.
VectorField node_positions(const CurvedMesh& mesh);
CurvedMesh with_nodes(CurvedMesh mesh, const VectorField& X);

// The nodes of a cell as it sees them, one column each.
inline CellColumns<3> cell_nodes(const CurvedMesh& mesh, int cell) {
    const int n = mesh.nodes_per_cell();
    CellColumns<3> X(3, n);
    for (int a = 0; a < n; ++a) X.col(a) = mesh.position(cell, a);
    return X;
}

// The point of number q of a table; without curvatures, or with those of the cell itself.
inline SurfacePoint<double> tangent_point(const CellColumns<3>& X, const Tabulation& table, int q) {
    SurfacePoint<double> p;
    set_tangents<double>(p, X * table.value.col(q), X * table.d[0].col(q), X * table.d[1].col(q));
    return p;
}
inline SurfacePoint<double> curved_point(const CellColumns<3>& X, const Tabulation& table, int q) {
    SurfacePoint<double> p = tangent_point(X, table, q);
    set_curvature<double>(p, X * table.dd[0].col(q), X * table.dd[1].col(q), X * table.dd[2].col(q));
    return p;
}

// Calls visit(cell, point, weight) at the points of a rule of this degree on all cells; dS = weight point.area.
template <class Visit>
void for_each_point(const CurvedMesh& mesh, int degree, const Visit& visit) {
    const Tabulation table(mesh.order, quadrature(degree));
    for (int cell = 0; cell < mesh.triangles(); ++cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        for (int q = 0; q < table.points(); ++q) visit(cell, tangent_point(X, table, q), table.weight[q]);
    }
}

// Root of the mean square of the sides that the cell would have if it were flat and like this all over.
inline double triangle_width(const SurfacePoint<double>& p) {
    return std::sqrt(2 * (p.metric[0] + p.metric[2] - p.metric[1]) / 3);
}

// Surface gradients of all functions of the cell at a point, one column each.
inline CellColumns<3> gradients(const SurfacePoint<double>& p, const Tabulation& table, int q) {
    return p.dual[0] * table.d[0].col(q).transpose() + p.dual[1] * table.d[1].col(q).transpose();
}

// INT phi_a phi_b dS and INT grad phi_a . grad phi_b dS.
Eigen::SparseMatrix<double> mass_matrix(const SurfaceSpace& space, const CurvedMesh& mesh);
Eigen::SparseMatrix<double> stiffness_matrix(const SurfaceSpace& space, const CurvedMesh& mesh);

}  // namespace tubule::surface3d
