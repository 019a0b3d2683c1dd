#include "common/solve/sparse.hpp"

#include <fmt/core.h>
#include <omp.h>

#include <Eigen/KLUSupport>
#include <Eigen/LU>
#include <Eigen/UmfPackSupport>
#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <numeric>

#include "common/solve/blas.hpp"
#include "common/solve/memory.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse_cholmod.hpp"

namespace tubule {

using Matrix = Eigen::SparseMatrix<double>;
using Dense = Eigen::MatrixXd;

// A library, and the matrix that it was given last: square, compressed and finite. Failures are SolveErrors.
struct SparseEngine {
    virtual ~SparseEngine() = default;
    virtual void analyse() = 0;  // the pattern
    virtual void factor() = 0;
    virtual bool refactor() { return false; }  // with the pivots of the last factor(); false when that is not wise
    virtual Dense solved(const Dense& B, bool transposed) const = 0;
    virtual double pivot_ratio() = 0;  // smallest to largest: a cheap hint at the condition

    Matrix A;
    bool analysed = false, factored = false;
    SparseSolver::Counters counters;
};

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
// Below this the ratio of the pivots is worth the price of a real condition estimate.
constexpr double suspicious_pivot_ratio = 1e-12;

[[noreturn]] void fail(const char* library, Eigen::Index size, int status) {
    throw SolveError(fmt::format("{} cannot factor the matrix of size {} (status {})", library, size, status));
}

class Klu final : public SparseEngine, Eigen::KLU<Matrix> {
    static constexpr double tolerated_growth = 100;  // of factors by old pivots, relative to that by fresh ones
    static constexpr double bytes_per_entry = 12;    // of factors: a value and a row

public:
    void analyse() override {
        analyzePattern(A);
        require_success();
        require_factors(bytes_per_entry * (m_symbolic->lnz + m_symbolic->unz), m_symbolic->est_flops / 2, A.cols());
    }
    void factor() override {
        factorize(A);
        require_success();
        fresh_growth_ = growth();
        counters.fill = std::int64_t{m_numeric->lnz} + m_numeric->unz + m_numeric->nzoff;
    }
    bool refactor() override {
        return m_numeric &&
               klu_refactor(A.outerIndexPtr(), A.innerIndexPtr(), A.valuePtr(), m_symbolic, m_numeric, &m_common) &&
               m_common.status == KLU_OK && growth() * tolerated_growth >= fresh_growth_;
    }
    Dense solved(const Dense& B, bool transposed) const override {
        if (!transposed) return solve(B);
        Dense X = B;
        auto common = m_common;
        klu_tsolve(m_symbolic, m_numeric, static_cast<int>(B.rows()), static_cast<int>(B.cols()), X.data(), &common);
        return X;
    }
    double pivot_ratio() override {
        klu_rcond(m_symbolic, m_numeric, &m_common);
        return m_common.rcond;
    }

private:
    double growth() {
        klu_rgrowth(A.outerIndexPtr(), A.innerIndexPtr(), A.valuePtr(), m_symbolic, m_numeric, &m_common);
        return m_common.rgrowth;
    }
    void require_success() const {
        if (info() == Eigen::Success && m_common.status == KLU_OK) return;
        if (m_common.status == KLU_SINGULAR)
            throw SolveError(
                fmt::format("matrix of size {} is singular: no pivot in column {}", A.cols(), m_common.singular_col));
        if (m_common.status == KLU_OUT_OF_MEMORY) throw std::bad_alloc();
        fail("KLU", A.cols(), m_common.status);
    }

