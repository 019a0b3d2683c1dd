#include "common/solve/sparse.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <vector>

#include "common/solve/memory.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse_engine.hpp"

// <cblas.h> is another library's on some systems. The others are those by which OpenBLAS gets its buffers; it keeps
// them for later calls.
extern "C" {
void openblas_set_num_threads(int);
[[gnu::weak]] void* blas_memory_alloc(int);
[[gnu::weak]] void blas_memory_free(void*);
}

namespace tubule {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

constexpr double epsilon = std::numeric_limits<double>::epsilon();
// Below this the ratio of the pivots is worth the price of a real condition estimate.
constexpr double suspicious_pivot_ratio = 1e-12;

bool same_pattern(const Matrix& a, const Matrix& b) {
    return a.rows() == b.rows() && a.cols() == b.cols() && a.nonZeros() == b.nonZeros() &&
           std::equal(a.outerIndexPtr(), a.outerIndexPtr() + a.cols() + 1, b.outerIndexPtr()) &&
           std::equal(a.innerIndexPtr(), a.innerIndexPtr() + a.nonZeros(), b.innerIndexPtr());
}

void require_finite(const Matrix& A) {
    for (int column = 0; column < A.cols(); ++column)
        for (Matrix::InnerIterator entry(A, column); entry; ++entry)
            if (!std::isfinite(entry.value()))
                throw SolveError(fmt::format("matrix entry ({}, {}) is {}", entry.row(), column, entry.value()));
}

double norm_1(const Matrix& A) {
    double norm = 0;
    for (int column = 0; column < A.cols(); ++column) norm = std::max(norm, A.col(column).cwiseAbs().sum());
    return norm;
}

// Hager's and Higham's lower bound of |A^-1|_1 (Higham, Accuracy and Stability of Numerical Algorithms,
// algorithm 15.4): climbs to a local maximum of |A^-1 x|_1 over |x|_1 = 1 and compares with a vector that rules out
// unlucky zeros.
double norm_1_of_inverse(SparseEngine& engine, int n) {
    using Vector = Eigen::VectorXd;
    const auto solved = [&](Vector x, bool transposed) {
        engine.solve(x.data(), n, 1, transposed);
        return x;
    };
    const auto signs = [](const Vector& x) -> Vector {
        return x.unaryExpr([](double v) { return v < 0 ? -1.0 : 1.0; });
    };
    Vector y = solved(Vector::Constant(n, 1.0 / n), false);
    double norm = y.lpNorm<1>();
    Eigen::Index previous = -1;
    for (int i = 0; i < 4 && n > 1; ++i) {
        Eigen::Index steepest;
        solved(signs(y), true).cwiseAbs().maxCoeff(&steepest);
        if (steepest == previous) break;
        previous = steepest;
        y = solved(Vector::Unit(n, steepest), false);
        if (!(y.lpNorm<1>() > norm)) break;
        norm = y.lpNorm<1>();
    }
    Vector alternating(n);
    for (int i = 0; i < n; ++i) alternating[i] = (i % 2 ? -1 : 1) * (1 + double(i) / n);
    return std::max(norm, 2.0 / (3.0 * n) * solved(alternating, false).lpNorm<1>());
}

}  // namespace

void use_one_blas_thread() {
    [[maybe_unused]] static const bool once = [] {
        if (!std::getenv("OPENBLAS_NUM_THREADS")) openblas_set_num_threads(1);
        return true;
    }();
}

void prepare_blas(int threads) {
    constexpr std::size_t buffer_bytes = 1 << 27;  // of all kernels for x86-64
    static std::mutex mutex;
    static int wanted = 0, there = 0;  // buffers: by all threads that are alive; of OpenBLAS
    struct Wish {
        int threads = 0;
        ~Wish() {
            const std::lock_guard lock(mutex);
            wanted -= threads;
        }
    };
    thread_local Wish wish;
    if (!limited_memory() || threads <= wish.threads || !blas_memory_alloc || !blas_memory_free) return;
    const std::lock_guard lock(mutex);
    const int more = wanted + threads - wish.threads;
    std::vector<std::unique_ptr<void, void (*)(void*)>> taken;
    while (there < more && static_cast<int>(taken.size()) < more) {
        if (!can_allocate(buffer_bytes)) throw std::bad_alloc();
        taken.emplace_back(blas_memory_alloc(0), blas_memory_free);
    }
    wanted = more, wish.threads = threads, there = std::max(there, more);
}

