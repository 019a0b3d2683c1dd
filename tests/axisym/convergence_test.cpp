// Errors of whole runs and of the discrete energy, and the orders at which they fall.
#include <gtest/gtest.h>

#include <cmath>

#include "axisym/graph/graph_forms.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/geometry/profile_point.hpp"
#include "tests/axisym/reference.hpp"
#include "tests/axisym/runs.hpp"

namespace tubule::axisym::convergence_test {

const TubeMode figure_mode{0.25, 1, 0, -pi / 2};  // 0.25 sin(pi z)

struct Expected {
    int degree, elements;
    double order, error;  // with twice the elements
};

TEST(Convergence, energyOfSmoothData) {
    // Expected: the independent reference's energy at the start of the three runs of the figure. Theory: order 2 (p -
    // 1) by projection, as the energy has second derivatives.
    for (const auto& [degree, elements, order, error] :
         {Expected{3, 32, 3.7, 1e-4}, Expected{5, 16, 7.5, 1e-6}, Expected{7, 10, 9.5, 1e-7}})
        for (const auto& run : reference::figure) {
            double wrong[2];
            for (int i = 0; i < 2; ++i) {
                const Cell cell{0, 2, false, 1};
                const SplineSpace space(cell, equal_breaks(elements << i, cell), degree, degree - 1);
                const Forms forms(space, bending(0.2, -2, 0, run.k42));
                const double E = forms.free_energy(space.project([](double z) { return 1 + 0.25 * std::sin(pi * z); }));
                wrong[i] = std::abs(E - run.energy_start) / run.energy_start;
            }
            EXPECT_GT(std::log2(wrong[0] / wrong[1]), order) << degree << ": " << wrong[0] << " " << wrong[1];
            EXPECT_LT(wrong[1], error) << degree;
        }
}

// Largest error of E(t), relative to E(0), over the reference times of a figure run.
double run_error(const reference::FigureRun& run, int degree, int elements, double tolerance) {
    std::vector<double> times;
    for (const auto& p : run.at) times.push_back(p.time);
    Case c = tube_case(bending(0.2, -2, 0, run.k42), 1, 2, {figure_mode}, times.back(), times);
    explicitly(c, elements, tolerance, degree);
    const Outcome o = run_case(c);
    EXPECT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    double error = 0;
    for (const auto& p : run.at) error = std::max(error, std::abs(o.at("energy", p.time) - p.energy));
    return error / run.energy_start;
}

TEST(Convergence, energyOfWholeRuns) {
    for (const auto& [degree, elements, order, error] :
         {Expected{3, 32, 3.5, 1e-4}, Expected{5, 16, 6.5, 1e-6}, Expected{7, 12, 8.5, 1e-7}}) {
        const auto& run = reference::figure[1];
        const double coarse = run_error(run, degree, elements, 1e-11),
                     fine = run_error(run, degree, 2 * elements, 1e-11);
        EXPECT_GT(std::log2(coarse / fine), order) << degree << ": " << coarse << " " << fine;
        EXPECT_LT(fine, error) << degree;
    }
}

TEST(Convergence, toTheReferenceItself) {
    // The reference is good to 1e-10 absolute, 1.5e-11 of E(0).
    for (const auto& run : reference::figure) EXPECT_LT(run_error(run, 7, 64, 1e-13), 1e-10) << run.k42;
}

TEST(Convergence, inTimeToo) {
    // A tolerance smaller by 1e2 makes the error smaller by at least 1e2^0.7: BDF control works on local errors.
    const auto& run = reference::figure[1];
    double last = run_error(run, 7, 48, 1e-4);
    for (double tolerance : {1e-6, 1e-8, 1e-10}) {
        const double error = run_error(run, 7, 48, tolerance);
        EXPECT_LT(error, last / 25) << tolerance;
        EXPECT_LT(error, 10 * tolerance);
        last = error;
    }
}

TEST(DissipationIdentity, closesAtTightTolerance) {
    // Theorem: E(t) - E(0) + INT INT b^2 dS dt = 0 for the discrete flow on any mesh: theory.md (3.12).
    for (const Bending& material :
         {bending(0.2, -2), bending(0.2, -2, 0, 0.06), bending(0.2, -2, 0.02, 0), bending(0.05, 0.5, 0.01, 0.02)}) {
        Case c = tube_case(material, 1, 2, {{0.25, 1}, {0.08, 2, 0, 0.9}}, 0.2, {0.01, 0.1});
        explicitly(c, 32, 1e-12);
        const Outcome o = run_case(c);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        const double dissipated = o["energy"].front() - o.last("energy");
        ASSERT_GT(dissipated, 0.05 * o["energy"].front());
        for (double defect : o["identity_defect"]) EXPECT_LT(std::abs(defect), 1e-8 * o["energy"].front());
    }
}

TEST(DissipationIdentity, energyNeverGrows) {
    Case c = tube_case(bending(0.2, -2, 0, 0.06), 1, 2, {{0.25, 1}, {0.08, 2, 0, 0.9}}, 1.4);
    c.accuracy.energy = 1e-6;
    const Outcome o = run_case(c);
    const auto& E = o["energy"];
    for (std::size_t i = 1; i < E.size(); ++i) EXPECT_LE(E[i], E[i - 1] + 1e-6 * E[0]);
}

TEST(Symmetry, runsAgreeWithThoseOfTheWholePeriod) {
    // The flow keeps the symmetries of its start exactly: with and without them the same energies.
    for (const auto& modes : {std::vector<TubeMode>{{0.25, 1, 0, 0.4}},
                              {{0.2, 2, 0, 0.1}, {0.05, 4, 0, 2}},
                              {{0.1, 2, 0, 0.3}, {0.03, 4, 0, 0.6}}}) {
        Case c = tube_case(bending(0.2, -2, 0, 0.06), 1, 2, modes, 0.1, {0.01});
        explicitly(c, 96, 1e-12, 7);
        const Outcome reduced = run_case(c);
        c.discretisation.symmetry = false;
        const Outcome whole = run_case(c);
        EXPECT_EQ(whole.summary.elements, 96);
        EXPECT_EQ(reduced.summary.elements, 96);
        for (const char* s : {"energy", "area", "volume", "r_min", "r_max", "dissipation"})
            for (double t : {0.01, 0.1})
                EXPECT_NEAR(reduced.at(s, t), whole.at(s, t), 1e-8 * std::max(1.0, std::abs(whole.at(s, t)))) << s;
    }
}

}  // namespace tubule::axisym::convergence_test