    double fresh_growth_ = 1;  // growth() of the last factorisation with fresh pivots
};

class Umfpack final : public SparseEngine, Eigen::UmfPackLU<Matrix> {
public:
    explicit Umfpack(Ordering ordering) : ordering_(std::move(ordering)) {
        prepare_blas(1);
        // By itself UMFPACK takes the zero diagonal of a saddle point for a reason to be unsymmetric, which costs.
        m_control[UMFPACK_STRATEGY] = UMFPACK_STRATEGY_SYMMETRIC;
        m_control[UMFPACK_IRSTEP] = 0;  // SparseSolver refines
    }
    // Eigen does not hand orderings on. No values: the analysis has to serve later ones, too.
    void analyse() override {
        const int n = static_cast<int>(A.cols());
        const Ordering ordering = ordering_.empty() ? nested_dissection(A) : ordering_;
        require_ordering(ordering, n);
        umfpack_di_free_symbolic(&m_symbolic);
        m_fact_errorCode = umfpack_di_qsymbolic(n, n, A.outerIndexPtr(), A.innerIndexPtr(), nullptr, ordering.data(),
                                                &m_symbolic, m_control.data(), m_umfpackInfo.data());
        require_success();
        m_isInitialized = true;
        m_analysisIsOk = true;
        require_memory(m_umfpackInfo[UMFPACK_PEAK_MEMORY_ESTIMATE] * m_umfpackInfo[UMFPACK_SIZE_OF_UNIT],
                       fmt::format("the factors of a matrix of size {}", n));
    }
    void factor() override {
        factorize(A);
        require_success();
        counters.fill = static_cast<std::int64_t>(m_umfpackInfo[UMFPACK_LNZ] + m_umfpackInfo[UMFPACK_UNZ]);
    }
    Dense solved(const Dense& B, bool transposed) const override {
        if (!transposed) return solve(B);
        Dense X(B.rows(), B.cols());
        for (Eigen::Index j = 0; j < B.cols(); ++j)
            umfpack_di_solve(UMFPACK_At, A.outerIndexPtr(), A.innerIndexPtr(), A.valuePtr(), X.col(j).data(),
                             B.col(j).data(), m_numeric, m_control.data(), m_umfpackInfo.data());
        return X;
    }
    double pivot_ratio() override { return m_umfpackInfo[UMFPACK_RCOND]; }

private:
    void require_success() const {
        if (m_fact_errorCode == UMFPACK_OK) return;
        if (m_fact_errorCode == UMFPACK_WARNING_singular_matrix)
            throw SolveError(fmt::format("matrix of size {} is singular: {} pivots are zero", A.cols(),
                                         A.cols() - static_cast<int>(m_umfpackInfo[UMFPACK_UDIAG_NZ])));
        if (m_fact_errorCode == UMFPACK_ERROR_out_of_memory)
            throw SolveError(
                fmt::format("factors of a matrix of size {} exceed the memory or UMFPACK's 32-bit sizes; "
                            "an ordering by nodes needs less",
                            A.cols()));
        fail("UMFPACK", A.cols(), m_fact_errorCode);
    }

