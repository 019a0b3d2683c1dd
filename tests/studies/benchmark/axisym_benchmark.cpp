// Whole runs of the figure's case, settings chosen by the program: choosing them and the error estimate are included,
// reading the case and writing the file are not. Counters: error against the independent reference and error
// stated by the program, both relative to E_ref; compare ratios within one run of this program.
#include <benchmark/benchmark.h>

#include "axisym/graph/graph_forms.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "axisym/splines/breaks.hpp"
#include "tests/studies/benchmark/figure_case.hpp"

namespace tubule::axisym {
namespace {

void figure_run(benchmark::State& state, Integrator integrator) {
    Case c = figure_case();
    c.accuracy.energy = std::pow(10.0, -static_cast<double>(state.range(0)));
    c.time.integrator = integrator;
    RunSummary summary;
    double error = 0;
    for (auto _ : state) {
        ErrorWatch watch;
        summary = run_profile(c, watch);
        error = watch.error;
    }
    state.counters["error"] = error / summary.reference_energy;
    state.counters["stated"] = summary.estimated_error;
    state.counters["steps"] = static_cast<double>(detail<std::int64_t>(summary, "steps"));
    state.counters["elements"] = summary.elements;
    state.counters["attempts"] = summary.attempts;
}
BENCHMARK_CAPTURE(figure_run, ida, Integrator::ida)->DenseRange(3, 9)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(figure_run, rosenbrock, Integrator::rosenbrock)->DenseRange(3, 9)->Unit(benchmark::kMillisecond);

// The kernels, per call on one cell of 8 elements.
struct Kernel {
    Cell cell{0.5, 1.5, true, 1};
    SplineSpace space;
    Forms forms;
    Eigen::VectorXd x, v, out;
    std::vector<double> values;
    explicit Kernel(int degree)
        : space(cell, equal_breaks(8, cell), degree, degree - 1),
          forms(space, figure_case().energy),
          x(space.project([](double z) { return 1 + 0.25 * std::sin(std::numbers::pi * z); })),
          v(forms.rate(x)),
          out(x.size()),
          values(forms.pattern().nonZeros()) {}
};

void residual(benchmark::State& state) {
    Kernel k(static_cast<int>(state.range(0)));
    for (auto _ : state) benchmark::DoNotOptimize(k.forms.residual(k.x.data(), k.v.data(), k.out.data()));
}
void jacobian(benchmark::State& state) {
    Kernel k(static_cast<int>(state.range(0)));
    for (auto _ : state) {
        k.forms.jacobian(k.x.data(), k.v.data(), 1.0, k.values.data());
        benchmark::ClobberMemory();
    }
}
void observe(benchmark::State& state) {
    Kernel k(static_cast<int>(state.range(0)));
    for (auto _ : state) benchmark::DoNotOptimize(k.forms.observe(k.x.data(), k.v.data()).energy);
}
BENCHMARK(residual)->Arg(3)->Arg(5)->Arg(7)->Name("residual/degree");
BENCHMARK(jacobian)->Arg(3)->Arg(5)->Arg(7)->Name("jacobian/degree");
BENCHMARK(observe)->Arg(3)->Arg(5)->Arg(7)->Name("observe/degree");

}  // namespace
}  // namespace tubule::axisym

BENCHMARK_MAIN();
