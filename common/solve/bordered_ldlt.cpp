#include "common/solve/bordered_ldlt.hpp"

namespace tubule {
namespace {

constexpr double most_growth = 1e6;  // rounding in the factors is this many epsilon, which refinement makes up for
constexpr int refinements = 2;
constexpr double small_change = 1e-9;  // the next one would be as small again, beside this one

}  // namespace

void BorderedLdlt::factor(const Eigen::SparseMatrix<double>& whole) {
    const Eigen::Index n = whole.rows() - border_;
    whole_ = whole;
    lu_.reset();
    try {
        if (!ldlt_) ldlt_.emplace(ordering_);
        ldlt_->factor(Eigen::SparseMatrix<double>(whole.topLeftCorner(n, n)));
        if (!(ldlt_->pivots().growth < most_growth)) throw SolveError("the factors grow");
    } catch (const SolveError&) {
        ldlt_.reset();
        if (otherwise_ == Otherwise::fail) throw;
        Ordering ordering = ordering_;
        for (Eigen::Index i = n; i < whole.rows(); ++i) ordering.push_back(static_cast<int>(i));
        lu_.emplace(std::move(ordering));
        lu_->factor(whole);
        return;
    }
    if (border_ == 0) return;
    const Eigen::MatrixXd columns = whole.rightCols(border_);
    rows_ = whole.bottomRows(border_).leftCols(n);
    solved_.resize(n, border_);
    for (int j = 0; j < border_; ++j)
        if (const Eigen::VectorXd column = columns.col(j).head(n); column.isZero(0))
            solved_.col(j).setZero();
        else
            solved_.col(j) = ldlt_->solve(column);
    complement_ = columns.bottomRows(border_) - rows_ * solved_;
    complement_lu_.compute(complement_);
}

Eigen::VectorXd BorderedLdlt::solve_once(const Eigen::VectorXd& b) const {
    if (lu_) return lu_->solve(b);
    const Eigen::Index n = b.size() - border_;
    Eigen::VectorXd x(b.size());
    const Eigen::VectorXd first = ldlt_->solve(Eigen::VectorXd(b.head(n)));
    if (border_ == 0) return first;
    const Eigen::VectorXd y = complement_lu_.solve(b.tail(border_) - rows_ * first);
    x << first - solved_ * y, y;
    return x;
}

Eigen::VectorXd BorderedLdlt::solve(const Eigen::VectorXd& b) const {
    Eigen::VectorXd x = solve_once(b);
    for (int k = 0; k < refinements; ++k) {
        const Eigen::VectorXd change = solve_once(b - whole_ * x);
        x += change;
        if (change.lpNorm<Eigen::Infinity>() < small_change * x.lpNorm<Eigen::Infinity>()) break;
    }
    if (!x.allFinite()) throw SolveError("the solution is not finite");
    return x;
}

}  // namespace tubule
