#include "common/solve/sparse_cholmod.hpp"

#include <fmt/core.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <vector>

#include "common/solve/memory.hpp"
#include "common/solve/sparse_engine.hpp"

namespace tubule {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

// While it lives, parallel regions have one thread. CHOLMOD asks for four in every supernode, whatever the machine has,
// and these wait for each other by spinning: on two busy cores it took 2 to 30 times as long
// (docs/decisions/linear_algebra.md).
class OneThread {
public:
    OneThread() { omp_set_max_active_levels(0); }
    OneThread(const OneThread&) = delete;
    OneThread& operator=(const OneThread&) = delete;
    ~OneThread() { omp_set_max_active_levels(levels_); }

private:
    int levels_ = omp_get_max_active_levels();
};

// Throws SolveError unless diagonal entries are positive and those across it agree to rounding, measured by
// |a_ij| < sqrt(a_ii a_jj), which holds for every positive definite matrix in whatever units its unknowns come.
void require_symmetric(const Matrix& A) {
    constexpr double rounding = 1e-10;
    const int n = static_cast<int>(A.cols());
    const int *const begin = A.outerIndexPtr(), *const row = A.innerIndexPtr();
    const double* const value = A.valuePtr();
    const Eigen::VectorXd diagonal = A.diagonal();
    for (int i = 0; i < n; ++i)
        if (!(diagonal[i] > 0))
            throw SolveError(fmt::format("matrix of size {} is not positive definite: diagonal entry {} is {:g}", n, i,
                                         diagonal[i]));
    const Eigen::VectorXd scale = diagonal.cwiseSqrt();
    const auto require_equal = [&](int i, int j, double a, double b) {
        if (!(std::abs(a - b) <= rounding * scale[i] * scale[j]))
            throw SolveError(fmt::format("matrix of size {} is not symmetric in ({}, {})", n, i, j));
    };
    std::vector<int> below(n);  // the entry of each column below the diagonal to which the next columns come
    for (int j = 0; j < n; ++j) {
        int k = begin[j];
        for (; row[k] < j; ++k) {
            const int i = row[k];
            int& mirror = below[i];
            for (; mirror < begin[i + 1] && row[mirror] < j; ++mirror) require_equal(row[mirror], i, value[mirror], 0);
            const bool stored = mirror < begin[i + 1] && row[mirror] == j;
            require_equal(j, i, stored ? value[mirror++] : 0, value[k]);
        }
        below[j] = k + 1;
    }
    for (int i = 0; i < n; ++i)
        for (int k = below[i]; k < begin[i + 1]; ++k) require_equal(row[k], i, value[k], 0);
}

constexpr double bytes_per_entry = 14;  // of factors, measured

class Cholmod : public SparseEngine {
public:
    explicit Cholmod(Ordering ordering) : ordering_(std::move(ordering)) {
        prepare_blas(1);
        common_.method[0].ordering = ordering_.empty() ? CHOLMOD_AMD : CHOLMOD_GIVEN;
        common_.final_ll = 1;  // LDL^T, the other choice for little fill, would go through indefinite matrices
        common_.quick_return_if_not_posdef = 1;
    }
    ~Cholmod() override { cholmod_free_factor(&factor_, &common_); }

    void analyse(const Matrix& A) override {
        cholmod_free_factor(&factor_, &common_);
        require_ordering(ordering_, static_cast<int>(A.cols()));
        cholmod_sparse view = lower_triangle(A);
        factor_ = cholmod_analyze_p(&view, ordering_.empty() ? nullptr : ordering_.data(), nullptr, 0, &common_);
        if (!factor_) fail();
        fill_ = static_cast<std::int64_t>(common_.lnz);
        require_factors(bytes_per_entry * common_.lnz, common_.fl / 2, A.cols());
    }

    void factor(const Matrix& A) override {
        require_symmetric(A);
        cholmod_sparse view = lower_triangle(A);
        const OneThread one_thread;
        const bool done = cholmod_factorize(&view, factor_, &common_);
        if (done && common_.status == CHOLMOD_NOT_POSDEF)
            throw SolveError(fmt::format("matrix of size {} is not positive definite: no positive pivot for unknown {}",
                                         A.cols(), static_cast<const int*>(factor_->Perm)[factor_->minor]));
        if (!done || common_.status < CHOLMOD_OK) fail();
    }

    void solve(double* x, int size, int count, bool) override {
        cholmod_dense b{};
        b.nrow = b.d = static_cast<std::size_t>(size);
        b.ncol = static_cast<std::size_t>(count);
        b.nzmax = b.nrow * b.ncol;
        b.x = x;
        b.xtype = CHOLMOD_REAL;
        b.dtype = CHOLMOD_DOUBLE;
        cholmod_dense* answer = cholmod_solve(CHOLMOD_A, factor_, &b, &common_);
        if (!answer) fail();
        std::copy_n(static_cast<const double*>(answer->x), b.nzmax, x);
        cholmod_free_dense(&answer, &common_);
    }

