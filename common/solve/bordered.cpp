#include "common/solve/bordered.hpp"

#include <Eigen/LU>

#include "common/solve/dense.hpp"
#include "common/solve/parallel.hpp"

namespace tubule {
namespace {

constexpr double regularisation = 1e-5, tolerance = 1e-11;
constexpr int most_iterations = 60;

// A x by parts, on all threads. The number of parts does not depend on that of threads, nor do sums.
class Product {
public:
    explicit Product(const Eigen::SparseMatrix<double>& A) : A_(A), sums_(A.rows(), parts) {}
    template <class In, class Out>
    void operator()(const In& x, Out&& y) {
        parallel_for(parts, [&](std::size_t part) {
            const auto begin = [&](std::size_t p) { return static_cast<Eigen::Index>(p) * A_.cols() / parts; };
            const Eigen::Index first = begin(part), count = begin(part + 1) - first;
            sums_.col(part).noalias() = A_.middleCols(first, count) * x.segment(first, count);
        });
        y = sums_.rowwise().sum();
    }

private:
    static constexpr int parts = 4;
    const Eigen::SparseMatrix<double>& A_;
    Eigen::Matrix<double, Eigen::Dynamic, parts> sums_;
};

}  // namespace

BorderedSolver::BorderedSolver(const Eigen::SparseMatrix<double>& pattern, const std::vector<int>& node_of_unknown)
    : ordering_(nested_dissection(pattern, node_of_unknown)), factors_(ordering_, regularisation) {}

BorderedSolver::Answer BorderedSolver::solve(const Eigen::SparseMatrix<double>& A, const Eigen::VectorXd& b,
                                             const Eigen::MatrixXd& C, const Eigen::VectorXd& d) {
    const Eigen::MatrixXd columns = C.cols() > 0 ? C : Eigen::MatrixXd(b.size(), 0);
    return solve(A, b, {columns, columns, Eigen::MatrixXd::Zero(columns.cols(), columns.cols()), d});
}

BorderedSolver::Answer BorderedSolver::solve(const Eigen::SparseMatrix<double>& A, const Eigen::VectorXd& b,
                                             const Border& border) {
    try {
        return iterate(A, b, border);
    } catch (const SolveError&) {
        ++fallbacks_;
        return directly(A, b, border);
    }
}

// Preconditioned by the same block elimination with the factors in place of A.
BorderedSolver::Answer BorderedSolver::iterate(const Eigen::SparseMatrix<double>& A, const Eigen::VectorXd& b,
                                               const Border& border) {
    const auto& [C, R, D, d] = border;
    const int n = static_cast<int>(b.size()), m = static_cast<int>(C.cols());
    factors_.factor(A);
    Eigen::MatrixXd W(n, m);
    for (int j = 0; j < m; ++j) W.col(j) = factors_.solve(C.col(j));
    const Eigen::MatrixXd S = R.transpose() * W - D;
    const Eigen::PartialPivLU<Eigen::MatrixXd> schur(m > 0 ? S : Eigen::MatrixXd::Identity(1, 1).eval());
    Product product(A);
    const Gmres::Operator whole = [&](const Eigen::VectorXd& x, Eigen::VectorXd& y) {
        product(x.head(n), y.head(n));
        if (m == 0) return;
        y.head(n).noalias() += C * x.tail(m);
        y.tail(m).noalias() = R.transpose() * x.head(n) + D * x.tail(m);
    };
    Eigen::VectorXd part;
    const Gmres::Operator nearly = [&](const Eigen::VectorXd& r, Eigen::VectorXd& x) {
        factors_.solve(r.head(n), part);
        x.head(n) = part;
        if (m == 0) return;
        x.tail(m) = schur.solve(R.transpose() * part - r.tail(m));
        x.head(n).noalias() -= W * x.tail(m);
    };
    if (!gmres_ || border_ != m) gmres_.emplace(n + m);
    border_ = m;
    Eigen::VectorXd rhs(n + m), x = Eigen::VectorXd::Zero(n + m);
    rhs.head(n) = b;
    if (m > 0) rhs.tail(m) = d;
    nearly(rhs, x);
    iterations_ = gmres_->solve(whole, nearly, rhs, x, tolerance, most_iterations).iterations;
    return {x.head(n), x.tail(m)};
}

BorderedSolver::Answer BorderedSolver::directly(const Eigen::SparseMatrix<double>& A, const Eigen::VectorXd& b,
                                                const Border& border) {
    const auto& [C, R, D, d] = border;
    if (!lu_) lu_.emplace(ordering_);
    lu_->factor(A);
    const Eigen::VectorXd x = lu_->solve(b, 1);
    if (C.cols() == 0) return {x, {}};
    const Eigen::MatrixXd W = lu_->solve(C, 1);
    const Eigen::MatrixXd S = R.transpose() * W - D;
    const Eigen::VectorXd y = solve_dense(S, R.transpose() * x - d);
    return {x - W * y, y};
}

}  // namespace tubule
