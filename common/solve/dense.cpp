#include "common/solve/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace tubule {

using Matrix = Eigen::MatrixXd;

Eigenpairs eigenpairs(const Matrix& A, bool vectors) {
    const Eigen::SelfAdjointEigenSolver<Matrix> solver(A,
                                                       vectors ? Eigen::ComputeEigenvectors : Eigen::EigenvaluesOnly);
    return {solver.eigenvalues(), vectors ? solver.eigenvectors() : Matrix()};
}

std::optional<Eigenpairs> eigenpairs(const Matrix& A, const Matrix& B) {
    if (!is_positive_definite(B)) return {};
    const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix> solver(A, B);
    if (solver.info() != Eigen::Success) return {};
    return Eigenpairs{solver.eigenvalues(), solver.eigenvectors()};
}

std::optional<ComplexEigenpairs> general_eigenpairs(const Matrix& A) {
    const Eigen::EigenSolver<Matrix> solver(A);
    if (solver.info() != Eigen::Success) return {};
    return ComplexEigenpairs{solver.eigenvalues(), solver.eigenvectors()};
}

bool is_positive_definite(const Matrix& A) {
    return Eigen::LLT<Matrix>(A).info() == Eigen::Success;
}

Matrix solve_dense(const Matrix& A, const Matrix& b) {
    return Eigen::PartialPivLU<Matrix>(A).solve(b);
}

Matrix least_squares(const Matrix& A, const Matrix& B, std::optional<double> threshold) {
    Eigen::CompleteOrthogonalDecomposition<Matrix> solver;
    if (threshold) solver.setThreshold(*threshold);
    solver.compute(A);
    return solver.solve(B);
}

Matrix orthogonal_complement(const Matrix& A, double threshold) {
    if (A.cols() == 0) return Matrix::Identity(A.rows(), A.rows());
    Eigen::ColPivHouseholderQR<Matrix> qr(A);
    qr.setThreshold(threshold);
    const Matrix q = qr.householderQ();
    return q.rightCols(A.rows() - qr.rank());
}

}  // namespace tubule
