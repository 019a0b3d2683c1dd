#include "common/solve/sparse_ldlt.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <numeric>
#include <type_traits>
#include <vector>

#include "common/solve/blas.hpp"
#include "common/solve/memory.hpp"
#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse_front.hpp"
#include "common/solve/sparse_supernodes.hpp"

namespace tubule {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;
using std::ptrdiff_t;

// Multiplications from which on a second thread is worth waking: they take about ten times as long as that.
constexpr double worth_a_thread = 5e5;

double multiplications(double rows, double columns) {
    return columns * (rows * (rows - columns) + columns * columns / 3);
}

// Supernodes in the order in which they may be eliminated one after the other: `subtrees` need nothing of each other,
// `top` needs them all.
struct Schedule {
    std::vector<std::vector<int>> subtrees;
    std::vector<int> top;
    double work = 0;
};

// A supernode with more than this part of all work below it is eliminated by all threads together. The number of
// threads has no part in it, so that answers do not depend on it.
constexpr double large_part = 1.0 / 12;

Schedule schedule(const Supernodes& tree) {
    const int count = tree.count();
    std::vector<double> work(count);
    double all = 0;
    for (int s = 0; s < count; ++s) {
        const double m = tree.rows_of(s), own = multiplications(m, tree.columns_of(s)) + m * m;
        all += own;
        work[s] += own;
        if (tree.parent[s] >= 0) work[tree.parent[s]] += work[s];
    }
    Schedule out{.subtrees = {}, .top = {}, .work = all};
    std::vector<int> subtree(count, -1);
    for (int s = count - 1; s >= 0; --s) {
        const int parent = tree.parent[s];
        if (work[s] > large_part * all) {
            out.top.push_back(s);
        } else if (parent >= 0 && subtree[parent] >= 0) {
            subtree[s] = subtree[parent];
            out.subtrees[subtree[s]].push_back(s);
        } else {
            subtree[s] = static_cast<int>(out.subtrees.size());
            out.subtrees.push_back({s});
        }
    }
    std::reverse(out.top.begin(), out.top.end());
    for (auto& s : out.subtrees) std::reverse(s.begin(), s.end());
    // The largest first, so that no thread starts it last.
    std::stable_sort(out.subtrees.begin(), out.subtrees.end(),
                     [&](const auto& a, const auto& b) { return work[a.back()] > work[b.back()]; });
    return out;
}

// Offsets of the update matrices of supernodes in one array, in which later ones overwrite those no longer needed.
// Within a group they form two stacks, one for supernodes of even depth and one for odd depth: a parent and its
// children, which are in use at the same time, are on different stacks. The matrix of a group's root is kept.
struct UpdateStorage {
    std::vector<ptrdiff_t> at;
    ptrdiff_t size = 0;
};

UpdateStorage place_updates(const Supernodes& tree, const Schedule& groups) {
    const int count = tree.count();
    std::vector<int> depth(count), group(count, -1);
    for (int s = count - 1; s >= 0; --s) depth[s] = tree.parent[s] < 0 ? 0 : depth[tree.parent[s]] + 1;
    for (int g = 0; g < static_cast<int>(groups.subtrees.size()); ++g)
        for (const int s : groups.subtrees[g]) group[s] = g;
    UpdateStorage out{.at = std::vector<ptrdiff_t>(count)};
    std::vector<ptrdiff_t> children(count);  // total size of those in the same group
    const auto place = [&](const std::vector<int>& members) {
        std::array<ptrdiff_t, 2> top{}, highest{};
        for (const int s : members) {
            const ptrdiff_t below = tree.rows_of(s) - tree.columns_of(s);
            const int side = depth[s] % 2;
            out.at[s] = top[side];
            top[side] += below * below;
            highest[side] = std::max(highest[side], top[side]);
            top[1 - side] -= children[s];
            const int parent = tree.parent[s];
            if (parent >= 0 && group[parent] == group[s]) children[parent] += below * below;
        }
        for (const int s : members) out.at[s] += out.size + (depth[s] % 2 ? highest[0] : 0);
        out.size += highest[0] + highest[1];
    };
    for (const auto& members : groups.subtrees) place(members);
    place(groups.top);
    return out;
}

// Which entries of A make up each entry of the symmetric part's lower triangle, in the order of elimination.
struct Sources {
    struct Entry {
        int place;         // its row, as the number among the rows of the supernode
        int one, another;  // entries of A, the mean of which it is; -1 for a zero
    };
    std::vector<ptrdiff_t> begin;  // of each column
    std::vector<Entry> entries;
    std::vector<int> diagonal;  // for each column, its entry of A or -1
};

Sources find_sources(const Supernodes& tree, const int* outer, const int* inner) {
    const int n = tree.size;
    std::vector<int> number(outer[n]), position(n), place(n), entry_of(n, -1);
    std::iota(number.begin(), number.end(), 0);
    for (int k = 0; k < n; ++k) position[tree.order[k]] = k;
    const Eigen::SparseMatrix<int> across =
        Eigen::Map<const Eigen::SparseMatrix<int>>(n, n, outer[n], outer, inner, number.data()).transpose();
    Sources out{.begin = {0}, .entries = {}, .diagonal = std::vector<int>(n, -1)};
    for (int s = 0; s < tree.count(); ++s) {
        for (auto i = tree.row_begin[s]; i < tree.row_begin[s + 1]; ++i)
            place[tree.rows[i]] = static_cast<int>(i - tree.row_begin[s]);
        for (int column = tree.column[s]; column < tree.column[s + 1]; ++column) {
            const int j = tree.order[column];
            const auto begin = static_cast<int>(out.begin.back());
            for (int k = outer[j]; k < outer[j + 1]; ++k) {
                const int row = position[inner[k]];
                if (row < column) continue;
                if (row == column) out.diagonal[column] = k;
                entry_of[row] = static_cast<int>(out.entries.size());
                out.entries.push_back({place[row], k, -1});
            }
            for (Eigen::SparseMatrix<int>::InnerIterator k(across, j); k; ++k) {
                const int row = position[k.row()];
                if (row < column) continue;
                if (entry_of[row] >= begin)
                    out.entries[entry_of[row]].another = k.value();
                else
                    out.entries.push_back({place[row], k.value(), -1});
            }
            out.begin.push_back(static_cast<ptrdiff_t>(out.entries.size()));
        }
    }
    return out;
}

}  // namespace