    Ordering ordering_;
};

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

class Cholmod final : public SparseEngine, Eigen::CholmodDecomposition<Matrix> {
    static constexpr double bytes_per_entry = 14;  // of factors, measured

public:
    Cholmod() {
        prepare_blas(1);
        cholmod().print = 0;
        cholmod().nmethods = 1;
        cholmod().method[0].ordering = CHOLMOD_AMD;
        cholmod().final_ll = 1;  // LDL^T, the other choice for little fill, would go through indefinite matrices
        cholmod().quick_return_if_not_posdef = 1;
    }
    void analyse() override {
        if (!A.isApprox(Matrix(A.transpose()), 1e-10))
            throw SolveError(fmt::format("matrix of size {} is not symmetric", A.cols()));
        analyzePattern(A);
        require_success();
        counters.fill = static_cast<std::int64_t>(cholmod().lnz);
        require_factors(bytes_per_entry * cholmod().lnz, cholmod().fl / 2, A.cols());
    }
    void factor() override {
        const OneThread one_thread;
        factorize(A);
        if (cholmod().status == CHOLMOD_NOT_POSDEF)
            throw SolveError(fmt::format("matrix of size {} is not positive definite: no positive pivot for unknown {}",
                                         A.cols(),
                                         static_cast<const int*>(m_cholmodFactor->Perm)[m_cholmodFactor->minor]));
        require_success();
    }
    Dense solved(const Dense& B, bool) const override { return solve(B); }
    double pivot_ratio() override { return cholmod_rcond(m_cholmodFactor, &cholmod()); }

private:
    void require_success() {
        if (cholmod().status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
        if (!m_cholmodFactor || cholmod().status < CHOLMOD_OK) fail("CHOLMOD", A.cols(), cholmod().status);
    }
};

// What Eigen's estimate of |A^-1|_1 asks of a decomposition (N. J. Higham, Accuracy and Stability of Numerical
// Algorithms, algorithm 15.4).
struct Inverse {
    using MatrixType = Dense;
    using Scalar = double;
    using RealScalar = double;
    const SparseEngine& engine;
    bool transposed = false;
    Eigen::Index rows() const { return engine.A.rows(); }
    Eigen::Index cols() const { return rows(); }
    Inverse adjoint() const { return {engine, !transposed}; }
    Eigen::VectorXd solve(const Eigen::VectorXd& b) const { return engine.solved(b, transposed); }
};

bool same_pattern(const Matrix& a, const Matrix& b) {
    return a.cols() == b.cols() && a.nonZeros() == b.nonZeros() &&
           std::equal(a.outerIndexPtr(), a.outerIndexPtr() + a.cols() + 1, b.outerIndexPtr()) &&
           std::equal(a.innerIndexPtr(), a.innerIndexPtr() + a.nonZeros(), b.innerIndexPtr());
}

void require_finite(const Matrix& A) {
    for (int column = 0; column < A.cols(); ++column)
        for (Matrix::InnerIterator entry(A, column); entry; ++entry)
            if (!std::isfinite(entry.value()))
                throw SolveError(fmt::format("matrix entry ({}, {}) is {}", entry.row(), column, entry.value()));
}

void require_well_conditioned(SparseEngine& engine) {
    if (engine.pivot_ratio() >= suspicious_pivot_ratio) return;
    double norm = 0;  // |A|_1
    for (int column = 0; column < engine.A.cols(); ++column)
        norm = std::max(norm, engine.A.col(column).cwiseAbs().sum());
    const double reciprocal = Eigen::internal::rcond_estimate_helper(norm, Inverse{engine});
    if (!(reciprocal > epsilon))
        throw SolveError(fmt::format("matrix of size {} is nearly singular: condition number about {:.1e}",
                                     engine.A.cols(), 1 / reciprocal));
}

void require_square(const Matrix& A) {
    if (A.rows() != A.cols() || A.rows() == 0)
        throw std::invalid_argument(fmt::format("a solver needs a square matrix, not {} x {}", A.rows(), A.cols()));
}

}  // namespace

SparseSolver::SparseSolver(std::unique_ptr<SparseEngine> engine) : engine_(std::move(engine)) {}
SparseSolver::SparseSolver(SparseSolver&&) noexcept = default;
SparseSolver& SparseSolver::operator=(SparseSolver&&) noexcept = default;
SparseSolver::~SparseSolver() = default;

SparseLu::SparseLu() : SparseSolver(std::make_unique<Klu>()) {}
SparseLuLarge::SparseLuLarge(Ordering ordering) : SparseSolver(std::make_unique<Umfpack>(std::move(ordering))) {}
SparseCholesky::SparseCholesky() : SparseSolver(std::make_unique<Cholmod>()) {}

void SparseSolver::factor(const Matrix& A) {
    SparseEngine& s = *engine_;
    s.factored = false;
    require_square(A);
    if (!A.isCompressed()) {
        Matrix compressed = A;
        compressed.makeCompressed();
        return factor(compressed);
    }
    check_pause();
    require_finite(A);
    const bool known = s.analysed && same_pattern(s.A, A);
    s.A = A;
    if (!known) {
        s.analysed = false;
        s.analyse();
        s.analysed = true;
        ++s.counters.analysed;
    }
    if (s.refactor()) {
        ++s.counters.refactored;
    } else {
        s.factor();
        ++s.counters.factored;
    }
    require_well_conditioned(s);
    s.factored = true;
}

void SparseSolver::solve_in_place(Eigen::Ref<Dense> X, int refinements) const {
    const SparseEngine& s = *engine_;
    if (!s.factored) throw std::logic_error("SparseSolver::solve needs factors: call factor() first");
    const Dense B = X;
    if (B.rows() != s.A.cols())
        throw std::invalid_argument(
            fmt::format("right-hand side of size {} for a matrix of size {}", B.rows(), s.A.cols()));
    if (!B.allFinite())
        throw SolveError(fmt::format("right-hand side for a matrix of size {} is not finite", B.rows()));
    X = s.solved(B, false);
    for (int i = 0; i < refinements; ++i) X += s.solved(B - s.A * X, false);
    if (!X.allFinite()) throw SolveError(fmt::format("solution of size {} is not finite", B.rows()));
}

const SparseSolver::Counters& SparseSolver::counters() const {
    return engine_->counters;
}

void require_ordering(const Ordering& ordering, Eigen::Index size) {
    Ordering sorted = ordering, all(size);
    std::sort(sorted.begin(), sorted.end());
    std::iota(all.begin(), all.end(), 0);
    if (sorted != all)
        throw std::invalid_argument(
            fmt::format("ordering of {} unknowns is not a permutation of {}", ordering.size(), size));
}

Ordering nested_dissection(const Matrix& A, const std::vector<int>& node_of_unknown) {
    require_square(A);
    Ordering ordering(A.cols());
    std::iota(ordering.begin(), ordering.end(), 0);
    const std::vector<int>& node = node_of_unknown.empty() ? ordering : node_of_unknown;
    const auto [least, largest] = std::minmax_element(node.begin(), node.end());
    if (static_cast<Eigen::Index>(node.size()) != A.cols() || *least < 0 || *largest >= A.cols())
        throw std::invalid_argument(
            fmt::format("{} nodes from {} to {} for a matrix of size {}", node.size(), *least, *largest, A.cols()));
    // The graph of the nodes, its lower triangle: an entry where a pair of their unknowns has one.
    std::vector<std::vector<int>> unknowns(*largest + 1);
    for (int i = 0; i < A.cols(); ++i) unknowns[node[i]].push_back(i);
    std::vector<int> last_column(unknowns.size(), -1);  // that had an entry in this row
    std::vector<Eigen::Triplet<double>> pairs;
    for (int column = 0; column <= *largest; ++column)
        for (const int j : unknowns[column])
            for (Matrix::InnerIterator entry(A, j); entry; ++entry) {
                const int row = node[entry.row()];
                if (std::exchange(last_column[row], column) != column)
                    pairs.emplace_back(std::max(row, column), std::min(row, column), 1);
            }
    Matrix graph(*largest + 1, *largest + 1);
    graph.setFromTriplets(pairs.begin(), pairs.end());
    cholmod_sparse view = Eigen::viewAsCholmod(std::as_const(graph).selfadjointView<Eigen::Lower>());
    CholmodCommon common;
    std::vector<int> node_at(graph.cols()), position(graph.cols());
    if (!cholmod_metis(&view, nullptr, 0, /*postorder*/ 1, node_at.data(), &common))
        throw SolveError(fmt::format("METIS failed on {} nodes (status {})", node_at.size(), common.status));
    for (std::size_t k = 0; k < node_at.size(); ++k) position[node_at[k]] = static_cast<int>(k);
    std::vector<int> by_unknown;
    for (const int n : node) by_unknown.push_back(position[n]);
    std::stable_sort(ordering.begin(), ordering.end(), [&](int i, int j) { return by_unknown[i] < by_unknown[j]; });
    return ordering;
}

Eigen::SparseMatrix<double> bordered(const Eigen::SparseMatrix<double>& A, const Eigen::MatrixXd& columns,
                                     const Eigen::MatrixXd& rows, const Eigen::MatrixXd& corner) {
    const int n = static_cast<int>(A.cols()), more = static_cast<int>(columns.cols());
    Eigen::SparseMatrix<double> out(n + more, n + more);
    out.reserve(A.nonZeros() + 2 * more * n + more * more);
    for (int j = 0; j < n + more; ++j) {
        out.startVec(j);
        if (j < n)
            for (Eigen::SparseMatrix<double>::InnerIterator it(A, j); it; ++it)
                out.insertBack(it.row(), j) = it.value();
        else
            for (int i = 0; i < n; ++i) out.insertBack(i, j) = columns(i, j - n);
        for (int i = 0; i < more; ++i) out.insertBack(n + i, j) = j < n ? rows(i, j) : corner(i, j - n);
    }
    out.finalize();
    return out;
}

}  // namespace tubule
