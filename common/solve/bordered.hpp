// Large, almost symmetric saddle points with a few dense rows and columns, one after the other on the same mesh.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <optional>

#include "common/solve/gmres.hpp"
#include "common/solve/sparse_ldlt.hpp"

namespace tubule {

// Solves A x + C y = b, R^T x + D y = d. A has the pattern given at first; its symmetric part is quasi-definite or
// nearly so, and close to A. Factors of it in single precision precondition GMRES on the whole; where that fails, LU
// factors of A take over (`fallbacks` counts how often).
class BorderedSolver {
public:
    // `node_of_unknown` as in nested_dissection().
    BorderedSolver(const Eigen::SparseMatrix<double>& pattern, const std::vector<int>& node_of_unknown);

    struct Answer {
        Eigen::VectorXd x, y;
    };
    // One column of C and R for each y; there may be none.
    struct Border {
        Eigen::MatrixXd C, R, D;
        Eigen::VectorXd d;
    };
    // SolveError.
    Answer solve(const Eigen::SparseMatrix<double>& A, const Eigen::VectorXd& b, const Border& border);
    // With R = C and D = 0.
    Answer solve(const Eigen::SparseMatrix<double>& A, const Eigen::VectorXd& b, const Eigen::MatrixXd& C = {},
                 const Eigen::VectorXd& d = {});

    int iterations() const { return iterations_; }  // of the last solve
    int fallbacks() const { return fallbacks_; }

private:
    Answer iterate(const Eigen::SparseMatrix<double>& A, const Eigen::VectorXd& b, const Border& border);
    Answer directly(const Eigen::SparseMatrix<double>& A, const Eigen::VectorXd& b, const Border& border);

    Ordering ordering_;
    SparseLdlt<float> factors_;
    std::optional<SparseLuLarge> lu_;
    std::optional<Gmres> gmres_;
    int border_ = 0, iterations_ = 0, fallbacks_ = 0;
};

}  // namespace tubule
