// Factors of symmetric sparse matrices with a dense border, in double precision: Newton steps and spectra of shapes.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/SparseCore>
#include <optional>

#include "common/solve/sparse_ldlt.hpp"

namespace tubule {

// Factors of [A C; R D] with A sparse and symmetric and few columns C: L D L^T of A without pivoting, and LU of the
// complement D - R A^-1 C. Where A has no such factors (a pivot vanishes or they grow too much), LU factors of the
// whole take their place, unless SolveError is asked for. A matrix of the same pattern reuses the analysis. One thread
// at a time.
class BorderedLdlt {
public:
    enum class Otherwise { lu, fail };
    // `ordering` of A; `border`: how many unknowns the last rows and columns have; what takes the place of L D L^T.
    BorderedLdlt(Ordering ordering, int border, Otherwise otherwise = Otherwise::lu)
        : ordering_(std::move(ordering)), border_(border), otherwise_(otherwise) {}

    // Throws SolveError. A matrix whose first unknowns are those of A.
    void factor(const Eigen::SparseMatrix<double>& whole);
    // After steps of iterative refinement.
    Eigen::VectorXd solve(const Eigen::VectorXd& b) const;

    Eigen::Index size() const { return whole_.rows(); }
    bool pivoted() const { return lu_.has_value(); }  // whether LU factors are in use
    // Negative eigenvalues of A; not where it is pivoted.
    int negative() const { return ldlt_->pivots().negative; }
    // D - R A^-1 C
    const Eigen::MatrixXd& complement() const { return complement_; }

private:
    Eigen::VectorXd solve_once(const Eigen::VectorXd& b) const;

    Ordering ordering_;
    int border_;
    Otherwise otherwise_;
    std::optional<SparseLdlt<double>> ldlt_;
    std::optional<SparseLuLarge> lu_;
    Eigen::SparseMatrix<double> whole_;
    Eigen::MatrixXd solved_, rows_, complement_;  // A^-1 C, R
    Eigen::PartialPivLU<Eigen::MatrixXd> complement_lu_;
};

}  // namespace tubule
