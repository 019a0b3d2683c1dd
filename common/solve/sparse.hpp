// Direct solvers for sparse systems, one interface over Eigen's modules of three libraries:
//   SparseLu         KLU      small or banded, unsymmetric
//   SparseLuLarge    UMFPACK  large, of nearly symmetric pattern: the saddle points of a finite element mesh
//   SparseCholesky   CHOLMOD  symmetric positive definite
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

namespace tubule {

struct SparseEngine;

// A linear system that cannot be solved; what() names the situation (singular, nearly singular, not positive
// definite, not finite, too large).
struct SolveError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// [A columns; rows corner], compressed, zeros of the border included.
Eigen::SparseMatrix<double> bordered(const Eigen::SparseMatrix<double>& A, const Eigen::MatrixXd& columns,
                                     const Eigen::MatrixXd& rows, const Eigen::MatrixXd& corner);

// The order in which unknowns are eliminated: entry k is the number of the k-th one.
using Ordering = std::vector<int>;

// Nested dissection (METIS) of the graph of A + A^T. Given the node of each unknown, numbered from 0, the graph of the
// nodes is dissected, and the unknowns of a node follow each other by number, so multipliers should have the higher
// ones. This is quicker by the square of the unknowns per node and leads to less fill. Several solvers may
// share the answer. std::invalid_argument when A is not square or the nodes do not fit it.
Ordering nested_dissection(const Eigen::SparseMatrix<double>& A, const std::vector<int>& node_of_unknown = {});

// Factors of a square matrix, by one of the classes below. A matrix of the same pattern as the one before reuses its
// ordering and symbolic analysis. One thread at a time.
class SparseSolver {
public:
    SparseSolver(SparseSolver&&) noexcept;
    SparseSolver& operator=(SparseSolver&&) noexcept;
    ~SparseSolver();

    // Throws SolveError when A has entries that are not finite, is singular or has a condition number beyond 1/epsilon;
    // std::invalid_argument when A is not square or empty. There are then no factors.
    void factor(const Eigen::SparseMatrix<double>& A);

    // X with A X = B, one or several right-hand sides, followed by this many steps of iterative refinement.
    // SolveError when B is not finite or X overflows, std::logic_error without factors, std::invalid_argument when the
    // size of B does not fit.
    template <class Derived>
    auto solve(const Eigen::MatrixBase<Derived>& B, int refinements = 0) const {
        Eigen::Matrix<double, Eigen::Dynamic, Derived::ColsAtCompileTime> X = B;
        solve_in_place(X, refinements);
        return X;
    }

    // Work done so far: orderings found, factorisations, factorisations with the old pivots (KLU alone);
    // and the number of entries in the last factors.
    struct Counters {
        int analysed = 0, factored = 0, refactored = 0;
        std::int64_t fill = 0;
    };
    const Counters& counters() const;

protected:
    explicit SparseSolver(std::unique_ptr<SparseEngine> engine);

private:
    void solve_in_place(Eigen::Ref<Eigen::MatrixXd> X, int refinements) const;

    std::unique_ptr<SparseEngine> engine_;
};

// LU factors of a small or banded matrix. A matrix of the same pattern also reuses the pivots for as long as they stay
// good; this makes the second factorisation several times cheaper. A SolveError names the singular column.
class SparseLu : public SparseSolver {
public:
    SparseLu();
};

// LU factors of a large matrix, pivots on the diagonal where they are good enough: give it the nested dissection of the
// nodes, and refine once when it matters. Without an ordering it dissects the graph of the unknowns, which is slower.
// Minimum degree would be far worse: it eliminates multipliers before their diagonal has filled.
class SparseLuLarge : public SparseSolver {
public:
    explicit SparseLuLarge(Ordering ordering = {});
};

// Cholesky factors. The matrix comes with both triangles. A SolveError says that it is not symmetric, or names the
// unknown whose pivot is not positive. Ordered by minimum degree (AMD), as good on surfaces as dissection for one
// unknown a node, and found in a tenth of the time.
class SparseCholesky : public SparseSolver {
public:
    SparseCholesky();
};

}  // namespace tubule
