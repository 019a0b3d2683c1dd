// common/solve: sparse solver, derivative checker, stop reasons, progress, interruption.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <limits>
#include <set>
#include <string>

#include "common/solve/derivative_check.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/progress.hpp"
#include "common/solve/sparse.hpp"
#include "common/solve/stop.hpp"
#include "tests/support/message_of.hpp"
#include "tests/support/screen.hpp"

namespace tubule::solve_test {

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;
using Entries = std::vector<Eigen::Triplet<double>>;

Matrix matrix(int n, const Entries& entries) {
    Matrix A(n, n);
    A.setFromTriplets(entries.begin(), entries.end());
    return A;
}

// Periodic and unsymmetric: 4 + shift on the diagonal, -1 - i/n to the right, -2 to the left.
Matrix ring(int n, double shift = 0) {
    Entries entries;
    for (int i = 0; i < n; ++i) {
        entries.emplace_back(i, i, 4 + shift);
        entries.emplace_back(i, (i + 1) % n, -1 - double(i) / n);
        entries.emplace_back(i, (i + n - 1) % n, -2);
    }
    return matrix(n, entries);
}

Vector waves(int n) {
    return Vector::LinSpaced(n, 0, 7).array().sin();
}

using test::message_of;

TEST(SparseLu, solves) {
    // Expected: the x from which the right-hand side was made; |A| < 9, so rounding is far below 1e-13.
    const Matrix A = ring(100);
    const Vector x = waves(100);
    SparseLu lu;
    lu.factor(A);
    EXPECT_LT((lu.solve(A * x) - x).norm(), 1e-13);
}

TEST(SparseLu, reusesOrderingAndPivots) {
    SparseLu lu;
    const Vector x = waves(50);
    for (double shift : {0.0, 0.1, 0.2}) {
        const Matrix A = ring(50, shift);
        lu.factor(A);
        EXPECT_LT((lu.solve(A * x) - x).norm(), 1e-13) << shift;
    }
    EXPECT_EQ(lu.counters().analysed, 1);
    EXPECT_EQ(lu.counters().factored, 1);
    EXPECT_EQ(lu.counters().refactored, 2);
    lu.factor(ring(51));  // another pattern
    EXPECT_EQ(lu.counters().analysed, 2);
    EXPECT_EQ(lu.counters().factored, 2);
}

TEST(SparseLu, choosesFreshPivotsWhenTheOldOnesTurnBad) {
    // Pivots on the diagonal suit the first matrix; with 1e-14 there, they would cost all but two digits of the second.
    const auto A = [](double d) {
        return matrix(
            3, {{0, 0, d}, {0, 1, 1}, {0, 2, 2}, {1, 0, 1}, {1, 1, d}, {1, 2, 1}, {2, 0, 1}, {2, 1, 3}, {2, 2, d}});
    };
    const Vector x{{1, 2, 3}};
    SparseLu lu;
    lu.factor(A(10));
    lu.factor(A(1e-14));
    EXPECT_LT((lu.solve(A(1e-14) * x) - x).norm(), 1e-13);
    EXPECT_EQ(lu.counters().analysed, 1);
    EXPECT_EQ(lu.counters().factored, 2);
}

TEST(SparseLu, refinementGainsDigits) {
    // Hilbert matrix of order 6 (condition number 1.5e7), exact x = 1: refinement cannot beat the conditioning,
    // but it brings the residual down to rounding, 2.5 = |A| |x| times epsilon.
    Entries entries;
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) entries.emplace_back(i, j, 1.0 / (i + j + 1));
    const Matrix A = matrix(6, entries);
    const Vector b = A * Vector::Ones(6);
    SparseLu lu;
    lu.factor(A);
    const Vector x = lu.solve(b, 1);
    EXPECT_LT((A * x - b).norm(), 1e-15);
    EXPECT_LT((x - Vector::Ones(6)).norm(), 1.5e7 * 2.5 * std::numeric_limits<double>::epsilon());
}

TEST(SparseLu, uncompressedMatricesAreTheSame) {
    Matrix A = ring(10);
    A.uncompress();
    const Vector x = waves(10);
    SparseLu lu;
    lu.factor(A);
    EXPECT_LT((lu.solve(A * x) - x).norm(), 1e-14);
}

