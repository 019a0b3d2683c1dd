// Sparse matrices that are sums of one local matrix for each element.
#pragma once

#include <Eigen/SparseCore>
#include <algorithm>
#include <vector>

namespace tubule::axisym {

// The place of an entry of the pattern in its values.
inline int slot_of(const Eigen::SparseMatrix<double>& pattern, int row, int column) {
    const int* begin = pattern.innerIndexPtr() + pattern.outerIndexPtr()[column];
    const int* end = pattern.innerIndexPtr() + pattern.outerIndexPtr()[column + 1];
    return static_cast<int>(std::lower_bound(begin, end, row) - pattern.innerIndexPtr());
}

// dofs(e): the unknown of each place in the local matrix of element e, -1 where there is none.
struct ElementPattern {
    Eigen::SparseMatrix<double> matrix;  // zeros
    std::vector<int> slots;  // of the local matrices, column by column: places in its values; 0 for what is absent
};

// The pattern of `size` unknowns; those in `full` have all entries of their rows and columns.
template <class Dofs>
ElementPattern element_pattern(int size, int elements, const Dofs& dofs, const std::vector<int>& full = {}) {
    std::vector<Eigen::Triplet<double>> entries;
    const auto each = [&](auto&& visit) {
        for (int e = 0; e < elements; ++e) {
            const std::vector<int> local = dofs(e);
            for (const int column : local)
                for (const int row : local) visit(row, column, row >= 0 && column >= 0);
        }
    };
    each([&](int row, int column, bool present) {
        if (present) entries.emplace_back(row, column, 0.0);
    });
    for (const int number : full)
        for (int i = 0; i < size; ++i) {
            entries.emplace_back(number, i, 0.0);
            entries.emplace_back(i, number, 0.0);
        }
    ElementPattern out{Eigen::SparseMatrix<double>(size, size), {}};
    out.matrix.setFromTriplets(entries.begin(), entries.end());
    each([&](int row, int column, bool present) {
        out.slots.push_back(present ? slot_of(out.matrix, row, column) : 0);
    });
    return out;
}

}  // namespace tubule::axisym
