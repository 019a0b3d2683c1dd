// Dense matrices of any size. Eigen's templates for them take a compiler seconds in each file that uses them: here
// once.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace tubule {

// Eigenvalues from the least on; the vectors are columns.
struct Eigenpairs {
    Eigen::VectorXd values;
    Eigen::MatrixXd vectors;
};

// A v = mu v for a symmetric A, of which the lower triangle is read; the vectors are left out unless asked for.
Eigenpairs eigenpairs(const Eigen::MatrixXd& A, bool vectors);

// A v = mu B v for symmetric A and B. Nothing if B is not positive definite or the iteration does not converge.
std::optional<Eigenpairs> eigenpairs(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

struct ComplexEigenpairs {
    Eigen::VectorXcd values;
    Eigen::MatrixXcd vectors;
};
// A v = mu v for any A. Nothing if the iteration does not converge.
std::optional<ComplexEigenpairs> general_eigenpairs(const Eigen::MatrixXd& A);

bool is_positive_definite(const Eigen::MatrixXd& A);

// x with A x = b, one column or more, by LU factors.
Eigen::MatrixXd solve_dense(const Eigen::MatrixXd& A, const Eigen::MatrixXd& b);

// X of least norm among those that minimise |A X - B|. Pivots below the threshold, relative to the largest, count as
// zero; without a threshold those of rounding.
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B, std::optional<double> threshold = {});

// Orthonormal columns that span the vectors orthogonal to all columns of A, of which those within the threshold of the
// others' span count as one with them.
Eigen::MatrixXd orthogonal_complement(const Eigen::MatrixXd& A, double threshold);

}  // namespace tubule