TEST(SparseLu, namesSingularMatrices) {
    SparseLu lu;
    // Row 2 is the sum of rows 0 and 1, in numbers that scaling and elimination leave exact.
    const Matrix dependent = matrix(3, {{0, 0, 2}, {0, 1, 1}, {1, 1, 1}, {1, 2, 2}, {2, 0, 2}, {2, 1, 2}, {2, 2, 2}});
    EXPECT_THROW(lu.factor(dependent), SolveError);
    EXPECT_CONTAINS(message_of([&] { lu.factor(dependent); }), "matrix of size 3 is singular: no pivot in column");
    // Column 1 is empty.
    EXPECT_EQ(message_of([&] {
                  lu.factor(matrix(3, {{0, 0, 1}, {1, 2, 1}, {2, 2, 1}, {2, 0, 1}}));
              }),
              "matrix of size 3 is singular: no pivot in column 1");
    // Rows differ by 1e-17 relative to their size after scaling: the condition number exceeds 1/epsilon = 4.5e15.
    const double e = std::numeric_limits<double>::epsilon();
    EXPECT_CONTAINS(message_of([&] {
                        lu.factor(matrix(2, {{0, 0, 1}, {0, 1, 1}, {1, 0, 1}, {1, 1, 1 + e}}));
                    }),
                    "matrix of size 2 is nearly singular: condition number about");
    EXPECT_EQ(message_of([&] { lu.solve(Vector::Ones(2)); }), "SparseSolver::solve needs factors: call factor() first");
    // It works again afterwards.
    lu.factor(ring(8));
    EXPECT_LT((lu.solve(ring(8) * waves(8)) - waves(8)).norm(), 1e-14);
}

TEST(SparseLu, refusesWhatIsNoSystem) {
    SparseLu lu;
    EXPECT_EQ(message_of([&] { lu.factor(Matrix(2, 3)); }), "a solver needs a square matrix, not 2 x 3");
    EXPECT_EQ(message_of([&] { lu.factor(Matrix(0, 0)); }), "a solver needs a square matrix, not 0 x 0");
    EXPECT_EQ(message_of([&] {
                  lu.factor(matrix(2, {{0, 0, 1}, {1, 1, std::nan("")}}));
              }),
              "matrix entry (1, 1) is nan");
    lu.factor(ring(4));
    EXPECT_EQ(message_of([&] { lu.solve(Vector::Ones(3)); }), "right-hand side of size 3 for a matrix of size 4");
}

// A function with all derivatives: SUM exp(x_i x_{i+1}) + sin(x_i), on a ring; `error` is added to one gradient
// entry, `twist` to one Hessian entry, both relative.
struct Example {
    double error = 0, twist = 0;

    static Eigen::Index next(const Vector& x, Eigen::Index i) { return (i + 1) % x.size(); }
    double value(const Vector& x) const {
        double sum = 0;
        for (Eigen::Index i = 0; i < x.size(); ++i) sum += std::exp(x[i] * x[next(x, i)]) + std::sin(x[i]);
        return sum;
    }
    Vector gradient(const Vector& x) const {
        Vector g = x.array().cos();
        for (Eigen::Index i = 0; i < x.size(); ++i) {
            const auto j = next(x, i);
            const double e = std::exp(x[i] * x[j]);
            g[i] += e * x[j];
            g[j] += e * x[i];
        }
        g[0] *= 1 + error;
        return g;
    }
    Vector hessian_times(const Vector& x, const Vector& v) const {
        Vector y = -x.array().sin() * v.array();
        for (Eigen::Index i = 0; i < x.size(); ++i) {
            const auto j = next(x, i);
            const double e = std::exp(x[i] * x[j]);
            y[i] += e * (x[j] * x[j] * v[i] + (1 + x[i] * x[j]) * v[j]);
            y[j] += e * (x[i] * x[i] * v[j] + (1 + x[i] * x[j]) * v[i]);
        }
        y[0] *= 1 + error;
        y[1] *= 1 + twist;
        return y;
    }
    DerivativeCheck check(const Vector& x) const {
        return check_derivatives([&](const Vector& y) { return value(y); },
                                 [&](const Vector& y) { return gradient(y); },
                                 [&](const Vector& y, const Vector& v) { return hessian_times(y, v); }, x);
    }
};

const Vector state = 0.7 + 0.5 * waves(12).array();

TEST(DerivativeCheck, acceptsRightDerivatives) {
    // Taylor's theorem: both remainders are quadratic in the step.
    for (double size : {1e-3, 1.0, 2.0}) {
        const DerivativeCheck check = Example{}.check(size * state);
        EXPECT_TRUE(check.pass()) << size << "\n" << check.text();
        EXPECT_NEAR(check.gradient.slope, 2, 0.02) << size;
        EXPECT_NEAR(check.hessian.slope, 2, 0.02) << size;
    }
}

