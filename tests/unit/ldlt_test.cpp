// common/solve/sparse_ldlt and gmres: factors without pivoting, and the iteration that makes up for what they leave
// out.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "common/solve/bordered_ldlt.hpp"
#include "common/solve/dense.hpp"
#include "common/solve/gmres.hpp"
#include "common/solve/sparse_ldlt.hpp"
#include "tests/sphere_matrices.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::ldlt_test {

using Matrix = Eigen::SparseMatrix<double>;
using Dense = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

Vector waves(Eigen::Index n) {
    return Vector::LinSpaced(n, 0, 7).array().sin();
}

Matrix sparse(const Dense& A) {
    return A.sparseView(0, 0);
}

using test::message_of;

// Symmetric, with this many positive and negative diagonal blocks' unknowns in random order: a random B between them
// with a few nonzero entries a row, and diagonals that outweigh it or not. In units that differ by unknown.
Dense quasi_definite(int positive, int negative, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> number(-1, 1);
    const int n = positive + negative;
    std::vector<int> place(n);
    std::iota(place.begin(), place.end(), 0);
    std::shuffle(place.begin(), place.end(), random);
    Dense A = Dense::Zero(n, n);
    const auto add = [&](int i, int j, double a) {
        A(place[i], place[j]) += a;
        if (i != j) A(place[j], place[i]) += a;
    };
    for (int i = 0; i < n; ++i) {
        const bool is_negative = i >= positive;
        add(i, i, is_negative ? -1 : 1);
        for (int k = 0; k < 3; ++k) {
            const int j = static_cast<int>(random() % n);
            // Within a block it stays dominated by the diagonal; between blocks it may be large.
            const bool same_block = (j >= positive) == is_negative;
            if (j != i) add(i, j, (same_block ? 0.05 : 3) * number(random));
        }
    }
    const Vector units = Vector::NullaryExpr(n, [&] { return std::pow(10, 3 * number(random)); });
    return units.asDiagonal() * A * units.asDiagonal();
}

int negative_eigenvalues(const Dense& A) {
    return static_cast<int>((eigenpairs(A, false).values.array() < 0).count());
}

// Error relative to the answer of dense LU, in units in which the diagonal is 1.
template <class Scalar>
double error(const SparseLdlt<Scalar>& factors, const Dense& A, const Vector& b) {
    const Vector units = A.diagonal().cwiseAbs().cwiseSqrt();
    const Vector expected = units.cwiseProduct(solve_dense(A, b)), found = units.cwiseProduct(factors.solve(b));
    return (found - expected).norm() / expected.norm();
}

double scaled_condition(const Dense& A) {
    const Vector units = A.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
    const Dense scaled = units.asDiagonal() * A * units.asDiagonal();
    const Vector eigenvalues = eigenpairs(scaled, false).values.cwiseAbs();
    return eigenvalues.maxCoeff() / eigenvalues.minCoeff();
}

template <class Scalar>
void expect_dense_answers() {
    for (unsigned seed = 1; seed <= 8; ++seed) {
        const int positive = 20 + 31 * seed, negative = 10 + 7 * seed;
        const Dense A = quasi_definite(positive, negative, seed);
        SparseLdlt<Scalar> factors;
        factors.factor(sparse(A));
        EXPECT_EQ(factors.pivots().negative, negative) << seed;
        EXPECT_EQ(factors.pivots().negative, negative_eigenvalues(A)) << seed;
        // Higham's bound for factors without pivoting, n epsilon |L||D||L^T|, times the condition number.
        const double n = static_cast<double>(A.rows()), growth = 1 + factors.pivots().growth;
        const double bound = 10 * n * std::numeric_limits<Scalar>::epsilon() * growth * scaled_condition(A);
        EXPECT_LT(bound, std::sqrt(std::numeric_limits<Scalar>::epsilon()) * 300) << seed;
        EXPECT_LT(error(factors, A, A * waves(A.rows())), bound) << seed;
    }
}

TEST(SparseLdlt, answersAreThoseOfDenseSolvers) {
    expect_dense_answers<double>();
    expect_dense_answers<float>();
}

