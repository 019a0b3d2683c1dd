#include <fmt/core.h>
#include <umfpack.h>

#include "common/solve/memory.hpp"
#include "common/solve/sparse_engine.hpp"

namespace tubule {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

class Umfpack : public SparseEngine {
public:
    explicit Umfpack(Ordering ordering) : ordering_(std::move(ordering)) {
        prepare_blas(1);
        umfpack_di_defaults(control_);
        // By itself UMFPACK takes the zero diagonal of a saddle point for a reason to be unsymmetric, which costs.
        control_[UMFPACK_STRATEGY] = UMFPACK_STRATEGY_SYMMETRIC;
        control_[UMFPACK_ORDERING] = UMFPACK_ORDERING_METIS;
        control_[UMFPACK_IRSTEP] = 0;  // SparseSolver refines
    }
    ~Umfpack() override { forget(); }

    void analyse(const Matrix& A) override {
        forget();
        const int n = static_cast<int>(A.cols());
        require_ordering(ordering_, n);
        // No values: the analysis has to serve later ones too.
        const int* const columns = A.outerIndexPtr();
        const int* const rows = A.innerIndexPtr();
        require_success(
            ordering_.empty()
                ? umfpack_di_symbolic(n, n, columns, rows, nullptr, &symbolic_, control_, info_)
                : umfpack_di_qsymbolic(n, n, columns, rows, nullptr, ordering_.data(), &symbolic_, control_, info_),
            n);
        require_memory(info_[UMFPACK_PEAK_MEMORY_ESTIMATE] * info_[UMFPACK_SIZE_OF_UNIT],
                       fmt::format("the factors of a matrix of size {}", n));
    }

    void factor(const Matrix& A) override {
        umfpack_di_free_numeric(&numeric_);
        require_success(umfpack_di_numeric(A.outerIndexPtr(), A.innerIndexPtr(), A.valuePtr(), symbolic_, &numeric_,
                                           control_, info_),
                        static_cast<int>(A.cols()));
        pivot_ratio_ = info_[UMFPACK_RCOND];
        fill_ = static_cast<std::int64_t>(info_[UMFPACK_LNZ] + info_[UMFPACK_UNZ]);
    }

    void solve(double* x, int size, int count, bool transposed) override {
        Eigen::VectorXd b(size), work(size);
        Eigen::VectorXi pattern(size);
        for (int column = 0; column < count; ++column) {
            Eigen::Map<Eigen::VectorXd> answer(x + std::ptrdiff_t{column} * size, size);
            b = answer;
            // The matrix itself is only needed for UMFPACK's own refinement.
            require_success(
                umfpack_di_wsolve(transposed ? UMFPACK_At : UMFPACK_A, nullptr, nullptr, nullptr, answer.data(),
                                  b.data(), numeric_, control_, info_, pattern.data(), work.data()),
                size);
        }
    }

    double pivot_ratio() override { return pivot_ratio_; }
    std::int64_t fill() override { return fill_; }

private:
    void forget() {
        umfpack_di_free_numeric(&numeric_);
        umfpack_di_free_symbolic(&symbolic_);
    }

    void require_success(int status, int n) const {
        if (status == UMFPACK_OK) return;
        if (status == UMFPACK_WARNING_singular_matrix)
            throw SolveError(fmt::format("matrix of size {} is singular: {} pivots are zero", n,
                                         n - static_cast<int>(info_[UMFPACK_UDIAG_NZ])));
        if (status == UMFPACK_ERROR_out_of_memory)
            throw SolveError(
                fmt::format("factors of a matrix of size {} exceed the memory or UMFPACK's 32-bit sizes; "
                            "an ordering by nodes needs less",
                            n));
        throw SolveError(fmt::format("UMFPACK cannot factor the matrix of size {} (status {})", n, status));
    }

    Ordering ordering_;
    double control_[UMFPACK_CONTROL], info_[UMFPACK_INFO];
    void *symbolic_ = nullptr, *numeric_ = nullptr;
    double pivot_ratio_ = 0;
    std::int64_t fill_ = 0;
};

}  // namespace

SparseLuLarge::SparseLuLarge(Ordering ordering)
    : SparseSolver("SparseLuLarge", std::make_unique<Umfpack>(std::move(ordering))) {}

}  // namespace tubule