    double pivot_ratio() override { return cholmod_rcond(factor_, &common_); }
    std::int64_t fill() override { return fill_; }

private:
    [[noreturn]] void fail() const {
        if (common_.status == CHOLMOD_OUT_OF_MEMORY || common_.status == CHOLMOD_TOO_LARGE)
            throw SolveError("not enough memory for the Cholesky factors");
        throw SolveError(fmt::format("CHOLMOD failed (status {})", common_.status));
    }

    Ordering ordering_;
    CholmodCommon common_;
    cholmod_factor* factor_ = nullptr;
    std::int64_t fill_ = 0;
};

// The graph of A + A^T with all unknowns of a node made one: entry (i, j) when a pair of their unknowns has one.
Matrix node_graph(const Matrix& A, const std::vector<int>& node_of_unknown, int nodes) {
    std::vector<std::vector<int>> unknowns(nodes);
    for (int i = 0; i < A.cols(); ++i) unknowns[node_of_unknown[i]].push_back(i);
    Matrix graph(nodes, nodes);
    std::vector<int> last_column(nodes, -1);  // that had an entry in this row
    for (int column = 0; column < nodes; ++column) {
        graph.startVec(column);
        for (const int j : unknowns[column])
            for (Matrix::InnerIterator entry(A, j); entry; ++entry) {
                const int row = node_of_unknown[entry.row()];
                if (last_column[row] == column) continue;
                last_column[row] = column;
                graph.insertBackByOuterInnerUnordered(column, row) = 1;
            }
    }
    graph.finalize();
    // Transposing sorts the rows, too.
    const Matrix transposed = graph.transpose();
    return transposed + Matrix(transposed.transpose());
}

int count_nodes(const Matrix& A, const std::vector<int>& node_of_unknown) {
    if (static_cast<Eigen::Index>(node_of_unknown.size()) != A.cols())
        throw std::invalid_argument(
            fmt::format("nodes of {} unknowns for a matrix of size {}", node_of_unknown.size(), A.cols()));
    const auto [least, largest] = std::minmax_element(node_of_unknown.begin(), node_of_unknown.end());
    if (*least < 0 || *largest >= A.cols())
        throw std::invalid_argument(
            fmt::format("nodes from {} to {} for a matrix of size {}", *least, *largest, A.cols()));
    return *largest + 1;
}

}  // namespace

cholmod_sparse lower_triangle(const Matrix& A) {
    cholmod_sparse view{};
    view.nrow = view.ncol = static_cast<std::size_t>(A.cols());
    view.nzmax = static_cast<std::size_t>(A.nonZeros());
    view.p = const_cast<int*>(A.outerIndexPtr());
    view.i = const_cast<int*>(A.innerIndexPtr());
    view.x = const_cast<double*>(A.valuePtr());
    view.stype = -1;
    view.itype = CHOLMOD_INT;
    view.xtype = CHOLMOD_REAL;
    view.dtype = CHOLMOD_DOUBLE;
    view.sorted = view.packed = 1;
    return view;
}

void require_ordering(const Ordering& ordering, int size) {
    if (ordering.empty()) return;
    if (static_cast<int>(ordering.size()) != size)
        throw std::invalid_argument(
            fmt::format("ordering of {} unknowns for a matrix of size {}", ordering.size(), size));
    std::vector<bool> found(ordering.size());
    for (const int i : ordering) {
        if (i < 0 || i >= size || found[i])
            throw std::invalid_argument(
                fmt::format("ordering is not a permutation: {} of {} is repeated or out of range", i, size));
        found[i] = true;
    }
}

Ordering nested_dissection(const Matrix& A, const std::vector<int>& node_of_unknown) {
    if (A.rows() != A.cols() || A.rows() == 0)
        throw std::invalid_argument(
            fmt::format("nested_dissection needs a square matrix, not {} x {}", A.rows(), A.cols()));
    std::vector<int> node = node_of_unknown;
    if (node.empty()) {
        node.resize(A.cols());
        std::iota(node.begin(), node.end(), 0);
    }
    const int nodes = count_nodes(A, node);
    const Matrix graph = node_graph(A, node, nodes);
    cholmod_sparse view = lower_triangle(graph);
    CholmodCommon common;
    Ordering node_at(nodes);
    if (!cholmod_metis(&view, nullptr, 0, /*postorder*/ 1, node_at.data(), &common))
        throw SolveError(fmt::format("METIS failed on {} nodes (status {})", nodes, common.status));
    std::vector<int> position(nodes);
    for (int k = 0; k < nodes; ++k) position[node_at[k]] = k;
    Ordering ordering(A.cols());
    std::iota(ordering.begin(), ordering.end(), 0);
    std::stable_sort(ordering.begin(), ordering.end(),
                     [&](int i, int j) { return position[node[i]] < position[node[j]]; });
    return ordering;
}

SparseCholesky::SparseCholesky(Ordering ordering)
    : SparseSolver("SparseCholesky", std::make_unique<Cholmod>(std::move(ordering))) {}

}  // namespace tubule