TEST(SparseLdlt, frontsOfManyBlocksAreRight) {
    // A dense matrix is one supernode of several blocks of columns; two coupled by a third are three, with updates of
    // several tiles. Expected: dense LU, and +-1 on the diagonal decide the inertia.
    for (const int n : {1, 2, 63, 64, 65, 200, 350}) {
        Dense A = Dense::NullaryExpr(n, n, [](auto i, auto j) { return std::cos(double(i * j)) / 400; });
        for (int i = 0; i < n; ++i) A(i, i) += i % 3 ? 1 : -1;
        SparseLdlt<double> factors;
        factors.factor(sparse(A));
        EXPECT_LT(error(factors, A, waves(n)), 1e-13) << n;
        EXPECT_EQ(factors.pivots().negative, (n + 2) / 3) << n;
        Dense chain = Dense::Zero(3 * n, 3 * n);
        for (int block = 0; block < 3; ++block) chain.block(block * n, block * n, n, n) = A;
        chain.block(2 * n, 0, n, 2 * n).setConstant(0.3 / n);
        chain.block(0, 2 * n, 2 * n, n).setConstant(0.3 / n);
        factors.factor(sparse(chain));
        EXPECT_LT(error(factors, chain, waves(3 * n)), 1e-13) << n;
    }
}

TEST(SparseLdlt, factorsTheSymmetricPart) {
    Dense A = quasi_definite(60, 30, 3);
    const Dense symmetric = A;
    // Entries of one triangle only, and differences between the triangles. By columns or by rows.
    A(3, 50) += 0.2, A(50, 3) -= 0.2;
    A(70, 7) += 0.6;
    Dense expected = symmetric;
    expected(70, 7) += 0.3, expected(7, 70) += 0.3;
    SparseLdlt<double> factors;
    factors.factor(sparse(A));
    EXPECT_LT(error(factors, expected, waves(90)), 1e-12);
    factors.factor(Eigen::SparseMatrix<double, Eigen::RowMajor>(sparse(A)));
    EXPECT_LT(error(factors, expected, waves(90)), 1e-12);
}

TEST(SparseLdlt, analysisIsKeptWithThePattern) {
    SparseLdlt<double> factors;
    for (const double mass : {1.0, 2.0, 3.0}) {
        const Matrix A = sphere::helmholtz(sphere::icosphere(1), 2, mass, 0.1);
        factors.factor(A);
        EXPECT_LT(error(factors, A, waves(162)), 1e-12) << mass;
        EXPECT_EQ(factors.pivots().negative, 0);
        EXPECT_LE(factors.pivots().growth, 1 + 1e-12);  // l_ij^2 d_j <= a_ii of a positive definite matrix
    }
    EXPECT_EQ(factors.counters().analysed, 1);
    EXPECT_EQ(factors.counters().factored, 3);
    EXPECT_GE(factors.counters().fill, sphere::helmholtz(sphere::icosphere(1), 2, 1, 1).nonZeros() / 2);
    // The same number of entries in other places, and another size.
    Matrix bordered = sphere::helmholtz(sphere::icosphere(1), 2, 1, 1);
    bordered.coeffRef(0, 161) = bordered.coeffRef(161, 0) += 1e-3;
    factors.factor(bordered);
    EXPECT_EQ(factors.counters().analysed, 2);
    EXPECT_LT(error(factors, bordered, waves(162)), 1e-12);
    factors.factor(sparse(Dense{{2}}));
    EXPECT_EQ(factors.counters().analysed, 3);
    EXPECT_EQ(factors.solve(Vector{{1}})[0], 0.5);
    SparseLdlt<double> other = std::move(factors);
    EXPECT_EQ(other.solve(Vector{{3}})[0], 1.5);
}

// A saddle point of a mesh's motion: 4 unknowns a node, a zero block on the diagonal.
sphere::System motion(int level) {
    return sphere::saddle(sphere::icosphere(level), 2, 0);
}

