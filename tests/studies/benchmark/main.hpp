// main() of the benchmarks that say themselves what there is.
#pragma once

#include <benchmark/benchmark.h>

namespace tubule {

// Runs what add_all() registers, as the command line asks. The exit status.
template <class AddAll>
int run_benchmarks(int argc, char** argv, AddAll add_all) {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    add_all();
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}

}  // namespace tubule
