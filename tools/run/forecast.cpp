#include "tools/run/forecast.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

#include "common/solve/pause.hpp"
#include "common/solve/progress.hpp"
#include "surface3d/run/motion_forecast.hpp"
#include "tools/run/engine.hpp"

namespace tubule {
namespace {

constexpr double pilot_limit = 2;           // seconds
constexpr double reported_by_coarser = 4;   // cost of the runs of a pair
constexpr double most_extrapolated = 1000;  // a pilot that came to less of the run says nothing about it

double memory_in_use() {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    return 1024.0 * static_cast<double>(used.ru_maxrss);
}

Forecast by_its_beginning(Case c) {
    c.time.limit = pilot_limit;
    const auto engine = engine_for(c);
    Pilot pilot;
    const auto begin = std::chrono::steady_clock::now();
    const std::clock_t before = std::clock();
    const RunSummary s = engine->run(pilot);
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    pause_if_due();
    Forecast out;
    if (s.elements > 0) out.resolution = fmt::format("{} elements", s.elements);
    out.bytes = memory_in_use();
    if (s.stop.reason == Stop::ill_posed && !pilot.moved()) out.ill_posed = s.stop.message;
    // Of a busy machine the time of the processors, else, where threads share the work, that of the clock.
    const double seconds = std::min(wall, static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC);
    if (s.stop.reason != Stop::time_limit) {
        out.seconds = seconds;
        if (pilot.moved()) out.steps = pilot.steps();
    } else if (pilot.moved()) {
        const double factor = pilot.all_by_done(c.time.end);
        if (!(factor < most_extrapolated)) return out;
        out.steps = factor * pilot.steps();
        out.seconds = factor * seconds * (pilot.last_run() ? 1 : 1 + reported_by_coarser);
    }
    return out;
}

// Two digits.
std::string rounded(double value) {
    const double last = std::pow(10, std::floor(std::log10(std::max(value, 1e-300))) - 1);
    return fmt::format("{:g}", std::round(value / last) * last);
}

}  // namespace

Forecast forecast(const Case& c) {
    if (c.tier != Tier::surface3d || !c.moves()) return by_its_beginning(c);
    return surface3d::forecast_motion(c, surface3d::Start(c));
}

std::string words(const Forecast& f) {
    std::string out = f.resolution.empty() ? "" : f.resolution + "; ";
    if (f.steps) out += fmt::format("about {} steps, ", rounded(*f.steps));
    out += f.seconds ? (*f.seconds < 1 ? "less than a second" : "about " + duration(*f.seconds))
                     : "the time cannot be estimated: set time.limit";
    out += fmt::format(", {} MB", rounded(f.bytes / 1e6));
    return out + (f.finer_runs ? "; the motion is rough: finer runs may follow, each at least twice as long" : "");
}

}  // namespace tubule
