// common/solve/sparse: what the solvers have in common, and those for large systems. More on SparseLu: solve_test.cpp.
#include "common/solve/sparse.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "common/solve/dense.hpp"
#include "tests/sphere_matrices.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::sparse_test {

using Matrix = Eigen::SparseMatrix<double>;
using Dense = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

Dense waves(Eigen::Index rows, Eigen::Index columns) {
    return Vector::LinSpaced(rows * columns, 0, 7).array().sin().matrix().reshaped(rows, columns);
}

// 162 unknowns; condition number 15 for mass 1.
Matrix positive_definite(double mass = 1) {
    return sphere::helmholtz(sphere::icosphere(1), 2, mass, 0.1);
}

sphere::System saddle(double wind = 3) {
    return sphere::saddle(sphere::icosphere(1), 2, wind);
}

sphere::System flow() {
    return sphere::flow(sphere::icosphere(0), 3, 1e-2);
}

Matrix sparse(const Dense& A) {
    return A.sparseView(0, 0);
}

using test::message_of;

// |X - X_dense|_oo / |X_dense|_oo
double difference_from_dense(const SparseSolver& solver, const Matrix& A, const Dense& B) {
    const Dense expected = solve_dense(Dense(A), B);
    return (solver.solve(B) - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

double condition(const Matrix& A) {
    const auto norm = [](const Dense& D) { return D.cwiseAbs().colwise().sum().maxCoeff(); };
    return norm(Dense(A)) * norm(solve_dense(Dense(A), Dense::Identity(A.rows(), A.rows())));
}

// The system solved by solvers that suit it. Expected: the answer of dense LU.
void expect_dense_answers(const Matrix& A, std::vector<SparseSolver*> solvers) {
    for (SparseSolver* const solver : solvers) {
        SCOPED_TRACE(solver - *solvers.begin());
        solver->factor(A);
        // 10: growth of the factors, as pivots need not be the largest.
        const double rounding = 10 * condition(A) * std::numeric_limits<double>::epsilon();
        EXPECT_LT(difference_from_dense(*solver, A, waves(A.rows(), 1)), rounding);
        EXPECT_LT(difference_from_dense(*solver, A, waves(A.rows(), 7)), rounding);
    }
}

TEST(Sparse, answersAreThoseOfDenseSolvers) {
    SparseLu lu;
    SparseLuLarge large;
    SparseCholesky cholesky;
    expect_dense_answers(positive_definite(), {&lu, &large, &cholesky});
    expect_dense_answers(saddle().A, {&lu, &large});
    expect_dense_answers(flow().A, {&lu, &large});
    // A pattern far from symmetric: diagonal blocks of a permutation and some more.
    Dense A = Dense::Zero(9, 9);
    for (int i = 0; i < 9; ++i) A(i, (i + 4) % 9) = 1 + i, A(i, 8) = 0.5;
    expect_dense_answers(sparse(A), {&lu, &large});
    // One unknown.
    expect_dense_answers(sparse(Dense::Constant(1, 1, 4)), {&lu, &large, &cholesky});
}

TEST(Sparse, supernodalCholeskyIsRight) {
    // 2562 unknowns: large enough for supernodes. Expected: the vector from which the right-hand side was made.
    const Matrix A = sphere::helmholtz(sphere::icosphere(3), 2, 1, 0.1);
    const Dense X = waves(A.rows(), 3);
    SparseCholesky cholesky;
    cholesky.factor(A);
    EXPECT_LT((cholesky.solve(A * X) - X).cwiseAbs().maxCoeff(), 1e-11);
}

template <class Solver>
void expect_reuse() {
    Solver solver;
    for (const double mass : {1.0, 2.0, 3.0}) {
        solver.factor(positive_definite(mass));
        EXPECT_LT(difference_from_dense(solver, positive_definite(mass), waves(162, 1)), 1e-12) << mass;
    }
    EXPECT_EQ(solver.counters().analysed, 1);
    EXPECT_EQ(solver.counters().factored + solver.counters().refactored, 3);
    // The lower triangle alone counts for a Cholesky factorisation.
    EXPECT_GT(solver.counters().fill, positive_definite().nonZeros() / 2);
    // Other patterns: of another size, and of the same.
    solver.factor(sphere::helmholtz(sphere::icosphere(0), 3, 1, 1));
    EXPECT_EQ(solver.counters().analysed, 2);
    Matrix bordered = sphere::helmholtz(sphere::icosphere(0), 3, 1, 1);
    bordered.coeffRef(0, 91) = bordered.coeffRef(91, 0) += 1e-3;
    ASSERT_EQ(bordered.nonZeros(), sphere::helmholtz(sphere::icosphere(0), 3, 1, 1).nonZeros() + 2);
    solver.factor(bordered);
    EXPECT_EQ(solver.counters().analysed, 3);
    EXPECT_LT(difference_from_dense(solver, bordered, waves(92, 1)), 1e-12);
}

TEST(Sparse, analysisIsKeptWithThePattern) {
    expect_reuse<SparseLu>();
    expect_reuse<SparseLuLarge>();
    expect_reuse<SparseCholesky>();
}

TEST(Sparse, refinementMakesUpForWeakPivots) {
    // Diagonal pivots are taken down to 1e-3 of their column, and 2e-3 makes the factors grow by 500: three digits of
    // the residual are lost, which one step brings back to rounding.
    Dense A = Dense::NullaryExpr(30, 30, [](auto i, auto j) { return std::cos(double(3 * i * i + 5 * j + i * j)); });
    A.diagonal().setConstant(2e-3);
    const Vector b = waves(30, 1);
    SparseLuLarge lu;
    lu.factor(sparse(A));
    const auto residual = [&](int refinements) {
        const Vector x = lu.solve(b, refinements);
        return (b - A * x).norm() / (A.norm() * x.norm());
    };
    EXPECT_GT(residual(0), 10 * residual(1));
    EXPECT_LT(residual(1), std::numeric_limits<double>::epsilon());
}

TEST(Sparse, refinementHelpsAnIllConditionedSystem) {
    // The same with a column almost the sum of two others: condition number beyond 1e8. Expected: the vector from which
    // the right-hand side was made, in numbers that make the product exact to rounding.
    Dense A = Dense::NullaryExpr(30, 30, [](auto i, auto j) { return std::cos(double(3 * i * i + 5 * j + i * j)); });
    A.diagonal().setConstant(2e-3);
    A.col(29) = A.col(3) + A.col(4) + 1e-8 * A.col(29);
    ASSERT_GT(condition(sparse(A)), 1e8);
    const Vector x = Vector::Ones(30);
    SparseLuLarge lu;
    lu.factor(sparse(A));
    const double before = (lu.solve(A * x) - x).norm(), after = (lu.solve(A * x, 2) - x).norm();
    EXPECT_GT(before, 10 * after);
    EXPECT_LT(after, condition(sparse(A)) * std::numeric_limits<double>::epsilon());
}

TEST(Ordering, keepsTheUnknownsOfANodeTogether) {
    const sphere::System s = flow();
    const Ordering ordering = nested_dissection(s.A, s.node_of_unknown);
    Ordering sorted = ordering;
    std::sort(sorted.begin(), sorted.end());
    Ordering all(s.A.rows());
    std::iota(all.begin(), all.end(), 0);
    EXPECT_EQ(sorted, all);
    std::vector<int> nodes;
    for (const int i : ordering) nodes.push_back(s.node_of_unknown[i]);
    const auto changes = [&] {
        int n = 1;
        for (std::size_t k = 1; k < nodes.size(); ++k) n += nodes[k] != nodes[k - 1];
        return n;
    };
    EXPECT_EQ(changes(), 92);  // P_3 nodes on 20 triangles: 12 + 2 * 30 + 20
    for (std::size_t k = 1; k < ordering.size(); ++k)
        EXPECT_TRUE(nodes[k] != nodes[k - 1] || ordering[k - 1] < ordering[k]) << k;
}

TEST(Ordering, savesFillAndLeavesTheAnswer) {
    const sphere::System s = sphere::saddle(sphere::icosphere(1), 3, 3);
    Ordering by_number(s.A.rows());
    std::iota(by_number.begin(), by_number.end(), 0);
    SparseLuLarge dissected(nested_dissection(s.A, s.node_of_unknown)), natural(by_number), chosen;
    const Vector x = waves(s.A.rows(), 1);
    for (SparseLuLarge* lu : {&dissected, &natural, &chosen}) {
        lu->factor(s.A);
        EXPECT_LT((lu->solve(s.A * x) - x).cwiseAbs().maxCoeff(), 1e-9);
    }
    // Dissection has asymptotically less fill, n log n instead of n^(3/2); on so few nodes that is a factor beyond 3.
    EXPECT_LT(3 * dissected.counters().fill, natural.counters().fill);
    EXPECT_LT(3 * chosen.counters().fill, natural.counters().fill);
}

TEST(Ordering, refusesWhatDoesNotFit) {
    const Matrix A = sparse(Dense::Identity(3, 3));
    for (const Ordering& ordering : {Ordering{0, 1}, Ordering{0, 1, 1}, Ordering{0, 1, 3}})
        EXPECT_EQ(message_of([&] { SparseLuLarge(ordering).factor(A); }),
                  "ordering of " + std::to_string(ordering.size()) + " unknowns is not a permutation of 3");
    EXPECT_EQ(message_of([&] { nested_dissection(A, {0, 1}); }), "2 nodes from 0 to 1 for a matrix of size 3");
    EXPECT_EQ(message_of([&] { nested_dissection(A, {0, -1, 1}); }), "3 nodes from -1 to 1 for a matrix of size 3");
    EXPECT_EQ(message_of([&] { nested_dissection(A, {0, 3, 1}); }), "3 nodes from 0 to 3 for a matrix of size 3");
    EXPECT_EQ(message_of([&] { nested_dissection(Matrix(2, 3)); }), "a solver needs a square matrix, not 2 x 3");
    EXPECT_EQ(nested_dissection(A, {0, 0, 0}), Ordering({0, 1, 2}));
}

template <class Solver>
void expect_common_refusals() {
    Solver solver;
    EXPECT_EQ(message_of([&] { solver.factor(Matrix(2, 3)); }), "a solver needs a square matrix, not 2 x 3");
    EXPECT_EQ(message_of([&] { solver.factor(Matrix(0, 0)); }), "a solver needs a square matrix, not 0 x 0");
    EXPECT_EQ(message_of([&] {
                  solver.factor(sparse(Dense{{1, 0}, {0, std::nan("")}}));
              }),
              "matrix entry (1, 1) is nan");
    // Constants are in the kernel of the stiffness matrix.
    EXPECT_THROW(solver.factor(positive_definite(0)), SolveError);
    EXPECT_EQ(message_of([&] { solver.solve(Vector::Ones(162)); }),
              "SparseSolver::solve needs factors: call factor() first");
    // Rows differ in the last bit: condition number 8/epsilon.
    const double e = std::numeric_limits<double>::epsilon();
    EXPECT_CONTAINS(message_of([&] {
                        solver.factor(sparse(Dense{{1, 1}, {1, 1 + e}}));
                    }),
                    "matrix of size 2 is nearly singular: condition number about");
    // It works again afterwards, with the same pattern and another.
    solver.factor(sparse(Dense{{1, 1}, {1, 3}}));
    EXPECT_LT((solver.solve(Vector{{2, 4}}) - Vector{{1, 1}}).norm(), 1e-15);
    EXPECT_EQ(message_of([&] { solver.solve(Vector::Ones(3)); }), "right-hand side of size 3 for a matrix of size 2");
    EXPECT_EQ(message_of([&] {
                  solver.solve(Vector{{1, std::nan("")}});
              }),
              "right-hand side for a matrix of size 2 is not finite");
    solver.factor(sparse(1e-300 * Dense{{1, 0}, {0, 1}}));
    EXPECT_EQ(message_of([&] { solver.solve(Vector{{1e10, 1}}); }), "solution of size 2 is not finite");
    solver.factor(positive_definite());
    EXPECT_LT(difference_from_dense(solver, positive_definite(), waves(162, 1)), 1e-12);
    Solver other = std::move(solver);
    EXPECT_LT(difference_from_dense(other, positive_definite(), waves(162, 1)), 1e-12);
}

TEST(Sparse, refusesWhatHasNoAnswer) {
    expect_common_refusals<SparseLu>();
    expect_common_refusals<SparseLuLarge>();
    expect_common_refusals<SparseCholesky>();
}

TEST(SparseLuLarge, countsZeroPivots) {
    // Column 1 is empty; rows 0 and 1 are the same, twice.
    SparseLuLarge lu;
    EXPECT_EQ(message_of([&] {
                  lu.factor(sparse(Dense{{1, 0, 0}, {0, 0, 1}, {1, 0, 1}}));
              }),
              "matrix of size 3 is singular: 1 pivots are zero");
    EXPECT_EQ(message_of([&] {
                  lu.factor(sparse(Dense{{1, 2, 4}, {1, 2, 4}, {1, 2, 4}}));
              }),
              "matrix of size 3 is singular: 2 pivots are zero");
}

TEST(SparseCholesky, namesWhatIsNotSymmetricPositiveDefinite) {
    SparseCholesky cholesky;
    for (const Dense& A : {Dense{{1, 2}, {2.001, 5}}, Dense{{2, 0}, {1, 2}}, Dense{{2, 1}, {0, 2}}})
        EXPECT_EQ(message_of([&] { cholesky.factor(sparse(A)); }), "matrix of size 2 is not symmetric");
    // Rounding in an assembly does not count as asymmetry.
    cholesky.factor(sparse(Dense{{1e8, 1 + 1e-9}, {1, 1}}));
    EXPECT_EQ(message_of([&] {
                  cholesky.factor(sparse(Dense{{1, 0}, {0, -2}}));
              }),
              "matrix of size 2 is not positive definite: no positive pivot for unknown 1");
    // Eigenvalues 3 and -1; eliminated in any order.
    EXPECT_THROW(cholesky.factor(sparse(Dense{{1, 2}, {2, 1}})), SolveError);
    // Constants have a negative energy, though all diagonal entries are positive; supernodal.
    EXPECT_CONTAINS(message_of([&] { cholesky.factor(sphere::helmholtz(sphere::icosphere(3), 2, -1e-3, 1)); }),
                    "matrix of size 2562 is not positive definite: no positive pivot for unknown");
    EXPECT_THROW(cholesky.factor(saddle(0).A), SolveError);
    // Pivots far apart are estimated, and refused from a condition number of 1/epsilon = 4.5e15 on: here 1e15 and 1e16.
    cholesky.factor(sparse(Dense{{1, 0}, {0, 1e-15}}));
    EXPECT_EQ(message_of([&] {
                  cholesky.factor(sparse(Dense{{1, 0}, {0, 1e-16}}));
              }),
              "matrix of size 2 is nearly singular: condition number about 1.0e+16");
}

}  // namespace tubule::sparse_test
