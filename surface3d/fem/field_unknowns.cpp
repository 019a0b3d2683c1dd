#include "surface3d/fem/field_unknowns.hpp"

#include <algorithm>

#include "common/solve/pause.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"

namespace tubule::surface3d {

FieldUnknowns::FieldUnknowns(const CurvedMesh& mesh, int fields, int last_order)
    : nodes_(mesh.size()), size_(fields * mesh.size()), width_(fields * mesh.nodes_per_cell()) {
    if (last_order > 0) {
        last_mesh_ = last_order == mesh.order ? mesh : with_order(mesh, last_order);
        size_ += last_mesh_.size(), width_ += last_mesh_.nodes_per_cell();
    }
    check_pause();
    set_numbers(mesh, fields);
    check_pause();
    set_pattern(mesh.triangles());
}

void FieldUnknowns::set_numbers(const CurvedMesh& mesh, int fields) {
    node_of_unknown_.resize(size_);
    for (int i = 0; i < fields * nodes_; ++i) node_of_unknown_[i] = i % nodes_;

    // A node of the last field is eliminated with one of the mesh on the same corner, edge or triangle.
    const int n = mesh.nodes_per_cell(), k = mesh.order, last = last_mesh_.order;
    const int n_last = width_ - fields * n, per_edge = std::max(last - 1, 1), on_edges = 3 * (last - 1);
    const auto beside = [&](int a) {
        if (last == k || a < 3) return a;
        return a - 3 < on_edges ? 3 + (a - 3) / per_edge * (k - 1) + (a - 3) % per_edge : 3 * k + (a - 3 - on_edges);
    };
    of_cell_.reserve(static_cast<std::size_t>(mesh.triangles()) * width_);
    for (int cell = 0; cell < mesh.triangles(); ++cell) {
        for (int field = 0; field < fields; ++field)
            for (int a = 0; a < n; ++a) of_cell_.push_back(field * nodes_ + mesh.node(cell, a));
        for (int a = 0; a < n_last; ++a) {
            of_cell_.push_back(fields * nodes_ + last_mesh_.node(cell, a));
            node_of_unknown_[of_cell_.back()] = mesh.node(cell, beside(a));
        }
    }
}

void FieldUnknowns::set_pattern(int cells) {
    std::vector<std::vector<int>> rows(size_);  // of each column
    for (int cell = 0; cell < cells; ++cell)
        for (int b = 0; b < width_; ++b) {
            std::vector<int>& r = rows[of_cell(cell)[b]];
            r.insert(r.end(), of_cell(cell), of_cell(cell) + width_);
        }
    Eigen::VectorXi counts(size_);
    for (int column = 0; column < size_; ++column) {
        std::vector<int>& r = rows[column];
        std::sort(r.begin(), r.end());
        r.erase(std::unique(r.begin(), r.end()), r.end());
        counts[column] = static_cast<int>(r.size());
    }
    pattern_.resize(size_, size_);
    pattern_.reserve(counts);
    for (int column = 0; column < size_; ++column)
        for (int row : rows[column]) pattern_.insert(row, column) = 0;
    pattern_.makeCompressed();

    const int* begin = pattern_.innerIndexPtr();
    slots_.reserve(static_cast<std::size_t>(cells) * width_ * width_);
    for (int cell = 0; cell < cells; ++cell)
        for (int b = 0; b < width_; ++b) {
            const int column = of_cell(cell)[b];
            const int *low = begin + pattern_.outerIndexPtr()[column],
                      *high = begin + pattern_.outerIndexPtr()[column + 1];
            for (int a = 0; a < width_; ++a)
                slots_.push_back(static_cast<int>(std::lower_bound(low, high, of_cell(cell)[a]) - begin));
        }
}

void FieldUnknowns::add(Eigen::SparseMatrix<double>& A, int cell, const Eigen::MatrixXd& block) const {
    const int* slot = &slots_[static_cast<std::size_t>(cell) * width_ * width_];
    for (Eigen::Index i = 0; i < block.size(); ++i) A.valuePtr()[slot[i]] += block.data()[i];
}

}  // namespace tubule::surface3d
