// Which entries the factors of a symmetric matrix have, and in which order they are found. Private to common/solve.
#pragma once

#include <Eigen/SparseCore>
#include <cstddef>
#include <vector>

#include "common/solve/sparse.hpp"

namespace tubule {

// Supernodes: runs of columns of L with the same rows below them. Columns and rows count in the order of elimination,
// which is a postorder of the tree of supernodes.
struct Supernodes {
    int size = 0;                           // of the matrix
    Ordering order;                         // order[k]: the unknown eliminated as number k
    std::vector<int> column;                // supernode s has the columns column[s] to column[s + 1]
    std::vector<std::ptrdiff_t> row_begin;  // and the rows rows[row_begin[s]] to rows[row_begin[s + 1]], ascending,
    std::vector<int> rows;                  // its own columns first
    std::vector<int> parent;                // -1 for a root: otherwise the supernode of the first row below
    std::vector<int> place_in_parent;       // of each of `rows`: its number among the rows of the parent

    int count() const { return static_cast<int>(parent.size()); }
    int columns_of(int s) const { return column[s + 1] - column[s]; }
    int rows_of(int s) const { return static_cast<int>(row_begin[s + 1] - row_begin[s]); }
};

// For the pattern of A + A^T, by CHOLMOD; the given ordering, or one of minimum degree (AMD), up to a postorder.
// std::invalid_argument when the ordering does not fit, SolveError when the factors are too large.
Supernodes find_supernodes(const Eigen::SparseMatrix<double>& A, const Ordering& ordering);

}  // namespace tubule