struct SparseSolver::Impl {
    const char* name;
    std::unique_ptr<SparseEngine> engine;
    Matrix A;
    bool analysed = false;  // the engine knows the pattern of A
    bool factored = false;  // the engine has factors of A
    Counters counters;

    void analyse() {
        analysed = false;
        engine->analyse(A);
        analysed = true;
        ++counters.analysed;
    }

    void factor() {
        if (engine->refactor(A)) {
            ++counters.refactored;
        } else {
            engine->factor(A);
            ++counters.factored;
        }
        counters.fill = engine->fill();
    }

    double condition() const { return norm_1(A) * norm_1_of_inverse(*engine, static_cast<int>(A.cols())); }

    void require_well_conditioned() const {
        if (engine->pivot_ratio() >= suspicious_pivot_ratio) return;
        const double c = condition();
        if (!(c < 1 / epsilon))
            throw SolveError(
                fmt::format("matrix of size {} is nearly singular: condition number about {:.1e}", A.cols(), c));
    }

    void require_factors(const char* what) const {
        if (!factored) throw std::logic_error(fmt::format("{}::{} needs factors: call factor() first", name, what));
    }
};

SparseSolver::SparseSolver(const char* name, std::unique_ptr<SparseEngine> engine)
    : impl_(new Impl{.name = name, .engine = std::move(engine), .A = {}, .counters = {}}) {
    use_one_blas_thread();
}
SparseSolver::SparseSolver(SparseSolver&&) noexcept = default;
SparseSolver& SparseSolver::operator=(SparseSolver&&) noexcept = default;
SparseSolver::~SparseSolver() = default;

void SparseSolver::factor(const Matrix& A) {
    Impl& s = *impl_;
    s.factored = false;
    if (A.rows() != A.cols() || A.rows() == 0)
        throw std::invalid_argument(fmt::format("{} needs a square matrix, not {} x {}", s.name, A.rows(), A.cols()));
    if (!A.isCompressed()) {
        Matrix compressed = A;
        compressed.makeCompressed();
        return factor(compressed);
    }
    check_pause();
    require_finite(A);
    const bool known = s.analysed && same_pattern(s.A, A);
    s.A = A;
    if (!known) s.analyse();
    s.factor();
    s.require_well_conditioned();
    s.factored = true;
}

void SparseSolver::solve_in_place(Eigen::Ref<Eigen::MatrixXd> X, int refinements) const {
    const Impl& s = *impl_;
    s.require_factors("solve");
    if (X.rows() != s.A.cols())
        throw std::invalid_argument(
            fmt::format("right-hand side of size {} for a matrix of size {}", X.rows(), s.A.cols()));
    if (!X.allFinite())
        throw SolveError(fmt::format("right-hand side for a matrix of size {} is not finite", X.rows()));
    const int size = static_cast<int>(X.rows()), count = static_cast<int>(X.cols());
    Eigen::MatrixXd B;
    if (refinements > 0) B = X;
    s.engine->solve(X.data(), size, count, false);
    for (int i = 0; i < refinements; ++i) {
        Eigen::MatrixXd correction = B - s.A * X;
        s.engine->solve(correction.data(), size, count, false);
        X += correction;
    }
    if (!X.allFinite()) throw SolveError(fmt::format("solution of size {} is not finite", X.rows()));
}

double SparseSolver::reciprocal_condition() const {
    impl_->require_factors("reciprocal_condition");
    return 1 / impl_->condition();
}

const SparseSolver::Counters& SparseSolver::counters() const {
    return impl_->counters;
}

}  // namespace tubule