TEST(DerivativeCheck, refusesWrongDerivatives) {
    // A remainder that holds an error of the derivative is linear in the step.
    for (double error : {1.0, 1e-3, 1e-5}) {
        const DerivativeCheck wrong_gradient = Example{.error = error}.check(state);
        EXPECT_FALSE(wrong_gradient.gradient.pass) << error;
        EXPECT_TRUE(wrong_gradient.hessian.pass) << "it is the derivative of the wrong gradient";
        const DerivativeCheck wrong_hessian = Example{.twist = error}.check(state);
        EXPECT_TRUE(wrong_hessian.gradient.pass) << error;
        EXPECT_FALSE(wrong_hessian.hessian.pass) << error;
        EXPECT_FALSE(wrong_hessian.pass());
    }
    const DerivativeCheck check = Example{.error = 1}.check(state);
    EXPECT_NEAR(check.gradient.slope, 1, 0.02);
    EXPECT_CONTAINS(check.text(), "gradient: WRONG, Taylor slope 1.0");
    EXPECT_CONTAINS(check.text(), "Hessian : right, Taylor slope 2.0");
}

TEST(DerivativeCheck, toleratesNoise) {
    // Noise a thousand times rounding, as a badly conditioned energy has it, hides small steps, not the slope.
    const Example example;
    const auto noise = [](const Vector& x) { return 1e-12 * std::sin(1e9 * x.sum()); };
    const auto check =
        check_derivatives([&](const Vector& x) { return example.value(x) + noise(x); },
                          [&](const Vector& x) -> Vector { return example.gradient(x).array() + noise(x); },
                          [&](const Vector& x, const Vector& v) { return example.hessian_times(x, v); }, state);
    EXPECT_TRUE(check.pass()) << check.text();
    EXPECT_NEAR(check.gradient.slope, 2, 0.1);
    EXPECT_NEAR(check.hessian.slope, 2, 0.1);
}

TEST(DerivativeCheck, linearAndQuadraticFunctionsLeaveNoRemainder) {
    const Vector c = waves(12);
    const auto zero = [](const Vector& x, const Vector&) -> Vector { return Vector::Zero(x.size()); };
    const auto linear =
        check_derivatives([&](const Vector& x) { return c.dot(x); }, [&](const Vector&) { return c; }, zero, state);
    EXPECT_TRUE(linear.pass()) << linear.text();
    EXPECT_TRUE(std::isnan(linear.gradient.slope));
    EXPECT_TRUE(std::isnan(linear.hessian.slope));
    EXPECT_CONTAINS(linear.text(), "gradient: correct, linear up to rounding");

    const Matrix A = Matrix(ring(12) + Matrix(ring(12).transpose()));
    const auto form = [&](const Vector& x) { return 0.5 * x.dot(A * x); };
    const auto gradient = [&](const Vector& x) -> Vector { return A * x; };
    const auto quadratic = check_derivatives(
        form, gradient, [&](const Vector&, const Vector& v) -> Vector { return A * v; }, state);
    EXPECT_TRUE(quadratic.pass()) << quadratic.text();
    EXPECT_NEAR(quadratic.gradient.slope, 2, 0.02);
    EXPECT_TRUE(std::isnan(quadratic.hessian.slope));

    // A wrong constant gradient and a wrong constant Hessian are still found.
    EXPECT_FALSE(check_derivatives([&](const Vector& x) { return c.dot(x); },
                                   [&](const Vector&) -> Vector { return 1.00001 * c; }, zero, state)
                     .pass());
    EXPECT_FALSE(check_derivatives(
                     form, gradient, [&](const Vector&, const Vector& v) -> Vector { return 1.00001 * (A * v); }, state)
                     .pass());
    // x = 0 is a state as any other.
    EXPECT_TRUE(check_derivatives(
                    form, gradient, [&](const Vector&, const Vector& v) -> Vector { return A * v; }, Vector::Zero(12))
                    .pass());
}

