#include "surface3d/fem/surface_space.hpp"

#include <algorithm>

#include "common/solve/pause.hpp"
#include "surface3d/fem/group_pattern.hpp"

namespace tubule::surface3d {

int default_degree(int order) {
    return std::min(4 * order, 12);
}

SurfaceSpace::SurfaceSpace(const CurvedMesh& mesh, int degree)
    : order_(mesh.order),
      size_(mesh.size()),
      width_(mesh.nodes_per_cell()),
      cells_(mesh.cells),
      tabulation_(mesh.order, quadrature(degree)),
      products_(width_ * width_, tabulation_.points()) {
    for (int q = 0; q < tabulation_.points(); ++q)
        products_.col(q) = (tabulation_.value.col(q) * tabulation_.value.col(q).transpose()).reshaped();
    check_pause();
    set_colours();
    check_pause();
    set_pattern();
}

// Greedy: the first colour that no node of the cell has met. Cells that share an edge or a face share a vertex.
void SurfaceSpace::set_colours() {
    std::vector<std::vector<char>> met;  // [node][colour]
    met.resize(size_);
    for (int cell = 0; cell < cells(); ++cell) {
        std::size_t colour = 0;
        const auto taken = [&](std::size_t c) {
            for (int a = 0; a < 3; ++a)
                if (const auto& m = met[node(cell, a)]; c < m.size() && m[c]) return true;
            return false;
        };
        while (taken(colour)) ++colour;
        for (int a = 0; a < 3; ++a) {
            auto& m = met[node(cell, a)];
            if (m.size() <= colour) m.resize(colour + 1, 0);
            m[colour] = 1;
        }
        if (colours_.size() <= colour) colours_.resize(colour + 1);
        colours_[colour].push_back(cell);
    }
}

void SurfaceSpace::set_pattern() {
    GroupPattern made = group_pattern(size_, cells_, width_);
    pattern_ = std::move(made.zero), slots_ = std::move(made.slots);
}

Eigen::SparseMatrix<double> mass_matrix(const SurfaceSpace& space, const CurvedMesh& mesh) {
    const Tabulation& table = space.tabulation();
    Eigen::SparseMatrix<double> A = space.pattern();
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        Eigen::VectorXd dS(table.points());
        for (int q = 0; q < table.points(); ++q) dS[q] = table.weight[q] * tangent_point(X, table, q).area;
        space.add(A, cell, (space.products() * dS).reshaped(space.width(), space.width()));
    });
    return A;
}

VectorField node_positions(const CurvedMesh& mesh) {
    VectorField X(3, mesh.size());
    for (int i = 0; i < mesh.size(); ++i) X.col(i) = mesh.nodes[i];
    return X;
}

CurvedMesh with_nodes(CurvedMesh mesh, const VectorField& X) {
    for (int i = 0; i < mesh.size(); ++i) mesh.nodes[i] = X.col(i);
    return mesh;
}

Tabulation SurfaceSpace::tabulation(int order) const {
    std::vector<QuadraturePoint> points;
    for (int q = 0; q < tabulation_.points(); ++q)
        points.push_back({tabulation_.point(0, q), tabulation_.point(1, q), tabulation_.weight[q]});
    return Tabulation(order, points);
}

Eigen::SparseMatrix<double> stiffness_matrix(const SurfaceSpace& space, const CurvedMesh& mesh) {
    const Tabulation& table = space.tabulation();
    Eigen::SparseMatrix<double> A = space.pattern();
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        CellMatrix block = CellMatrix::Zero(space.width(), space.width());
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const CellColumns<3> grad = gradients(p, table, q);
            block.noalias() += (table.weight[q] * p.area) * (grad.transpose() * grad);
        }
        space.add(A, cell, block);
    });
    return A;
}

}  // namespace tubule::surface3d
