// Systems with several fields on one mesh: numbers of the unknowns, pattern of the matrix, order of elimination.
#pragma once

#include <vector>

#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {

// This many fields of P_k, one after the other, each numbered as the nodes of the mesh; then, if its order is not 0,
// one more field of another order (the pressure of Taylor-Hood elements) on the same triangles.
class FieldUnknowns {
public:
    FieldUnknowns(const CurvedMesh& mesh, int fields, int last_order = 0);

    int size() const { return size_; }
    int nodes() const { return nodes_; }
    const CurvedMesh& last_mesh() const { return last_mesh_; }

    // The unknowns of a cell: all nodes of the first field, then those of the second, and so on.
    int width() const { return width_; }
    const int* of_cell(int cell) const { return &of_cell_[static_cast<std::size_t>(cell) * width_]; }

    // Unknowns at the same place, for nested_dissection().
    const std::vector<int>& node_of_unknown() const { return node_of_unknown_; }

    // A zero matrix of the right pattern, and the sum of cell matrices, width() by width(), into it.
    const Eigen::SparseMatrix<double>& pattern() const { return pattern_; }
    void add(Eigen::SparseMatrix<double>& A, int cell, const Eigen::MatrixXd& block) const;

private:
    void set_numbers(const CurvedMesh& mesh, int fields);
    void set_pattern(int cells);

    int nodes_, size_, width_;
    CurvedMesh last_mesh_;
    std::vector<int> of_cell_, node_of_unknown_, slots_;
    Eigen::SparseMatrix<double> pattern_;
};

}  // namespace tubule::surface3d