// Many fields: what is found once for a pattern, then what is computed for its values.
template <class Scalar>
struct SparseLdlt<Scalar>::Impl {
    // Smaller pivots, after scaling, are taken for rounding.
    static constexpr double smallest_pivot = std::is_same_v<Scalar, float> ? 1e-6 : 1e-12;

    using Block = Eigen::Map<Eigen::Matrix<Scalar, Eigen::Dynamic, 1>>;
    using Panel = Eigen::Map<const Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>>;

    Ordering ordering;
    double regularisation;

    std::vector<int> outer, inner;  // the pattern analysed
    Supernodes tree;
    Schedule groups;
    UpdateStorage updates;
    Sources sources;
    std::vector<std::vector<int>> children;
    std::vector<ptrdiff_t> panel_at;                // of each supernode, in `panels`
    std::unique_ptr<Scalar[]> panels, update_data;  // L with D on its diagonal; update matrices
    ptrdiff_t scratch_size = 0;
    std::vector<std::unique_ptr<Scalar[]>> scratch;  // one a thread

    Vector scale;                           // of columns
    std::vector<Elimination> eliminations;  // of supernodes
    mutable std::vector<Scalar> solution, carried;

    bool factored = false;
    Pivots pivots;
    Counters counters;

    Impl(Ordering ordering, double regularisation) : ordering(std::move(ordering)), regularisation(regularisation) {}

    bool knows_pattern(const View& A) const {
        return static_cast<ptrdiff_t>(outer.size()) == A.cols + 1 && std::equal(outer.begin(), outer.end(), A.outer) &&
               std::memcmp(inner.data(), A.inner, inner.size() * sizeof(int)) == 0;
    }

