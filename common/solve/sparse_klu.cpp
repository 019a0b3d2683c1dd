#include <fmt/core.h>
#include <klu.h>

#include <new>

#include "common/solve/memory.hpp"
#include "common/solve/sparse_engine.hpp"

namespace tubule {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

// Old pivots are dropped when they let the factors grow this much more than fresh ones did.
constexpr double tolerated_growth = 100;
constexpr double bytes_per_entry = 12;  // of factors: a value and a row

class Klu : public SparseEngine {
public:
    Klu() { klu_defaults(&common_); }
    ~Klu() override { forget(); }

    void analyse(const Matrix& A) override {
        forget();
        symbolic_ = klu_analyze(static_cast<int>(A.cols()), columns(A), rows(A), &common_);
        if (!symbolic_) fail(A);
        require_factors(bytes_per_entry * (symbolic_->lnz + symbolic_->unz), symbolic_->est_flops / 2, A.cols());
    }

    void factor(const Matrix& A) override {
        klu_free_numeric(&numeric_, &common_);
        numeric_ = klu_factor(columns(A), rows(A), values(A), symbolic_, &common_);
        if (!numeric_ || common_.status != KLU_OK) fail(A);
        fresh_growth_ = growth(A);
    }

    bool refactor(const Matrix& A) override {
        return numeric_ && klu_refactor(columns(A), rows(A), values(A), symbolic_, numeric_, &common_) &&
               common_.status == KLU_OK && growth(A) * tolerated_growth >= fresh_growth_;
    }

    void solve(double* x, int size, int count, bool transposed) override {
        const auto solve = transposed ? klu_tsolve : klu_solve;
        if (!solve(symbolic_, numeric_, size, count, x, &common_))
            throw SolveError(fmt::format("KLU failed to solve (status {})", common_.status));
    }

    double pivot_ratio() override {
        klu_rcond(symbolic_, numeric_, &common_);
        return common_.rcond;
    }

    std::int64_t fill() override { return std::int64_t{numeric_->lnz} + numeric_->unz + numeric_->nzoff; }

private:
    // KLU is not const-correct.
    static int* columns(const Matrix& A) { return const_cast<int*>(A.outerIndexPtr()); }
    static int* rows(const Matrix& A) { return const_cast<int*>(A.innerIndexPtr()); }
    static double* values(const Matrix& A) { return const_cast<double*>(A.valuePtr()); }

    double growth(const Matrix& A) {
        klu_rgrowth(columns(A), rows(A), values(A), symbolic_, numeric_, &common_);
        return common_.rgrowth;
    }

    void forget() {
        klu_free_numeric(&numeric_, &common_);
        klu_free_symbolic(&symbolic_, &common_);
    }

    [[noreturn]] void fail(const Matrix& A) {
        if (common_.status == KLU_SINGULAR)
            throw SolveError(
                fmt::format("matrix of size {} is singular: no pivot in column {}", A.cols(), common_.singular_col));
        if (common_.status == KLU_OUT_OF_MEMORY) throw std::bad_alloc();
        throw SolveError(fmt::format("KLU cannot factor the matrix of size {} (status {})", A.cols(), common_.status));
    }

    klu_common common_{};
    klu_symbolic* symbolic_ = nullptr;
    klu_numeric* numeric_ = nullptr;
    double fresh_growth_ = 1;  // growth() of the last factorisation with fresh pivots
};

}  // namespace

SparseLu::SparseLu() : SparseSolver("SparseLu", std::make_unique<Klu>()) {}

}  // namespace tubule
