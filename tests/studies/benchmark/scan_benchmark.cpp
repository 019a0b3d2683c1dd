// Whole scans of 100 x 100 points and the lines between their outcomes, on all processors, file included. Counters:
// points run, CPU seconds of their runs, and of a line how many times less than its map it took.
#include <benchmark/benchmark.h>

#include <filesystem>
#include <map>
#include <thread>

#include "tests/support/paths.hpp"
#include "tools/scan/dispatcher.hpp"

namespace tubule {
namespace {

std::map<std::string, ScanEffort> maps;  // of those that ran

void scan(benchmark::State& state, const std::string& name, const std::string& boundary) {
    const auto file = std::filesystem::temp_directory_path() / ("tubule_scan_benchmark_" + name + ".hdf");
    ScanEffort effort;
    for (auto _ : state) {
        ScanChoices choices;
        choices.file = test::cases + "/scans/" + name + ".toml";
        choices.boundary = boundary;
        const Scan what = read_scan(choices);
        ScanWriter writer = ScanWriter::create(file, what, {});
        Dispatcher dispatcher(writer, true);
        run_scan(dispatcher, what, static_cast<int>(std::thread::hardware_concurrency()));
        dispatcher.was_interrupted();  // throws what failed
        writer.finish({});
        effort = dispatcher.effort();
    }
    std::filesystem::remove(file);
    state.counters["points"] = static_cast<double>(effort.points);
    state.counters["cpu_seconds"] = effort.cpu_seconds;
    if (boundary.empty()) maps[name] = effort;
    if (boundary.empty() || !maps.contains(name)) return;
    state.counters["runs_ratio"] = static_cast<double>(maps[name].points) / static_cast<double>(effort.points);
    state.counters["cpu_ratio"] = maps[name].cpu_seconds / effort.cpu_seconds;
}

// A map takes long enough to be told by one run of it.
const bool registered = [] {
    for (const std::string name : {"amplitude_k42", "length_H0"})
        for (const std::string boundary : {"", "outcome", "unduloid"})
            benchmark::RegisterBenchmark((name + "/" + (boundary.empty() ? "map" : "line:" + boundary)).c_str(),
                                         [=](benchmark::State& state) { scan(state, name, boundary); })
                ->Iterations(1)
                ->UseRealTime()
                ->Unit(benchmark::kSecond);
    return true;
}();

}  // namespace
}  // namespace tubule

BENCHMARK_MAIN();
