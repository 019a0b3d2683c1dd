// Restarted GMRES for systems whose preconditioner is nearly an inverse.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "common/solve/sparse.hpp"

namespace tubule {

// Flexible, right-preconditioned GMRES (Saad 1993): what it minimises is the true residual, whatever the preconditioner
// does, even one in single precision that is not quite linear. It keeps its vectors between solves: make one and use it
// often.
class Gmres {
public:
    // y = A x or x = M^-1 y of vectors that are already of the right size.
    using Operator = std::function<void(const Eigen::VectorXd&, Eigen::VectorXd&)>;

    struct Answer {
        int iterations = 0;
        double residual = 0;  // |b - A x| / |b|, computed from x
    };

    // Starts anew after this many iterations.
    explicit Gmres(int size, int restart = 30);

    // Improves x until |b - A x| <= tolerance |b|. SolveError when this takes more iterations, when the residual no
    // longer falls, or when a vector is not finite; x is then the best so far. std::invalid_argument when sizes do not
    // fit.
    Answer solve(const Operator& A, const Operator& preconditioner, const Eigen::VectorXd& b, Eigen::VectorXd& x,
                 double tolerance, int max_iterations);

private:
    int extend_basis(const Operator& A, const Operator& preconditioner, double wanted, int most);
    void improve(int dimension, Eigen::VectorXd& x);

    int size_, restart_;
    std::vector<Eigen::VectorXd> basis_, directions_;    // orthonormal v_j; z_j = M^-1 v_j
    Eigen::MatrixXd R_;                                  // A z_j in the basis, after rotations: upper triangular
    Eigen::VectorXd cosine_, sine_, rhs_, coefficient_;  // rotations; what they make of |r| e_1; of the z_j
};

}  // namespace tubule
