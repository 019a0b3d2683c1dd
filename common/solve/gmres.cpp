#include "common/solve/gmres.hpp"

#include <fmt/core.h>

#include <cmath>

namespace tubule {

using Vector = Eigen::VectorXd;

Gmres::Gmres(int size, int restart)
    : size_(size),
      restart_(restart),
      R_(restart + 1, restart),
      cosine_(restart),
      sine_(restart),
      rhs_(restart + 1),
      coefficient_(restart) {
    if (size < 1 || restart < 1)
        throw std::invalid_argument(fmt::format("Gmres of size {}, restarted after {}", size, restart));
    basis_.assign(restart + 1, Vector(size));
    directions_.assign(restart, Vector(size));
}

// Arnoldi's method from basis_[0], the residual being rhs_[0] times that, until what is left of it is as small as
// wanted. Returns the number of directions.
int Gmres::extend_basis(const Operator& A, const Operator& preconditioner, double wanted, int most) {
    for (int j = 0; j < most; ++j) {
        preconditioner(basis_[j], directions_[j]);
        Vector& w = basis_[j + 1];
        A(directions_[j], w);
        for (int i = 0; i <= j; ++i) {
            R_(i, j) = basis_[i].dot(w);
            w -= R_(i, j) * basis_[i];
        }
        const double norm = w.norm();
        if (!std::isfinite(norm))
            throw SolveError(fmt::format("GMRES: vector {} of size {} is not finite", j + 1, size_));
        for (int i = 0; i < j; ++i) {
            const double r = R_(i, j);
            R_(i, j) = cosine_[i] * r + sine_[i] * R_(i + 1, j);
            R_(i + 1, j) = cosine_[i] * R_(i + 1, j) - sine_[i] * r;
        }
        const double length = std::hypot(R_(j, j), norm);
        if (length == 0) return j;  // the image of this direction is one of those before
        cosine_[j] = R_(j, j) / length;
        sine_[j] = norm / length;
        R_(j, j) = length;
        rhs_[j + 1] = -sine_[j] * rhs_[j];
        rhs_[j] *= cosine_[j];
        if (std::abs(rhs_[j + 1]) <= wanted || norm == 0) return j + 1;
        w /= norm;
        R_(j + 1, j) = 0;
    }
    return most;
}

void Gmres::improve(int dimension, Vector& x) {
    auto y = coefficient_.head(dimension);
    y = rhs_.head(dimension);
    R_.topLeftCorner(dimension, dimension).triangularView<Eigen::Upper>().solveInPlace(y);
    for (int j = 0; j < dimension; ++j) x += y[j] * directions_[j];
}

Gmres::Answer Gmres::solve(const Operator& A, const Operator& preconditioner, const Vector& b, Vector& x,
                           double tolerance, int max_iterations) {
    if (b.size() != size_ || x.size() != size_)
        throw std::invalid_argument(
            fmt::format("GMRES of size {} with vectors of sizes {} and {}", size_, b.size(), x.size()));
    const double norm = b.norm();
    if (!std::isfinite(norm) || !x.allFinite())
        throw SolveError("the right-hand side or the initial guess of GMRES is not finite");
    if (norm == 0) {
        x.setZero();
        return {};
    }
    Answer answer;
    for (double before = -1;; before = answer.residual) {
        Vector& residual = basis_[0];
        A(x, residual);
        residual = b - residual;
        answer.residual = residual.norm() / norm;
        if (answer.residual <= tolerance) return answer;
        const bool exhausted = answer.iterations >= max_iterations;
        if (exhausted || (before >= 0 && !(answer.residual < 0.5 * before)))
            throw SolveError(
                fmt::format("GMRES of size {} {} at a residual of {:.1e} after {} iterations; the tolerance is {:.1e}",
                            size_, exhausted ? "ended" : "stagnated", answer.residual, answer.iterations, tolerance));
        rhs_[0] = answer.residual * norm;
        residual /= rhs_[0];
        const int most = std::min(restart_, max_iterations - answer.iterations);
        const int dimension = extend_basis(A, preconditioner, tolerance * norm, most);
        improve(dimension, x);
        answer.iterations += std::max(dimension, 1);
    }
}

}  // namespace tubule