TEST(SparseLdlt, solvesASaddlePointInTheOrderOfItsNodes) {
    // 2568 unknowns, enough for several subtrees at once. Expected: the vector from which the right-hand side was made,
    // and one negative eigenvalue a constraint (the stiffness is positive where they hold).
    const sphere::System s = motion(2);
    SparseLdlt<double> factors(nested_dissection(s.A, s.node_of_unknown));
    factors.factor(s.A);
    const Vector x = waves(s.A.rows());
    EXPECT_LT((factors.solve(s.A * x) - x).norm(), 1e-10 * x.norm());
    EXPECT_EQ(factors.pivots().negative, s.A.rows() / 4);
    // To the last bit the same once more.
    const Vector first = factors.solve(x);
    factors.factor(s.A);
    EXPECT_EQ(factors.solve(x), first);
}

TEST(SparseLdlt, singularMatricesAreRefused) {
    SparseLdlt<double> factors;
    EXPECT_EQ(message_of([&] {
                  factors.factor(sparse(Dense{{1, 1}, {1, 1}}));
              }),
              "matrix of size 2 is singular or not quasi-definite: pivot 0.0e+00 for unknown 1, with diagonals scaled "
              "to 1");
    EXPECT_EQ(message_of([&] { factors.solve(Vector::Ones(2)); }),
              "SparseLdlt::solve needs factors: call factor() first");
    // Constants are in the kernel of the stiffness matrix.
    EXPECT_THROW(factors.factor(sphere::helmholtz(sphere::icosphere(1), 2, 0, 1)), SolveError);
    // Two constraints that are the same.
    EXPECT_THROW(factors.factor(sparse(Dense{{1, 0, 1, 1}, {0, 1, 2, 2}, {1, 2, 0, 0}, {1, 2, 0, 0}})), SolveError);
    EXPECT_EQ(
        message_of([&] {
            factors.factor(sparse(Dense{{0, 1}, {1, 0}}));
        }),
        "matrix of size 2 is singular or not a saddle point: unknown 0 has no entry on the diagonal and none with "
        "an unknown that has one");
    EXPECT_EQ(message_of([&] {
                  factors.factor(sparse(Dense{{1, 0}, {0, std::nan("")}}));
              }),
              "matrix entry (1, 1) is nan");
    EXPECT_EQ(message_of([&] {
                  factors.factor(sparse(Dense{{1, HUGE_VAL}, {HUGE_VAL, 1}}));
              }),
              "matrix entry (1, 0) is inf");
    // In a subtree, not only at the end; and in one precision, not in the other.
    sphere::System s = motion(2);
    s.A.coeffRef(40, 40) = std::nan("");
    SparseLdlt<double> dissected(nested_dissection(s.A, s.node_of_unknown));
    EXPECT_EQ(message_of([&] { dissected.factor(s.A); }), "matrix entry (40, 40) is nan");
    const Dense near{{1, 1}, {1, 1 + 1e-9}};
    EXPECT_THROW(SparseLdlt<float>().factor(sparse(near)), SolveError);
    // It works again afterwards, with the same pattern.
    factors.factor(sparse(near));
    EXPECT_NEAR(factors.solve(Vector{{2, 2 + 1e-9}})[0], 1, 1e-6);
}

TEST(SparseLdlt, badInputIsRefused) {
    SparseLdlt<float> factors;
    EXPECT_EQ(message_of([&] { factors.factor(Matrix(2, 3)); }), "SparseLdlt needs a square matrix, not 2 x 3");
    EXPECT_EQ(message_of([&] { factors.factor(Matrix(0, 0)); }), "SparseLdlt needs a square matrix, not 0 x 0");
    EXPECT_EQ(message_of([&] {
                  SparseLdlt<float>({0, 0}).factor(sparse(Dense::Identity(2, 2)));
              }),
              "ordering of 2 unknowns is not a permutation of 2");
    factors.factor(sparse(Dense::Identity(2, 2)));
    EXPECT_EQ(message_of([&] { factors.solve(Vector::Ones(3)); }), "right-hand side of size 3 for a matrix of size 2");
    EXPECT_EQ(message_of([&] {
                  factors.solve(Vector{{1, std::nan("")}});
              }),
              "right-hand side for a matrix of size 2 is not finite");
    EXPECT_EQ(message_of([&] { factors.solve(Vector{{1, 1e300}}); }), "solution of size 2 is not finite");
}

