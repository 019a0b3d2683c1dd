// The surface tier at growing numbers of triangles: assembly, a symmetric solve, curvature recovery, bending force.
// `nodes`: unknowns; `us_per_node`: microseconds of wall time for each, constant if the time is linear in them.
// Threads by OMP_NUM_THREADS.
#include <benchmark/benchmark.h>
#include <fmt/core.h>

#include <functional>

#include "surface3d/curvature/bending_force.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "tests/studies/benchmark/main.hpp"
#include "tests/surface3d/errors.hpp"

namespace tubule::surface3d {
namespace {

// The paper's perturbed sphere on an icosphere of 20 n^2 triangles.
struct Scene {
    CurvedMesh mesh;
    SurfaceSpace space;
    Scene(int n, int order) : mesh(mapped_mesh(icosphere(n), order, map_of(perturbed_sphere()))), space(mesh) {}
};

// `prepare` makes from a scene the work that is timed.
using Prepare = std::function<std::function<void()>(const Scene&)>;

void add(const char* name, const Prepare& prepare) {
    for (const int k : {2, 3, 4})
        for (const int n : {4, 8, 16, 32})
            benchmark::RegisterBenchmark(
                fmt::format("{}/k{}/T{}", name, k, 20 * n * n).c_str(),
                [=](benchmark::State& state) {
                    const Scene scene(n, k);
                    const auto work = prepare(scene);
                    for (auto _ : state) work();
                    const double nodes = scene.mesh.size();
                    state.counters["nodes"] = nodes;
                    state.counters["us_per_node"] = benchmark::Counter(
                        1e-6 * nodes, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
                })
                ->UseRealTime()
                ->Unit(benchmark::kMillisecond);
}

void add_all() {
    add("mass", [](const Scene& s) -> std::function<void()> {
        return [&s] { benchmark::DoNotOptimize(mass_matrix(s.space, s.mesh)); };
    });
    add("stiffness", [](const Scene& s) -> std::function<void()> {
        return [&s] { benchmark::DoNotOptimize(stiffness_matrix(s.space, s.mesh)); };
    });
    // Mass and stiffness, as for a step of diffusion; ordering and symbolic analysis are kept, as in a run.
    const auto matrix = [](const Scene& s) {
        return Eigen::SparseMatrix<double>(mass_matrix(s.space, s.mesh) + 0.01 * stiffness_matrix(s.space, s.mesh));
    };
    add("factor", [=](const Scene& s) -> std::function<void()> {
        auto solver = std::make_shared<SparseCholesky>();
        auto A = std::make_shared<Eigen::SparseMatrix<double>>(matrix(s));
        solver->factor(*A);
        return [=] { solver->factor(*A); };
    });
    add("solve", [=](const Scene& s) -> std::function<void()> {
        auto solver = std::make_shared<SparseCholesky>();
        solver->factor(matrix(s));
        const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(s.mesh.size(), -1, 1);
        return [=] { benchmark::DoNotOptimize(solver->solve(b)); };
    });
    add("patch_nodal", [](const Scene& s) -> std::function<void()> {
        auto recovery = std::make_shared<PatchRecovery>(s.mesh);
        return [=, &s] { benchmark::DoNotOptimize(recovery->nodal(s.mesh)); };
    });
    add("patch", [](const Scene& s) -> std::function<void()> {
        auto recovery = std::make_shared<PatchRecovery>(s.mesh);
        auto project = std::make_shared<Projection>(s.space, s.mesh);
        return [=, &s] {
            project->update(s.space, s.mesh);
            benchmark::DoNotOptimize(recovery->projected(s.space, s.mesh, *project));
        };
    });
    add("elementwise", [](const Scene& s) -> std::function<void()> {
        return [&s] { benchmark::DoNotOptimize(recover(s.space, s.mesh, Recovery::elementwise)); };
    });
    add("bending_force", [](const Scene& s) -> std::function<void()> {
        auto field = std::make_shared<CurvatureField>(recover(s.space, s.mesh, Recovery::patch_nodal));
        return [=, &s] { benchmark::DoNotOptimize(bending_force(s.space, s.mesh, *field, {.k = {1, 1, 1}, .H0 = 0})); };
    });
}

}  // namespace
}  // namespace tubule::surface3d

int main(int argc, char** argv) {
    return tubule::run_benchmarks(argc, argv, tubule::surface3d::add_all);
}
