// Direct solver for small or banded unsymmetric sparse systems. KLU hides in the .cpp.
#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <stdexcept>

namespace tubule {

// A linear system that cannot be solved; what() names the situation (singular, nearly singular, not finite).
struct SolveError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// LU factors of a square matrix. A matrix of the same pattern as the one before reuses its ordering, and its
// pivots for as long as they stay good; this makes the second factorisation several times cheaper.
class SparseLu {
public:
    SparseLu();
    SparseLu(SparseLu&&) noexcept;
    SparseLu& operator=(SparseLu&&) noexcept;
    ~SparseLu();

    // Throws SolveError when A has entries that are not finite, is singular (naming the column) or has a
    // condition number beyond 1/epsilon; std::invalid_argument when A is not square or empty.
    // There are no factors afterwards then.
    void factor(const Eigen::SparseMatrix<double>& A);

    // x with A x = b, followed by this many steps of iterative refinement. std::logic_error without factors,
    // std::invalid_argument when the size of b does not fit.
    Eigen::VectorXd solve(const Eigen::VectorXd& b, int refinements = 0) const;

    // Estimate of 1/(|A|_1 |A^-1|_1); costs a few solves. std::logic_error without factors.
    double reciprocal_condition() const;

    // Work done so far: orderings found, factorisations with fresh pivots, factorisations with the old pivots.
    struct Counters {
        int analysed = 0, factored = 0, refactored = 0;
    };
    const Counters& counters() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tubule