TEST(DerivativeCheck, leavesOutInadmissibleSteps) {
    // -SUM log x_i near its barrier: large steps leave x > 0, small ones tell.
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const Vector x = Vector::Constant(4, 1) + Vector{{0, 0, 0, -0.98}};
    const auto value = [&](const Vector& y) { return y.minCoeff() > 0 ? -y.array().log().sum() : nan; };
    const auto gradient = [&](const Vector& y) -> Vector {
        return y.minCoeff() > 0 ? Vector(-y.cwiseInverse()) : Vector::Constant(y.size(), nan);
    };
    const auto hessian = [&](const Vector& y, const Vector& v) -> Vector { return v.array() / y.array().square(); };
    const auto check = check_derivatives(value, gradient, hessian, x);
    EXPECT_TRUE(check.pass()) << check.text();
    EXPECT_LT(check.gradient.h_large, 1e-1);

    // Where no step is admissible, nothing was checked, which does not count as a pass.
    const auto only_here = check_derivatives([&](const Vector& y) { return y == x ? 1.0 : nan; },
                                             [&](const Vector&) { return x; }, hessian, x);
    EXPECT_FALSE(only_here.pass());
    EXPECT_CONTAINS(only_here.text(), "gradient: NOT CHECKED");
}

TEST(DerivativeCheck, refusesWhatDoesNotFit) {
    const Example e;
    const auto value = [&](const Vector& x) { return e.value(x); };
    const auto gradient = [&](const Vector& x) { return e.gradient(x); };
    const auto hessian = [&](const Vector& x, const Vector& v) { return e.hessian_times(x, v); };
    EXPECT_EQ(message_of([&] { check_derivatives(value, gradient, hessian, Vector()); }),
              "the derivative check needs a state of size 1 or more");
    EXPECT_EQ(message_of([&] {
                  check_derivatives(
                      value, [](const Vector&) -> Vector { return Vector::Ones(3); }, hessian, state);
              }),
              "gradient of size 3 for a state of size 12");
    EXPECT_EQ(
        message_of([&] { check_derivatives([](const Vector&) { return std::nan(""); }, gradient, hessian, state); }),
        "the derivative check needs a state with a finite value and gradient");
    EXPECT_EQ(message_of([&] {
                  check_derivatives(
                      value, gradient, [](const Vector&, const Vector&) -> Vector { return Vector::Ones(3); }, state);
              }),
              "the Hessian in the derivative check does not fit the state or is not finite");
}

TEST(Stop, namesAndExitCodes) {
    // Exit statuses as docs/command.md has them: 0 as asked, 3 the physics, 4 the numerics, 5 time limit, 130
    // signal.
    const std::set<int> codes{0, 3, 4, 5, 130};
    for (const StopKind& kind : stop_kinds) {
        EXPECT_TRUE(codes.contains(kind.exit_code)) << kind.name;
        EXPECT_EQ(name(kind.reason), kind.name);
        EXPECT_EQ(stop_from_name(kind.name), kind.reason);
    }
    EXPECT_EQ(exit_code(Stop::pinch_off), 3);
    EXPECT_EQ(exit_code(Stop::solver_failed), 4);
    EXPECT_EQ(exit_code(Stop::time_limit), 5);
    EXPECT_EQ(exit_code(Stop::interrupted), 130);
    EXPECT_EQ(stop_from_name("pinch_off"), std::nullopt);
    EXPECT_EQ(stop_from_name(""), std::nullopt);
}

using test::Screen;

TEST(Progress, linesOffATerminal) {
    Screen screen;
    {
        Progress progress(0, 2, screen.style(false));
        for (int i = 1; i <= 200; ++i) {  // 25 s at an eighth of a second a step
            screen.now += 0.125;
            progress(0.005 * i, 5 - 0.0125 * i, 0.005);
        }
    }
    // After 1 s, then one line each 10 s. After 11 s: 88 steps, time 0.44 of 2; at 0.04 a second the other 1.56 take 39
    // s, and so on. Before 5 percent nothing is said of what is left.
    EXPECT_EQ(screen.text(),
              "  2%  time 0.04 of 2  energy 4.9  step 0.005\n"
              " 22%  time 0.44 of 2  energy 3.9  step 0.005  left 39 s\n"
              " 42%  time 0.84 of 2  energy 2.9  step 0.005  left 29 s\n");
}

TEST(Progress, shortRunsAreSilentOffATerminal) {
    Screen screen;
    {
        Progress progress(0, 1, screen.style(false));
        screen.now += 0.9;
        progress(0.99, 1, 0.1);
    }
    EXPECT_EQ(screen.text(), "");
}

