// Runs at given tension and pressure, at fixed area, and fed by a reservoir: the balance of the free energy with loads
// that change, guards, resumption, refusals.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/surface3d/run_case.hpp"

namespace tubule::surface3d::ensembles_run_test {

const std::string wavy = R"(
energy = {k20 = 0.2, k42 = 0.05}
shape = {kind = "sphere", radius = 1, mode = [{amplitude = 0.15, l = 2, m = 1}, {amplitude = 0.05, l = 3, m = 2}]}
discretisation = {elements = 80, order = 4}
accuracy = {energy = 1e-2}
time = {end = 0.1}
)";

std::vector<std::string> open_sets(const std::string& kind) {
    const std::string area = kind == "gradient-flow" ? "free" : "reservoir";
    return {"model.kind=" + kind, "model.volume=free", "model.area=" + area,
            "model.tension={time = [0.02, 0.05], value = [0.1, 0.6]}",
            "model.pressure={time = [0, 0.03, 0.07], value = [0, 0.8, 0.5]}"};
}

TEST(EnsembleRuns, TheFreeEnergyBalances) {
    // theory.md (3.16): F + kinetic energy - work falls by what dissipates; no step crosses a kink; F is what it is
    // made of.
    for (const std::string kind : {"gradient-flow", "overdamped", "stokes", "fluid"}) {
        SCOPED_TRACE(kind);
        std::vector<std::string> sets = open_sets(kind);
        sets.push_back("accuracy.estimate=false");
        const Outcome o = run_case(wavy, sets);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        const double E_ref = o.summary.reference_energy;
        const auto time = o.series("time"), F = o.series("free_energy"), E = o.series("energy"), A = o.series("area"),
                   V = o.series("volume"), work = o.series("work"), K = o.series("kinetic_energy"),
                   sigma = o.series("tension"), P = o.series("pressure"), defect = o.series("identity_defect");
        for (const double kink : {0.02, 0.03, 0.05, 0.07}) EXPECT_TRUE(std::ranges::count(time, kink)) << kink;
        for (std::size_t i = 0; i < time.size(); ++i) {
            EXPECT_NEAR(F[i], E[i] + sigma[i] * A[i] - P[i] * V[i], 1e-12 * E_ref);
            EXPECT_LT(std::abs(defect[i]), 2e-3 * E_ref);
            const std::size_t before = i > 0 ? i - 1 : 0;
            EXPECT_LT(F[i] + K[i] - work[i], F[before] + K[before] - work[before] + 1e-4 * E_ref);
        }
        // Their work, by the trapezoidal rule on these rows, and much more than the defect.
        double sum = 0;
        for (std::size_t i = 1; i < time.size(); ++i)
            sum += (sigma[i] - sigma[i - 1]) * (A[i] + A[i - 1]) / 2 - (P[i] - P[i - 1]) * (V[i] + V[i - 1]) / 2;
        EXPECT_NEAR(work.back(), sum, 1e-3 * std::abs(sum));
        EXPECT_GT(std::abs(sum), 0.05 * E_ref);
        EXPECT_GT(std::abs(A.back() / A.front() - 1), 1e-4);
    }
}

TEST(EnsembleRuns, ThePressureDependsOnTheVolume) {
    // theory.md (3.24): P = 20 (4.4/V - 1) at all times, and F = E - INT P dV from V = 1; no work. In steps so long
    // that a pressure of the step before would overshoot: 4 pi R^2 dP/dV = -58 in gradient flow.
    for (const std::string kind : {"gradient-flow", "overdamped", "fluid"}) {
        SCOPED_TRACE(kind);
        const Outcome o = run_case(wavy, {"model.kind=" + kind, "model.volume=free", "model.pressure=20*(4.4/V - 1)",
                                          "accuracy.estimate=false"});
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        const double E_ref = o.summary.reference_energy;
        const auto F = o.series("free_energy"), E = o.series("energy"), V = o.series("volume"),
                   P = o.series("pressure"), defect = o.series("identity_defect");
        for (std::size_t i = 0; i < F.size(); ++i) {
            EXPECT_NEAR(P[i], 20 * (4.4 / V[i] - 1), 1e-10);
            EXPECT_NEAR(F[i], E[i] - 88 * std::log(V[i]) + 20 * (V[i] - 1), 1e-9 * E_ref);
            EXPECT_LT(std::abs(defect[i]), 2e-3 * E_ref);
        }
        EXPECT_GT(V.back() / V.front(), kind == "fluid" ? 1.0003 : 1.002);
        EXPECT_EQ(o.last("work"), 0);
    }
}

