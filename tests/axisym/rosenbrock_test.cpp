// The method of integration of graphs on an equation with a known solution, and its linear solver.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "axisym/graph/graph_forms.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "axisym/integration/step_integral.hpp"
#include "axisym/integration/time_integrator.hpp"
#include "axisym/splines/band_lu.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/solve/dense.hpp"
#include "common/solve/sparse.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::axisym::rosenbrock_test {

// (1 + y^2) (v - 0.2/y^3) = 0 from y = 1: y = (1 + 0.8 t)^(1/4). Dissipation 1/y, so that INT is (y^3 - 1)/(3 0.2).
struct Growth {
    Eigen::SparseMatrix<double> pattern{1, 1};
    double least = 1e9;  // y is to stay below
    Growth() { pattern.insert(0, 0) = 1, pattern.makeCompressed(); }
    static double exact(double t) { return std::pow(1 + 0.8 * t, 0.25); }
    static double rate(double y) { return 0.2 / (y * y * y); }
    ImplicitSystem system() const {
        ImplicitSystem s;
        s.residual = [](double, const double* y, const double* v, double* out) {
            out[0] = (1 + y[0] * y[0]) * (v[0] - rate(y[0]));
            return y[0] > 0;
        };
        s.jacobian = [](double, const double* y, const double* v, double cj, double* out) {
            const double m = 1 + y[0] * y[0];
            out[0] = 2 * y[0] * (v[0] - rate(y[0])) + m * 0.6 / std::pow(y[0], 4) + cj * m;
        };
        s.pattern = &pattern;
        s.mass = [](const double* y, double* out) { out[0] = 1 + y[0] * y[0]; };
        s.dissipation = [](double, const double* y, const double*) { return 1 / y[0]; };
        s.guards = [this](double, const double* y, const double*) { return Guards{least - y[0]}; };
        s.n_guards = 1;
        return s;
    }
    std::unique_ptr<TimeIntegrator> integrator(double tolerance, double first_step = 0) const {
        TimeControl control;
        control.relative = tolerance, control.absolute = 1e-3 * tolerance, control.first_step = first_step;
        const Eigen::VectorXd y = Eigen::VectorXd::Ones(1);
        return make_rosenbrock(system(), y, 0.2 * y, 0, control);
    }
};

TEST(Rosenbrock, isOfOrderFive) {
    const Growth growth;
    double last = 0;
    for (const double h : {0.2, 0.1, 0.05}) {
        const auto integrator = growth.integrator(1, h);  // a tolerance that refuses no step
        integrator->advance(h);
        const double error = std::abs(integrator->x()[0] - Growth::exact(h));
        if (last > 0) {
            EXPECT_NEAR(std::log2(last / error), 6, 0.3) << h;  // of one step
        }
        last = error;
    }
}

TEST(Rosenbrock, errorsFollowTheTolerance) {
    const Growth growth;
    for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
        const auto integrator = growth.integrator(tolerance);
        while (integrator->advance(5) == TimeIntegrator::Outcome::step) {
            const double back = integrator->time() - 0.4 * integrator->step_size();
            double y = 0, v = 0;
            integrator->state_within_step(back, &y, &v);
            EXPECT_NEAR(y, Growth::exact(back), tolerance);
            EXPECT_NEAR(v, Growth::rate(y), 1e-14);
            EXPECT_NEAR(integrator->v()[0], Growth::rate(integrator->x()[0]), 1e-14);
        }
        EXPECT_EQ(integrator->time(), 5);
        EXPECT_NEAR(integrator->x()[0], Growth::exact(5), tolerance);
        EXPECT_NEAR(integrator->dissipated(5), (std::pow(Growth::exact(5), 3) - 1) / 0.6, 20 * tolerance);
    }
}

TEST(Rosenbrock, endsWhereAGuardTrips) {
    Growth growth;
    growth.least = 1.2;
    const auto integrator = growth.integrator(1e-9);
    TimeIntegrator::Outcome outcome = TimeIntegrator::Outcome::step;
    while (outcome == TimeIntegrator::Outcome::step) outcome = integrator->advance(5);
    EXPECT_EQ(outcome, TimeIntegrator::Outcome::guard);
    EXPECT_EQ(integrator->tripped(), 0);
    EXPECT_NEAR(integrator->time(), (std::pow(1.2, 4) - 1) / 0.8, 1e-7);
}

TEST(Rosenbrock, refusesToleranceBelowRounding) {
    const Growth growth;
    const auto integrator = growth.integrator(1e-17);
    EXPECT_EQ(integrator->advance(1), TimeIntegrator::Outcome::failed);
    EXPECT_CONTAINS(integrator->failure(), "too much accuracy");
}