    void analyse(const View& A) {
        outer.clear();
        const Eigen::Map<const Matrix> matrix(A.rows, A.cols, A.outer[A.cols], A.outer, A.inner, A.value);
        tree = find_supernodes(matrix, ordering);
        groups = schedule(tree);
        updates = place_updates(tree, groups);
        sources = find_sources(tree, A.outer, A.inner);
        children.assign(tree.count(), {});
        panel_at.assign(1, 0);
        scratch_size = 0;
        for (int s = 0; s < tree.count(); ++s) {
            if (tree.parent[s] >= 0) children[tree.parent[s]].push_back(s);
            const ptrdiff_t size = ptrdiff_t{tree.rows_of(s)} * tree.columns_of(s);
            panel_at.push_back(panel_at.back() + size);
            scratch_size = std::max(scratch_size, size);
        }
        const auto entries = static_cast<double>(panel_at.back() + updates.size + loop_threads() * scratch_size);
        require_memory(entries * sizeof(Scalar), fmt::format("the factors of a matrix of size {}", tree.size));
        panels.reset(new Scalar[panel_at.back()]);
        update_data.reset(new Scalar[updates.size]);
        scratch.clear();
        solution.resize(tree.size);
        carried.resize(tree.rows.size());
        scale.resize(tree.size);
        inner.assign(A.inner, A.inner + A.outer[A.cols]);
        outer.assign(A.outer, A.outer + A.cols + 1);
        ++counters.analysed;
    }

    Front<Scalar> front(int s) const {
        return {tree.rows_of(s), tree.columns_of(s), panels.get() + panel_at[s], update_data.get() + updates.at[s]};
    }

    void find_scale(const View& A) {
        std::vector<int> without;  // a diagonal
        Vector by_unknown(tree.size);
        for (int column = 0; column < tree.size; ++column) {
            const int k = sources.diagonal[column];
            const double diagonal = k < 0 ? 0 : std::abs(A.value[k]);
            if (diagonal == 0) without.push_back(column);
            scale[column] = diagonal == 0 ? 0 : 1 / std::sqrt(diagonal);
            by_unknown[tree.order[column]] = scale[column];
        }
        // What they have on the diagonal once all others are eliminated, would these not be coupled.
        for (const int column : without) {
            const int j = tree.order[column];
            double sum = 0;
            for (int k = A.outer[j]; k < A.outer[j + 1]; ++k) {
                const double a = A.value[k] * by_unknown[A.inner[k]];
                sum += a * a;
            }
            if (!(sum > 0)) {
                require_finite(A);
                throw SolveError(
                    fmt::format("matrix of size {} is singular or not a saddle point: unknown {} has no "
                                "entry on the diagonal and none with an unknown that has one",
                                tree.size, j));
            }
            scale[column] = 1 / std::sqrt(sum);
        }
    }

    void insert_matrix(const View& A, int s, const Front<Scalar>& f) const {
        const int* const rows = tree.rows.data() + tree.row_begin[s];
        for (int j = 0; j < f.columns; ++j) {
            const int column = tree.column[s] + j;
            Scalar* const to = f.panel + ptrdiff_t{j} * f.rows;
            for (auto e = sources.begin[column]; e < sources.begin[column + 1]; ++e) {
                const Sources::Entry& from = sources.entries[e];
                const double sum = A.value[from.one] + (from.another < 0 ? 0 : A.value[from.another]);
                to[from.place] = static_cast<Scalar>(0.5 * sum * scale[column] * scale[rows[from.place]]);
            }
            const int k = sources.diagonal[column];
            if (k < 0 || A.value[k] == 0) to[j] = static_cast<Scalar>(-regularisation);
        }
    }

    void add_child(int child, const Front<Scalar>& f, bool parallel) const {
        const int below = tree.rows_of(child) - tree.columns_of(child);
        const int* const place = tree.place_in_parent.data() + tree.row_begin[child] + tree.columns_of(child);
        const Scalar* const from = update_data.get() + updates.at[child];
        const ptrdiff_t left = f.rows - f.columns;
        const auto add_column = [&](ptrdiff_t j) {
            const Scalar* const column = from + j * below;
            Scalar* const to = place[j] < f.columns ? f.panel + ptrdiff_t{place[j]} * f.rows
                                                    : f.update + (place[j] - f.columns) * left - f.columns;
            for (ptrdiff_t i = j; i < below; ++i) to[place[i]] += column[i];
        };
        parallel_for(static_cast<std::size_t>(below), add_column, parallel);
    }