TEST(EnsembleRuns, TheBalanceWithWhatAReservoirBringsConverges) {
    // theory.md (3.20): half the step leaves less than half of the defect, until that of the mesh is left; and far less
    // than the kinetic energy brought.
    std::vector<double> defects;
    for (const std::string step : {"8e-3", "4e-3"}) {
        const Outcome o = run_case(
            wavy, {"model.kind=fluid", "model.Re=10", "model.volume=free", "model.area=reservoir", "model.tension=-1",
                   "model.pressure=6", "discretisation.step=" + step, "time.end=0.12", "accuracy.estimate=false"});
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        defects.push_back(std::abs(o.last("identity_defect")));
        EXPECT_LT(defects.back(), 0.1 * o.last("work"));
    }
    EXPECT_LT(defects[1], 0.5 * defects[0]);
}

TEST(EnsembleRuns, AreaAsAWholeIsKept) {
    for (const std::string volume : {"free", "fixed"}) {
        SCOPED_TRACE(volume);
        const Outcome o = run_case(wavy, {"model.area=fixed", "model.volume=" + volume, "accuracy.estimate=false"});
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        for (const double area : o.series("area")) EXPECT_NEAR(area / o.series("area").front(), 1, 1e-8);
        const double change = std::abs(o.last("volume") / o.series("volume").front() - 1);
        EXPECT_EQ(change < 1e-8, volume == "fixed") << change;
        EXPECT_NE(o.last("tension"), 0);
        EXPECT_LT(std::abs(o.last("identity_defect")), 2e-3 * o.summary.reference_energy);
        EXPECT_LT(o.last("energy"), o.series("energy").front() - 1e-3 * o.summary.reference_energy);
    }
}

TEST(EnsembleRuns, ResumedRunsEndAsUndisturbedOnes) {
    for (const std::string kind : {"gradient-flow", "fluid"}) {
        SCOPED_TRACE(kind);
        std::vector<std::string> sets = open_sets(kind);
        sets.push_back("discretisation.order=2");
        expect_the_same_resumed(wavy, sets, {"free_energy", "work", "identity_defect", "energy_error", "area"});
    }
}

TEST(EnsembleRuns, NothingIsStationaryBeforeTheLastKink) {
    // A sphere at rest until its tension changes: f = 0 and f_H = 0 at H0 = -2.
    const Outcome o = run_case(
        "[energy]\nk20 = 1\nH0 = -2\n[model]\ntension = {time = [1, 1.1], value = [0, 0.5]}\n[shape]\n"
        "kind = \"sphere\"\nradius = 1\n[time]\nend = 20\nstationary = 1e-4\n[discretisation]\nelements = 80\n",
        {"accuracy.estimate=false"});
    EXPECT_EQ(o.summary.stop.reason, Stop::stationary) << o.summary.stop.message;
    EXPECT_GT(o.summary.stop.time, 1.1);
    EXPECT_LT(o.last("area"), 0.98 * o.series("area").front());
}

const std::string tube = R"(
energy = {k20 = 0.5, k42 = 0.05, H0 = -0.5}
shape = {kind = "tube", radius = 1, length = 3, mode = [{amplitude = 0.15, n = 1}, {amplitude = 0.05, n = 1, m = 2}]}
discretisation = {elements = 96}
accuracy = {energy = 1e-2}
time = {end = 0.1}
)";

