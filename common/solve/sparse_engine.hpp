// The interface of a library behind SparseSolver. Private to common/solve.
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>

#include "common/solve/sparse.hpp"

namespace tubule {

// SparseSolver calls it with square, compressed, finite matrices and in this order: analyse, factor, the rest;
// refactor and factor again with matrices of the same pattern. Failures are SolveErrors.
class SparseEngine {
public:
    SparseEngine() = default;
    SparseEngine(const SparseEngine&) = delete;
    SparseEngine& operator=(const SparseEngine&) = delete;
    virtual ~SparseEngine() = default;

    virtual void analyse(const Eigen::SparseMatrix<double>& A) = 0;
    virtual void factor(const Eigen::SparseMatrix<double>& A) = 0;

    // Factors with the pivots of the last factor(). False, and no factors, when that is not possible or not wise.
    virtual bool refactor(const Eigen::SparseMatrix<double>&) { return false; }

    // Overwrites this many columns b of length size, one after the other, by A^-1 b or A^-T b.
    virtual void solve(double* columns, int size, int count, bool transposed) = 0;

    // Smallest to largest pivot: a cheap hint at the condition. Entries of the factors.
    virtual double pivot_ratio() = 0;
    virtual std::int64_t fill() = 0;
};

// std::invalid_argument unless the ordering is empty or a permutation of this many unknowns.
void require_ordering(const Ordering& ordering, int size);

// A second BLAS thread gains nothing in factors as small as ours, and OpenBLAS's wait by spinning, on the core that the
// next assembly wants (docs/decisions/linear_algebra.md). A value of OPENBLAS_NUM_THREADS takes precedence.
void use_one_blas_thread();

// Before a thread calls the BLAS, in loops of so many threads: has OpenBLAS take the memory that these will need, which
// it keeps; once there is none it would ask again and again, forever. Throws std::bad_alloc.
void prepare_blas(int threads);

}  // namespace tubule