    void eliminate_supernode(const View& A, int s, int thread, bool parallel) {
        const Front<Scalar> f = front(s);
        const ptrdiff_t left = f.rows - f.columns;
        std::fill_n(f.panel, ptrdiff_t{f.rows} * f.columns, Scalar(0));
        insert_matrix(A, s, f);
        for (ptrdiff_t j = 0; j < left; ++j) std::fill_n(f.update + j * left + j, left - j, Scalar(0));
        for (const int child : children[s]) add_child(child, f, parallel);
        auto& own = scratch[thread];
        if (!own) own.reset(new Scalar[scratch_size]);
        eliminations[s] = eliminate(f, own.get(), smallest_pivot, parallel);
    }

    void eliminate_all(const View& A) {
        if (static_cast<int>(scratch.size()) < loop_threads()) scratch.resize(loop_threads());
        eliminations.assign(tree.count(), {});
        // Once a pivot has failed, or it is time to pause, the rest is of no use.
        std::atomic<bool> failed = false;
        SharedPause pause;
        const auto subtree = [&](std::size_t g, int thread) {
            for (const int s : groups.subtrees[g]) {
                if (failed || pause.look(s)) break;
                eliminate_supernode(A, s, thread, false);
                if (eliminations[s].failed >= 0) failed = true;
            }
        };
        parallel_for(groups.subtrees.size(), subtree, groups.work > worth_a_thread);
        for (const int s : groups.top) {
            if (failed || pause.look()) break;
            eliminate_supernode(A, s, 0, multiplications(tree.rows_of(s), tree.columns_of(s)) > worth_a_thread);
            failed = eliminations[s].failed >= 0;
        }
        pause.check();
        if (failed) report_failure(A);
    }

    static void require_finite(const View& A) {
        for (int j = 0; j < A.cols; ++j)
            for (int k = A.outer[j]; k < A.outer[j + 1]; ++k)
                if (!std::isfinite(A.value[k]))
                    throw SolveError(fmt::format("matrix entry ({}, {}) is {}", A.inner[k], j, A.value[k]));
    }

    [[noreturn]] void report_failure(const View& A) const {
        require_finite(A);
        int s = 0;
        while (eliminations[s].failed < 0) ++s;
        const Elimination& found = eliminations[s];
        throw SolveError(
            fmt::format("matrix of size {} is singular or not quasi-definite: pivot {:.1e} for unknown {}, "
                        "with diagonals scaled to 1",
                        tree.size, found.failed_pivot, tree.order[tree.column[s] + found.failed]));
    }

    // The rows of the solution that belong to supernode s hold y = L^-1 b afterwards, `carried` what its rows below
    // subtract from the right-hand side.
    void solve_forward(int s) const {
        const int m = tree.rows_of(s), n = tree.columns_of(s);
        Block own(solution.data() + tree.column[s], n), below(carried.data() + tree.row_begin[s] + n, m - n);
        below.setZero();
        for (const int child : children[s]) {
            const Scalar* const from = carried.data() + tree.row_begin[child];
            const int* const place = tree.place_in_parent.data() + tree.row_begin[child];
            for (int i = tree.columns_of(child); i < tree.rows_of(child); ++i)
                (place[i] < n ? own[place[i]] : below[place[i] - n]) += from[i];
        }
        const Panel L(panels.get() + panel_at[s], m, n);
        L.topRows(n).template triangularView<Eigen::UnitLower>().solveInPlace(own);
        below.noalias() -= L.bottomRows(m - n) * own;
    }