std::vector<std::string> pulled(const std::string& kind) {
    return {"model.kind=" + kind, "model.volume=fixed", "model.area=fixed", "model.period=free",
            "model.force={time = [0.03, 0.06], value = [0, 6]}"};
}

TEST(EnsembleRuns, ATubeIsPulled) {
    // theory.md (3.16), (3.20): the period follows the force, area and volume are kept, F - work falls by what
    // dissipates. Frames have the period of their time.
    for (const std::string kind : {"gradient-flow", "stokes", "fluid"}) {
        SCOPED_TRACE(kind);
        std::vector<std::string> sets = pulled(kind);
        sets.insert(sets.end(), {"accuracy.estimate=false", "discretisation.order=3"});
        const Outcome o = run_case(tube, sets);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        const double E_ref = o.summary.reference_energy;
        const auto F = o.series("free_energy"), E = o.series("energy"), L = o.series("height"), N = o.series("force"),
                   A = o.series("area"), V = o.series("volume"), defect = o.series("identity_defect");
        for (std::size_t i = 0; i < F.size(); ++i) {
            EXPECT_NEAR(F[i], E[i] - N[i] * L[i], 1e-12 * E_ref);
            EXPECT_NEAR(A[i] / A[0], 1, 1e-8);
            EXPECT_NEAR(V[i] / V[0], 1, 1e-8);
            EXPECT_LT(std::abs(defect[i]), 2e-3 * E_ref);
        }
        EXPECT_GT(std::abs(L.back() / L.front() - 1), kind == "fluid" ? 1e-4 : 2e-3);
        ASSERT_GE(o.watch.meshes.size(), o.watch.frames.size());  // a checkpoint has one, too
        EXPECT_EQ(o.watch.meshes.back().period, L.back());
        EXPECT_NE(o.watch.meshes.front().period, L.back());
    }
}

TEST(EnsembleRuns, APulledTubeGoesOn) {
    for (const auto& [kind, scheme] :
         {std::pair<std::string, std::string>{"gradient-flow", "bdf2"}, {"stokes", "bdf"}, {"fluid", "alpha"}}) {
        SCOPED_TRACE(kind);
        std::vector<std::string> sets = pulled(kind);
        for (const char* set : {"elements=60", "order=2"}) sets.push_back(std::string("discretisation.") + set);
        sets.push_back("discretisation.scheme=" + scheme);
        expect_the_same_resumed(tube, sets, {"free_energy", "work", "identity_defect", "energy_error", "height"});
    }
}

TEST(EnsembleRuns, AFreePeriodGoesOnWithANewMesh) {
    // theory.md (3.17), (3.19) of a straight tube with k20 alone and a fixed area: R_t = 2 k20/R^3 - force/(2 pi R^2).
    // Its triangles become wide and short, and a new mesh is made on the way.
    const Outcome o = run_case(
        "[energy]\nk20 = 0.5\n[model]\narea = \"fixed\"\nperiod = \"free\"\nforce = 1.8\n[shape]\nkind = \"tube\"\n"
        "radius = 1\nlength = 6\n[discretisation]\nelements = 120\n[accuracy]\nenergy = 1e-2\nestimate = "
        "false\n[time]\n"
        "end = 60\n");
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    EXPECT_GT(detail(o.summary, "meshes"), 1);
    double R = 1;
    const int steps = 60000;
    const auto rate = [](double r) { return 1 / (r * r * r) - 1.8 / (2 * std::numbers::pi * r * r); };
    for (int i = 0; i < steps; ++i) R += 60.0 / steps * rate(R + 30.0 / steps * rate(R));
    EXPECT_NEAR(o.last("r_max"), R, 2e-3 * R);
    EXPECT_NEAR(o.last("height"), 6 / R, 4e-3 * 6 / R);
    EXPECT_NEAR(o.last("area") / o.series("area").front(), 1, 1e-8);
}

}  // namespace tubule::surface3d::ensembles_run_test