TEST(Progress, barOnATerminal) {
    Screen screen;
    {
        Progress progress(0, 1, screen.style(true));
        for (int i = 1; i <= 30; ++i) {  // 0.3 s: ten redraws a second allow for two, the third falls behind 0.3 s
            screen.now += 0.0099;
            progress(0.01 * i, 1, 0.01);
        }
    }
    const std::string text = screen.text();
    // 24 marks at time 0.11 and 0.22 of 1 are 2 and 5; in the end the line is wiped.
    EXPECT_EQ(text.find("\r[##......................]  11%  time 0.11 of 1  energy 1  step 0.01  left 1 s\x1b[K"), 0u)
        << text;
    EXPECT_CONTAINS(text, "\r[#####...................]  22%");
    EXPECT_EQ(std::count(text.begin(), text.end(), '['), 2 + 3) << "two bars, three escape sequences";
    EXPECT_TRUE(text.ends_with("\r\x1b[K"));
}

TEST(Progress, quietIsQuiet) {
    Screen screen;
    {
        Progress progress(0, 1, screen.style(true, true));
        screen.now += 100;
        progress(0.5, 1, 0.1);
    }
    EXPECT_EQ(screen.text(), "");
}

TEST(Progress, aFullDiskDoesNotMatter) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> full(std::fopen("/dev/full", "w"), std::fclose);
    for (const bool terminal : {false, true}) {
        Screen screen;
        ProgressStyle style = screen.style(terminal);
        style.out = full.get();
        Progress progress(0, 1, style);
        screen.now += 100;
        EXPECT_NO_THROW(progress(0.5, 1, 0.1));
    }
}

// The second run is slower, and begins where the first one began: what is left is known from its own steps.
TEST(Progress, namesTheRunAndIsNeverNegative) {
    Screen screen;
    Progress progress(0, 1, screen.style(false));
    progress.next_run(1, 2);
    screen.now += 10;
    progress(0.75, 1, 0.1);
    progress.next_run(2, 2);
    screen.now += 10;
    progress(0.1, 1, 0.1);
    screen.now += 10;
    progress(0.05, 1, 0.1);  // begun again, as finer runs do
    screen.now += 10;
    progress(1.01, 1, 0.1);  // beyond the end, by rounding
    EXPECT_EQ(screen.text(),
              "run 1 of at least 2   75%  time 0.75 of 1  energy 1  step 0.1  left 3 s\n"
              "run 2 of at least 2   10%  time 0.1 of 1  energy 1  step 0.1  left 1:30\n"
              "run 2 of at least 2    5%  time 0.05 of 1  energy 1  step 0.1  left 3:10\n"
              "run 2 of at least 2  100%  time 1.01 of 1  energy 1  step 0.1  left 0 s\n");
}

TEST(Progress, startsWhereAResumedRunDoes) {
    Screen screen;
    Progress progress(1, 3, screen.style(false));
    screen.now += 10;
    progress(2, 1, 0.1);  // half of what this run has to do; the other half takes 10 s as well
    EXPECT_EQ(screen.text(), " 50%  time 2 of 3  energy 1  step 0.1  left 10 s\n");
}

TEST(Progress, durations) {
    EXPECT_EQ(duration(0.4), "0 s");
    EXPECT_EQ(duration(59.4), "59 s");
    EXPECT_EQ(duration(61), "1:01");
    EXPECT_EQ(duration(3600 + 2 * 60 + 3), "1:02:03");
    EXPECT_EQ(duration(std::numeric_limits<double>::infinity()), "?");
    EXPECT_EQ(duration(std::nan("")), "?");
}

TEST(Interrupt, setsTheFlag) {
    for (int signal : {SIGINT, SIGTERM}) {
        catch_interrupts();
        EXPECT_FALSE(interrupted());
        std::raise(signal);
        EXPECT_TRUE(interrupted());
    }
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
}

TEST(Interrupt, whatIsIgnoredStaysIgnored) {
    for (int signal : {SIGINT, SIGTERM}) {
        std::signal(signal, SIG_IGN);
        catch_interrupts();
        std::raise(signal);
        EXPECT_FALSE(interrupted());
        std::signal(signal, SIG_DFL);
    }
    set_interrupted(true);  // by a host
    EXPECT_TRUE(interrupted());
    set_interrupted(false);
    EXPECT_FALSE(interrupted());
}

TEST(Interrupt, secondSignalEnds) {
    const pid_t child = fork();
    if (child == 0) {
        catch_interrupts();
        std::raise(SIGINT);
        if (!interrupted()) _exit(1);
        std::raise(SIGINT);
        _exit(2);  // not reached
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(WTERMSIG(status), SIGINT);
}

}  // namespace tubule::solve_test
