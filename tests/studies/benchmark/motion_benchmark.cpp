// A step of a moving surface and its parts: the paper's perturbed sphere as a fluid, k42 = 0.12, on finer and finer
// meshes. `lu` is what its system would take with UMFPACK's LU factors, which stand in where our own fail (those are in
// `step`). Milliseconds of wall time; threads by OMP_NUM_THREADS, with OPENBLAS_NUM_THREADS=1.
#include <benchmark/benchmark.h>
#include <fmt/core.h>

#include <functional>

#include "common/solve/sparse.hpp"
#include "surface3d/motion/motion_measures.hpp"
#include "tests/studies/benchmark/main.hpp"
#include "tests/studies/benchmark/motion_scene.hpp"

namespace tubule::surface3d {
namespace {

using Prepare = std::function<std::function<void()>(Scene&)>;

void add(const char* name, const Prepare& prepare) {
    for (const int k : {3, 4})
        for (const int n : {4, 6, 8})
            benchmark::RegisterBenchmark(fmt::format("{}/k{}/T{}", name, k, 20 * n * n).c_str(),
                                         [=](benchmark::State& state) {
                                             Scene scene(n, k);
                                             const auto work = prepare(scene);
                                             for (auto _ : state) work();
                                         })
                ->UseRealTime()
                ->Unit(benchmark::kMillisecond);
}

void add_all() {
    add("step", [](Scene& s) { return [&s] { benchmark::DoNotOptimize(s.scheme->step(s.state, tau)); }; });
    add("fields", [](Scene& s) { return [&s] { benchmark::DoNotOptimize(s.surface.fields(s.mesh)); }; });
    add("assemble", [](Scene& s) {
        return [&s] { assemble(s.surface.space(), s.solver.unknowns(), fluid, energy, s.base, s.system); };
    });
    add("lu", [](Scene& s) {
        const MotionUnknowns& u = s.solver.unknowns();
        auto solver = std::make_shared<SparseLuLarge>(nested_dissection(u.pattern(), u.node_of_unknown()));
        return [&s, solver] {
            solver->factor(s.system.A);
            benchmark::DoNotOptimize(solver->solve(s.system.b, 1));
        };
    });
    add("measure", [](Scene& s) { return [&s] { benchmark::DoNotOptimize(measure(s.surface, s.state)); }; });
}

}  // namespace
}  // namespace tubule::surface3d

int main(int argc, char** argv) {
    return tubule::run_benchmarks(argc, argv, tubule::surface3d::add_all);
}
