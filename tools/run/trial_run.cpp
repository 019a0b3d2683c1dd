#include "tools/run/trial_run.hpp"

#include <algorithm>
#include <chrono>

#include "common/series/table.hpp"
#include "common/solve/pause.hpp"

namespace tubule {

TrialRun::TrialRun(const Engine& engine, const TrialLimits& limits) : limits_(limits), series_(engine.series_names()) {
    const auto begin = std::chrono::steady_clock::now();
    begin_ = std::clock();
    summary = engine.run(*this);
    seconds = std::min(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), since(begin_));
    cpu_of_steps = since(first_row_);
    pause_if_due();
}

void TrialRun::row(std::span<const double> values) {
    if (rows_++ == 0) first_row_ = std::clock();
    const auto value = [&](const char* name) { return value_in(values, series_, name); };
    if (energies.empty()) area = value("area"), r_max = value("r_max");
    energies.add(values[0], value("energy"));
}

}  // namespace tubule