    void solve_backward(int s) const {
        const int m = tree.rows_of(s), n = tree.columns_of(s);
        Block own(solution.data() + tree.column[s], n), below(carried.data() + tree.row_begin[s] + n, m - n);
        const int* const row = tree.rows.data() + tree.row_begin[s] + n;
        for (int i = 0; i < m - n; ++i) below[i] = solution[row[i]];
        const Panel L(panels.get() + panel_at[s], m, n);
        own.array() /= L.diagonal().array();
        own.noalias() -= L.bottomRows(m - n).transpose() * below;
        L.topRows(n).transpose().template triangularView<Eigen::UnitUpper>().solveInPlace(own);
    }

    void solve_all() const {
        const bool parallel = static_cast<double>(counters.fill) > worth_a_thread;
        const auto forward = [&](std::size_t g) {
            for (const int s : groups.subtrees[g]) solve_forward(s);
        };
        const auto backward = [&](std::size_t g) {
            for (auto s = groups.subtrees[g].rbegin(); s != groups.subtrees[g].rend(); ++s) solve_backward(*s);
        };
        parallel_for(groups.subtrees.size(), forward, parallel);
        for (const int s : groups.top) solve_forward(s);
        for (auto s = groups.top.rbegin(); s != groups.top.rend(); ++s) solve_backward(*s);
        parallel_for(groups.subtrees.size(), backward, parallel);
    }
};

template <class Scalar>
SparseLdlt<Scalar>::SparseLdlt(Ordering ordering, double regularisation)
    : impl_(new Impl(std::move(ordering), regularisation)) {
    prepare_blas(loop_threads());
}
template <class Scalar>
SparseLdlt<Scalar>::SparseLdlt(SparseLdlt&&) noexcept = default;
template <class Scalar>
SparseLdlt<Scalar>& SparseLdlt<Scalar>::operator=(SparseLdlt&&) noexcept = default;
template <class Scalar>
SparseLdlt<Scalar>::~SparseLdlt() = default;

template <class Scalar>
void SparseLdlt<Scalar>::factor(const View& A) {
    Impl& s = *impl_;
    s.factored = false;
    if (A.rows != A.cols || A.rows == 0)
        throw std::invalid_argument(fmt::format("SparseLdlt needs a square matrix, not {} x {}", A.rows, A.cols));
    if (!s.knows_pattern(A)) s.analyse(A);
    s.find_scale(A);
    s.eliminate_all(A);
    s.pivots = {.negative = 0, .smallest = 1e300, .growth = 0};
    for (const Elimination& e : s.eliminations) {
        s.pivots.negative += e.negative;
        s.pivots.smallest = std::min(s.pivots.smallest, e.smallest);
        s.pivots.growth = std::max(s.pivots.growth, e.growth);
    }
    ++s.counters.factored;
    s.counters.fill = s.panel_at.back();
    s.factored = true;
}

template <class Scalar>
void SparseLdlt<Scalar>::solve(const Vector& b, Vector& x) const {
    const Impl& s = *impl_;
    if (!s.factored) throw std::logic_error("SparseLdlt::solve needs factors: call factor() first");
    const int n = s.tree.size;
    if (b.size() != n)
        throw std::invalid_argument(fmt::format("right-hand side of size {} for a matrix of size {}", b.size(), n));
    if (!b.allFinite()) throw SolveError(fmt::format("right-hand side for a matrix of size {} is not finite", n));
    for (int k = 0; k < n; ++k) s.solution[k] = static_cast<Scalar>(b[s.tree.order[k]] * s.scale[k]);
    s.solve_all();
    x.resize(n);
    for (int k = 0; k < n; ++k) x[s.tree.order[k]] = s.solution[k] * s.scale[k];
    if (!x.allFinite()) throw SolveError(fmt::format("solution of size {} is not finite", n));
}

template <class Scalar>
const typename SparseLdlt<Scalar>::Pivots& SparseLdlt<Scalar>::pivots() const {
    return impl_->pivots;
}

template <class Scalar>
const typename SparseLdlt<Scalar>::Counters& SparseLdlt<Scalar>::counters() const {
    return impl_->counters;
}

template class SparseLdlt<float>;
template class SparseLdlt<double>;

}  // namespace tubule