TEST(SparseLdlt, regularisationStandsInForAZeroDiagonal) {
    // Diagonal 4 and zero; the second scaled by its elimination, 2^2/4 = 1, so that -0.5 stands for -0.5.
    SparseLdlt<double> factors({1, 0}, 0.5);
    factors.factor(sparse(Dense{{4, 2}, {2, 0}}));
    const Vector x{{1, 2}};
    EXPECT_LT((factors.solve(Dense{{4, 2}, {2, -0.5}} * x) - x).norm(), 1e-14);
    // Without it that order has no factors.
    EXPECT_THROW(SparseLdlt<double>({1, 0}).factor(sparse(Dense{{4, 2}, {2, 0}})), SolveError);
}

TEST(Gmres, singlePrecisionFactorsLeadToFullAccuracy) {
    // Expected: the vector from which the right-hand side was made.
    const sphere::System s = sphere::almost_symmetric(sphere::flow(sphere::icosphere(1), 3, 1e-2), 1e-2);
    const Vector x = waves(s.A.rows()), b = s.A * x;
    SparseLdlt<float> factors(nested_dissection(s.A, s.node_of_unknown), 1e-5);
    factors.factor(s.A);
    // One negative eigenvalue for each p, H and K of the saddle point.
    const int nodes = *std::max_element(s.node_of_unknown.begin(), s.node_of_unknown.end()) + 1;
    EXPECT_EQ(factors.pivots().negative, s.A.rows() - 3 * nodes);
    Gmres gmres(static_cast<int>(s.A.rows()));
    const auto product = [&](const Vector& u, Vector& v) { v.noalias() = s.A * u; };
    const auto precondition = [&](const Vector& u, Vector& v) { factors.solve(u, v); };
    Vector found = Vector::Zero(x.size());
    const Gmres::Answer answer = gmres.solve(product, precondition, b, found, 1e-12, 40);
    EXPECT_LE(answer.residual, 1e-12);
    EXPECT_LE((b - s.A * found).norm(), 1.01e-12 * b.norm());
    EXPECT_LT((found - x).norm(), 1e-9 * x.norm());
    EXPECT_LE(answer.iterations, 30);
    // From the answer there is nothing left to do; from near it, less.
    EXPECT_EQ(gmres.solve(product, precondition, b, found, 1e-12, 40).iterations, 0);
    found *= 1 + 1e-6;
    EXPECT_LT(gmres.solve(product, precondition, b, found, 1e-12, 40).iterations, answer.iterations);
}

void copy(const Vector& u, Vector& v) {
    v = u;
}

TEST(Gmres, endsWithinTheDegreeOfTheMinimalPolynomial) {
    // 40 unknowns, 5 eigenvalues: exact after 5 iterations, and not before.
    const Vector eigenvalue = Vector::NullaryExpr(40, [](auto i) { return 1.0 + i % 5; });
    const auto product = [&](const Vector& u, Vector& v) { v = eigenvalue.cwiseProduct(u); };
    Vector x = Vector::Zero(40);
    EXPECT_EQ(Gmres(40).solve(product, copy, Vector::Ones(40), x, 1e-13, 20).iterations, 5);
    EXPECT_LT((x - eigenvalue.cwiseInverse()).norm(), 1e-13);
    // Begun anew every two iterations it takes longer and arrives as well.
    x.setZero();
    EXPECT_GT(Gmres(40, 2).solve(product, copy, Vector::Ones(40), x, 1e-13, 200).iterations, 5);
    EXPECT_LT((x - eigenvalue.cwiseInverse()).norm(), 1e-12);
    x.setOnes();
    EXPECT_EQ(Gmres(40).solve(product, copy, Vector::Zero(40), x, 1e-13, 20).iterations, 0);
    EXPECT_EQ(x, Vector::Zero(40));
}

