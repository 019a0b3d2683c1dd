#include "tools/run/forecast.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>

#include "common/solve/progress.hpp"
#include "surface3d/run/motion_forecast.hpp"
#include "tools/run/trial_run.hpp"

namespace tubule {
namespace {

// Measured for result files: a frame without its arrays, and the memory that writing the file takes, over its size.
constexpr double seconds_of_frame = 0.85e-3, bytes_of_frame = 8.5e3, memory_of_file = 4.3;
constexpr double much = 1e8;  // bytes
// Measured for surfaces that do not move: for each triangle, times the square of its order.
constexpr double seconds_at_rest = 7.2e-6, bytes_at_rest = 1.25e3;
constexpr double pilot_limit = 2;           // seconds
constexpr double reported_by_coarser = 4;   // cost of the runs of a pair
constexpr double most_extrapolated = 1000;  // a pilot that came to less of the run says nothing about it

double memory_in_use() {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    return 1024.0 * static_cast<double>(used.ru_maxrss);
}

Forecast by_its_beginning(const Problem& whole) {
    Case c = whole;
    c.time.limit = std::min(pilot_limit, 0.5 * c.time.limit.value_or(pilot_limit / 0.5));
    const TrialRun trial(c, {});
    const RunSummary& s = trial.summary;
    Forecast out;
    if (s.elements > 0) out.resolution = fmt::format("{} elements", s.elements);
    out.bytes = memory_in_use();
    if (s.stop.reason == Stop::ill_posed && !trial.moved()) out.ill_posed = s.stop.message;
    if (s.stop.reason != Stop::time_limit) {
        out.seconds = trial.seconds;
        if (trial.moved()) out.steps = trial.steps();
    } else if (trial.moved()) {
        const double factor = trial.all_by_done(c.time.end);
        if (!(factor < most_extrapolated)) return out;
        out.steps = factor * trial.steps();
        out.seconds = factor * trial.seconds * (trial.last_run() ? 1 : 1 + reported_by_coarser);
    }
    return out;
}

// Two digits.
std::string rounded(double value) {
    const double last = std::pow(10, std::floor(std::log10(std::max(value, 1e-300))) - 1);
    return fmt::format("{:g}", std::round(value / last) * last);
}

}  // namespace

std::optional<Forecast> forecast_at_rest(const Problem& c) {
    if (c.unknowns != Unknowns::surface || !c.surface.elements) return std::nullopt;
    const double size = std::pow(c.element_order, 2) * *c.surface.elements;
    Forecast out;
    out.resolution = fmt::format("about {} triangles of order {}", *c.surface.elements, c.element_order);
    out.seconds = seconds_at_rest * size, out.bytes = bytes_at_rest * size;
    return out;
}

Forecast forecast(const Problem& c) {
    if (const auto at_rest = forecast_at_rest(c)) return *at_rest;
    if (c.unknowns != Unknowns::moving_surface) return by_its_beginning(c);
    return surface3d::forecast_motion(c, surface3d::Start(c));
}

std::string cost_of_frames(const Problem& c, const Record& first) {
    double bytes = bytes_of_frame;
    for (const Array& array : first.arrays) bytes += sizeof(double) * static_cast<double>(array.data.size());
    const auto frames = static_cast<double>(c.time.output.size()) + 1;
    if (frames * bytes < much) return "";
    return fmt::format("time.output asks for {} frames: a result of about {} MB, which takes {} s and {} MB of memory",
                       frames, rounded(frames * bytes / 1e6), rounded(frames * seconds_of_frame),
                       rounded(frames * bytes / 1e6 * memory_of_file));
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
