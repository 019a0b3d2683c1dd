// Patterns of sparse matrices that are sums of dense ones, each of a group of unknowns.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

namespace tubule::surface3d {

// A zero matrix with an entry for any two unknowns of one group; and where it has each entry of each group's matrix,
// column by column.
struct GroupPattern {
    Eigen::SparseMatrix<double> zero;
    std::vector<int> slots;
};
// `members` of all groups, `width` each; one may be there twice.
GroupPattern group_pattern(int size, const std::vector<int>& members, int width);

}  // namespace tubule::surface3d
