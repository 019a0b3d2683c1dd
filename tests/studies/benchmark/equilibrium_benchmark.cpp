// Time of the paper's nine tubular cells at rest, each from its capsule, choice of the mesh included; counters: largest
// error of an energy against the independent reference, and Newton iterations of each.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>

#include "axisym/equilibrium/equilibrium.hpp"
#include "axisym/equilibrium/mode_stability.hpp"
#include "common/shapes/capsule.hpp"

namespace tubule::axisym {
namespace {

constexpr double reference[3][3] = {{1.2568365089070843, 3.831523408595685, 6.3849499091967346},
                                    {0.8609060644735724, 3.3635614916994423, 5.70103859273719},
                                    {0.8632548170310673, 2.967232138180876, 5.058933478691813}};

StationaryProblem problem_of(const Capsule& c, int k) {
    return {Bending{.k = {0.125, 0, 0.06 * k}, .H0 = -2}, {area(c), volume(c), std::nullopt}};
}

// degree, -log10 of the accuracy, -log10 of the gauge
void equilibrium(benchmark::State& state) {
    EquilibriumSettings settings;
    settings.degree = static_cast<int>(state.range(0));
    settings.accuracy = std::pow(10.0, -static_cast<double>(state.range(1)));
    settings.gauge = std::pow(10.0, -static_cast<double>(state.range(2)));
    double error = 0, iterations = 0, failures = 0;
    for (auto _ : state) {
        error = iterations = failures = 0;
        for (int l = 2; l <= 4; ++l)
            for (int k = 0; k < 3; ++k) {
                const Capsule c{0.5, static_cast<double>(l)};
                const Equilibrium e = find_equilibrium(problem_of(c, k), meridian(c), settings);
                error = std::max(error, std::abs(e.observed.energy - reference[l - 2][k]));
                iterations += e.iterations / 9.0;
                failures += e.stop != Stop::finished;
            }
    }
    state.counters["error"] = error;
    state.counters["newton"] = iterations;
    state.counters["failures"] = failures;
}
BENCHMARK(equilibrium)
    ->ArgsProduct({{3, 5, 7}, {6, 8}, {2}})
    ->ArgsProduct({{5, 7}, {10}, {0, 1, 2, 3, 4}})
    ->Name("nine_equilibria")
    ->Unit(benchmark::kMillisecond);

// Six m, all rates told.
void stability(benchmark::State& state) {
    const Capsule c{0.5, 3};
    const StationaryProblem problem = problem_of(c, 1);
    const Equilibrium e = find_equilibrium(problem, meridian(c));
    for (auto _ : state) benchmark::DoNotOptimize(mode_stability(problem, e, 5, motion_law({})));
    state.counters["elements"] = e.space->splines().elements();
}
BENCHMARK(stability)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tubule::axisym

BENCHMARK_MAIN();