// Without k20 and with a zero of H the flow is degenerate, and its linearisation does not see what stiffness appears
// within a step: IDA takes over. Against a run with nothing else.
TEST(Rosenbrock, leavesDegenerateFlowsToIda) {
    Bending material = bending(0, 0);
    material.k[1] = 0.00246;
    Case c = tube_case(material, 0.69, 1.93, {{.amplitude = 0.032, .n = 2, .m = 0, .phase = 0}}, 0.05);
    c.accuracy.energy = 1e-4;
    c.time.integrator = Integrator::rosenbrock;
    Outcome mixed = run_case(c);
    for (const double amplitude : {0.0319, 0.0321, 0.0322}) {  // rounding decides which tubes need it
        if (detail<std::string>(mixed.summary, "integrator") == "ida") break;
        std::get<Tube>(c.shape).modes[0].amplitude = amplitude;
        mixed = run_case(c);
    }
    // What is resumed from there says so, too.
    Case longer = c;
    longer.time.end = 0.051;
    const Outcome resumed = run_case(longer, &mixed.log.frames.back());
    EXPECT_EQ(detail<std::string>(resumed.summary, "integrator"), "ida");
    EXPECT_EQ(resumed.summary.attempts, mixed.summary.attempts);
    ASSERT_EQ(resumed.summary.warnings.size(), 1U);
    EXPECT_CONTAINS(resumed.summary.warnings[0], "IDA has integrated the run");
    c.time.integrator = Integrator::ida;
    c.accuracy.energy = 1e-5;
    const Outcome other = run_case(c);
    ASSERT_EQ(mixed.summary.stop.reason, Stop::finished) << mixed.summary.stop.message;
    ASSERT_EQ(other.summary.stop.reason, Stop::finished) << other.summary.stop.message;
    EXPECT_GT(mixed.summary.attempts, 1);
    EXPECT_EQ(detail<std::string>(mixed.summary, "integrator"), "ida");
    ASSERT_EQ(mixed.summary.warnings.size(), 1U);
    EXPECT_CONTAINS(mixed.summary.warnings[0], "IDA has integrated the run");
    EXPECT_LE(mixed.summary.estimated_error, 1e-4);
    EXPECT_NEAR(mixed.summary.energy, other.summary.energy, 1e-4 * mixed.summary.reference_energy);
}

// INT t^4 dt from where five points are known: exact. Of exp(-t), steps of h: order 5.
TEST(StepIntegral, isOfOrderFive) {
    StepIntegral fourth;
    fourth.begin(0, 0);
    for (const double t : {0.1, 0.3, 0.4, 0.8}) fourth.add(t, std::pow(t, 4));
    const double known = fourth.at(0.8) - fourth.at(0.4);
    EXPECT_NEAR(known, (std::pow(0.8, 5) - std::pow(0.4, 5)) / 5, 1e-15);
    double last = 0;
    for (const int n : {20, 40, 80}) {
        StepIntegral decay;
        double begin = 0;
        decay.begin(0, 1);
        for (int i = 1; i <= n; ++i) {
            decay.add(2.0 * i / n, std::exp(-2.0 * i / n));
            if (i == n / 4) begin = decay.at(0.5);
        }
        const double error = std::abs(decay.at(2) - begin - (std::exp(-0.5) - std::exp(-2)));
        if (last > 0) {
            EXPECT_NEAR(std::log2(last / error), 5, 0.3) << n;
        }
        last = error;
    }
    EXPECT_LE(last, 1e-9);
}

// With planes of symmetry and without, against Eigen's dense solver.
TEST(BandLu, solves) {
    std::mt19937 engine(5);
    std::normal_distribution<double> normal;
    for (const bool mirror : {true, false})
        for (const int elements : {2, 3, 9, 40}) {
            const Cell cell{0, 1, mirror, 1};
            const SplineSpace space(cell, equal_breaks(elements, cell), 5, 4);
            Eigen::SparseMatrix<double> A = Forms(space, bending(1, 0)).pattern();
            for (int k = 0; k < A.nonZeros(); ++k) A.valuePtr()[k] = normal(engine);
            const Eigen::VectorXd b = Eigen::VectorXd::Random(A.cols());
            BandLu lu(A);
            lu.factor(A.valuePtr());
            const Eigen::VectorXd x = solve_dense(Eigen::MatrixXd(A), b);
            EXPECT_LE((lu.solved(b) - x).norm(), 1e-9 * x.norm()) << mirror << " " << elements;
        }
}

TEST(BandLu, refusesSingularMatrices) {
    Eigen::SparseMatrix<double> A(2, 2);
    A.insert(0, 0) = 1, A.insert(0, 1) = 2, A.insert(1, 0) = 2, A.insert(1, 1) = 4;
    A.makeCompressed();
    BandLu lu(A);
    EXPECT_THROW(lu.factor(A.valuePtr()), SolveError);
}

}  // namespace tubule::axisym::rosenbrock_test
