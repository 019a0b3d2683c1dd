#include "common/solve/sparse_supernodes.hpp"

#include <fmt/core.h>

#include "common/solve/sparse_cholmod.hpp"

namespace tubule {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

Supernodes plain_data(const cholmod_factor& factor) {
    const auto *order = static_cast<const int*>(factor.Perm), *super = static_cast<const int*>(factor.super),
               *begin = static_cast<const int*>(factor.pi), *rows = static_cast<const int*>(factor.s);
    Supernodes out;
    out.size = static_cast<int>(factor.n);
    out.order.assign(order, order + factor.n);
    out.column.assign(super, super + factor.nsuper + 1);
    out.row_begin.assign(begin, begin + factor.nsuper + 1);
    out.rows.assign(rows, rows + factor.ssize);
    out.parent.assign(factor.nsuper, -1);
    out.place_in_parent.assign(factor.ssize, -1);
    return out;
}

void link_to_parents(Supernodes& tree) {
    std::vector<int> supernode_of(tree.size);
    for (int s = 0; s < tree.count(); ++s)
        for (int column = tree.column[s]; column < tree.column[s + 1]; ++column) supernode_of[column] = s;
    for (int s = 0; s < tree.count(); ++s) {
        const auto below = tree.row_begin[s] + tree.columns_of(s), end = tree.row_begin[s + 1];
        if (below == end) continue;
        const int parent = tree.parent[s] = supernode_of[tree.rows[below]];
        auto at = tree.row_begin[parent];
        for (auto i = below; i < end; ++i) {
            while (tree.rows[at] < tree.rows[i]) ++at;
            tree.place_in_parent[i] = static_cast<int>(at - tree.row_begin[parent]);
        }
    }
}

}  // namespace

Supernodes find_supernodes(const Matrix& A, const Ordering& ordering) {
    if (!ordering.empty()) require_ordering(ordering, A.cols());
    const Matrix both = A + Matrix(A.transpose());
    cholmod_sparse view = Eigen::viewAsCholmod(both.selfadjointView<Eigen::Lower>());
    CholmodCommon common;
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.method[0].ordering = ordering.empty() ? CHOLMOD_AMD : CHOLMOD_GIVEN;
    cholmod_factor* factor =
        cholmod_analyze_p(&view, ordering.empty() ? nullptr : const_cast<int*>(ordering.data()), nullptr, 0, &common);
    if (!factor || common.status < CHOLMOD_OK) {
        const int status = common.status;
        cholmod_free_factor(&factor, &common);
        throw SolveError(
            fmt::format("factors of a matrix of size {} are too large (CHOLMOD's status {}); "
                        "an ordering by nodes needs less",
                        A.cols(), status));
    }
    Supernodes tree = plain_data(*factor);
    cholmod_free_factor(&factor, &common);
    link_to_parents(tree);
    return tree;
}

}  // namespace tubule