TEST(Gmres, failsLoudly) {
    Gmres gmres(20);
    Vector x = Vector::Zero(20);
    const auto solve = [&](const Gmres::Operator& A, int most, double tolerance = 1e-10) {
        return message_of([&] {
            x.setZero();
            gmres.solve(A, copy, Vector::Unit(20, 0), x, tolerance, most);
        });
    };
    // A cyclic shift: GMRES learns nothing before the last of 20 iterations.
    const auto shift = [](const Vector& u, Vector& v) {
        for (int i = 0; i < 20; ++i) v[(i + 1) % 20] = u[i];
    };
    EXPECT_EQ(solve(shift, 20), "accepted");
    EXPECT_EQ(solve(shift, 19),
              "GMRES of size 20 ended at a residual of 1.0e+00 after 19 iterations; the tolerance is 1.0e-10");
    // The sum of the first row is out of reach.
    const auto singular = [](const Vector& u, Vector& v) {
        v = u;
        v[0] = 0;
    };
    EXPECT_EQ(solve(singular, 20),
              "GMRES of size 20 stagnated at a residual of 1.0e+00 after 1 iterations; "
              "the tolerance is 1.0e-10");
    const auto diagonal = [](const Vector& u, Vector& v) {
        v = u.cwiseProduct(Vector::LinSpaced(20, 1, 20)) + 0.1 * u.reverse();
    };
    EXPECT_CONTAINS(solve(diagonal, 1), "GMRES of size 20 ended at a residual of ");
    // Rounding is the end of all.
    const Vector full = Vector::LinSpaced(20, 1, 2).cwiseSqrt();  // as a unit vector might be met exactly
    const std::string rounding = message_of([&] { gmres.solve(diagonal, copy, full, x, 1e-20, 100); });
    EXPECT_CONTAINS(rounding, "the tolerance is 1.0e-20");
    const auto broken = [](const Vector& u, Vector& v) { v = u * std::nan(""); };
    EXPECT_EQ(message_of([&] { gmres.solve(diagonal, broken, Vector::Ones(20), x, 1e-10, 10); }),
              "GMRES: vector 1 of size 20 is not finite");
    Vector other(3);
    EXPECT_EQ(message_of([&] { gmres.solve(shift, copy, Vector::Ones(20), other, 1e-10, 10); }),
              "GMRES of size 20 with vectors of sizes 20 and 3");
    EXPECT_EQ(message_of([] { Gmres(0); }), "Gmres of size 0, restarted after 30");
    x.setConstant(std::nan(""));
    EXPECT_EQ(message_of([&] { gmres.solve(shift, copy, Vector::Ones(20), x, 1e-10, 10); }),
              "the right-hand side or the initial guess of GMRES is not finite");
}

// Dense LU of the whole.
TEST(BorderedLdlt, solvesWithAndWithoutPivots) {
    const int n = 60, border = 4;
    for (const bool regular : {true, false}) {
        Dense A = Dense::Zero(n + border, n + border);
        A.topLeftCorner(n, n) = quasi_definite(40, 20, 3);
        if (!regular) A.block(0, 0, 2, n).setZero(), A.block(0, 0, n, 2).setZero(), A(0, 1) = A(1, 0) = 1;
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < border; ++j) A(i, n + j) = std::sin(i * (j + 1)), A(n + j, i) = std::cos(i * (j + 2));
        A.bottomRightCorner(border, border).diagonal().setConstant(0.3);
        BorderedLdlt factors(nested_dissection(sparse(A.topLeftCorner(n, n))), border);
        factors.factor(sparse(A));
        EXPECT_EQ(factors.pivoted(), !regular);
        const Vector b = waves(n + border), x = factors.solve(b);
        EXPECT_LT((A * x - b).norm(), 1e-9 * b.norm());
        if (regular) {
            EXPECT_EQ(factors.negative(), negative_eigenvalues(A.topLeftCorner(n, n)));
        }
    }
}

}  // namespace tubule::ldlt_test
