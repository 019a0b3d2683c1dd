#include "common/solve/sparse.hpp"

#include <fmt/core.h>
#include <klu.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tubule {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
// Below this the ratio of KLU's pivots is worth the price of a real condition estimate.
constexpr double suspicious_pivot_ratio = 1e-12;
// Old pivots are dropped when they let the factors grow this much more than fresh ones did.
constexpr double tolerated_growth = 100;

bool same_pattern(const Eigen::SparseMatrix<double>& a, const Eigen::SparseMatrix<double>& b) {
    return a.rows() == b.rows() && a.cols() == b.cols() && a.nonZeros() == b.nonZeros() &&
           std::equal(a.outerIndexPtr(), a.outerIndexPtr() + a.cols() + 1, b.outerIndexPtr()) &&
           std::equal(a.innerIndexPtr(), a.innerIndexPtr() + a.nonZeros(), b.innerIndexPtr());
}

void require_finite(const Eigen::SparseMatrix<double>& A) {
    for (int column = 0; column < A.cols(); ++column)
        for (Eigen::SparseMatrix<double>::InnerIterator entry(A, column); entry; ++entry)
            if (!std::isfinite(entry.value()))
                throw SolveError(fmt::format("matrix entry ({}, {}) is {}", entry.row(), column, entry.value()));
}

}  // namespace

struct SparseLu::Impl {
    Eigen::SparseMatrix<double> A;
    klu_common common{};
    klu_symbolic* symbolic = nullptr;
    klu_numeric* numeric = nullptr;
    bool factored = false;    // `numeric` belongs to A
    double fresh_growth = 1;  // klu_rgrowth of the last factorisation with fresh pivots
    Counters counters;

    Impl() { klu_defaults(&common); }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
    ~Impl() { forget(); }

    void forget() {
        klu_free_numeric(&numeric, &common);
        klu_free_symbolic(&symbolic, &common);
    }

    int* columns() { return A.outerIndexPtr(); }
    int* rows() { return A.innerIndexPtr(); }

    void analyse() {
        forget();
        symbolic = klu_analyze(static_cast<int>(A.cols()), columns(), rows(), &common);
        if (!symbolic) fail();
        ++counters.analysed;
    }

    void factor_fresh() {
        klu_free_numeric(&numeric, &common);
        numeric = klu_factor(columns(), rows(), A.valuePtr(), symbolic, &common);
        if (!numeric || common.status != KLU_OK) fail();
        fresh_growth = growth();
        ++counters.factored;
    }

    // False when the old pivots do not suit the new values.
    bool factor_again() {
        if (!numeric) return false;
        if (!klu_refactor(columns(), rows(), A.valuePtr(), symbolic, numeric, &common) || common.status != KLU_OK ||
            !(growth() * tolerated_growth >= fresh_growth))
            return false;
        ++counters.refactored;
        return true;
    }

    double growth() {
        klu_rgrowth(columns(), rows(), A.valuePtr(), symbolic, numeric, &common);
        return common.rgrowth;
    }

    double condition() {
        klu_condest(columns(), A.valuePtr(), symbolic, numeric, &common);
        return common.condest;
    }

    void require_well_conditioned() {
        klu_rcond(symbolic, numeric, &common);
        if (common.rcond >= suspicious_pivot_ratio) return;
        const double c = condition();
        if (!(c < 1 / epsilon))
            throw SolveError(
                fmt::format("matrix of size {} is nearly singular: condition number about {:.1e}", A.cols(), c));
    }

    [[noreturn]] void fail() {
        if (common.status == KLU_SINGULAR)
            throw SolveError(
                fmt::format("matrix of size {} is singular: no pivot in column {}", A.cols(), common.singular_col));
        if (common.status == KLU_OUT_OF_MEMORY) throw std::bad_alloc();
        throw SolveError(fmt::format("matrix of size {} is refused by KLU (status {})", A.cols(), common.status));
    }
};

SparseLu::SparseLu() : impl_(std::make_unique<Impl>()) {}
SparseLu::SparseLu(SparseLu&&) noexcept = default;
SparseLu& SparseLu::operator=(SparseLu&&) noexcept = default;
SparseLu::~SparseLu() = default;

void SparseLu::factor(const Eigen::SparseMatrix<double>& A) {
    Impl& s = *impl_;
    s.factored = false;
    if (A.rows() != A.cols() || A.rows() == 0)
        throw std::invalid_argument(fmt::format("SparseLu wants a square matrix, not {} x {}", A.rows(), A.cols()));
    if (!A.isCompressed()) {
        Eigen::SparseMatrix<double> compressed = A;
        compressed.makeCompressed();
        return factor(compressed);
    }
    require_finite(A);
    const bool known = s.symbolic && same_pattern(s.A, A);
    s.A = A;
    if (!known) s.analyse();
    if (!s.factor_again()) s.factor_fresh();
    s.require_well_conditioned();
    s.factored = true;
}

Eigen::VectorXd SparseLu::solve(const Eigen::VectorXd& b, int refinements) const {
    Impl& s = *impl_;
    if (!s.factored) throw std::logic_error("SparseLu::solve without factors");
    if (b.size() != s.A.cols())
        throw std::invalid_argument(
            fmt::format("right-hand side of size {} for a matrix of size {}", b.size(), s.A.cols()));
    const auto solve_in_place = [&](Eigen::VectorXd& x) {
        if (!klu_solve(s.symbolic, s.numeric, static_cast<int>(x.size()), 1, x.data(), &s.common)) s.fail();
    };
    Eigen::VectorXd x = b;
    solve_in_place(x);
    for (int i = 0; i < refinements; ++i) {
        Eigen::VectorXd correction = b - s.A * x;
        solve_in_place(correction);
        x += correction;
    }
    return x;
}

double SparseLu::reciprocal_condition() const {
    if (!impl_->factored) throw std::logic_error("SparseLu::reciprocal_condition without factors");
    return 1 / impl_->condition();
}

const SparseLu::Counters& SparseLu::counters() const {
    return impl_->counters;
}

}  // namespace tubule
