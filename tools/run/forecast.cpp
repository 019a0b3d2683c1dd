#include "tools/run/forecast.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>

#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/progress.hpp"
#include "common/solve/sparse.hpp"
#include "surface3d/motion/motion_forms.hpp"
#include "surface3d/run/motion_settings.hpp"
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
// Surfaces in motion, measured: docs/decisions/time_and_memory.md, "What will a run take?".
constexpr double trial_limit = 6;         // seconds of each trial run
constexpr double limit_of_all = 15;       // with their initial meshes
constexpr double trial_accuracy = 0.05;   // no better
constexpr double trial_tolerance = 3e-5;  // tighter ones take more steps than a forecast needs
constexpr double cost_power = 1.2;        // of the number of triangles: the cost of a step
// Cost of a run with its coarser ones, over its own: with one, or with two where orders are high.
constexpr double with_coarser_run = 1.35, with_coarser_runs = 1.6;
constexpr double threads_power = 0.6;                           // two of them are worth 1.5
constexpr double bytes_in_motion = 25e6, bytes_per_entry = 70;  // of the matrices of all triangles
// Fluids of which this part of the steps leads to rough surfaces may need finer runs, for tolerances below this.
constexpr double rough_part = 0.1, asked_of_rough = 5e-3;
constexpr double usual_steps = 100, usual_step = 0.5e-3;  // at the loosest tolerance; seconds for a triangle
constexpr double long_motion = 20;                        // seconds, by those
constexpr double long_run = 60;                           // seconds
constexpr double part_of_limit = 0.1;                     // of time.limit, that forecasts before a run may take

double memory_in_use() {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    return 1024.0 * static_cast<double>(used.ru_maxrss);
}

Forecast by_its_beginning(const Problem& whole) {
    Case c = whole;
    c.time.limit = std::min(pilot_limit, 0.5 * c.time.limit.value_or(pilot_limit / 0.5));
    const TrialRun trial(c);
    const RunSummary& s = trial.summary;
    Forecast out;
    if (s.elements > 0) out.resolution = fmt::format("{} elements", s.elements);
    out.bytes = memory_in_use();
    if (trial.is_ill_posed()) out.ill_posed = s.stop.message;
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

// Its matrices and factors, and those of the coarser run.
double bytes_of(const Problem& c, const surface3d::CurvedMesh& mesh, int triangles) {
    const double width = surface3d::MotionUnknowns(mesh, c.law, c.energy).width();
    return bytes_in_motion + bytes_per_entry * triangles * width * width;
}

double runs_at_once(const Problem& c) {
    if (!c.accuracy.estimate) return 1;
    return surface3d::is_of_high_order(c) ? with_coarser_runs : with_coarser_run;
}

double steps_by_tolerance(const Problem& c, double from, double to) {
    return std::pow(from / to, 1.0 / (entry(c.scheme).most_order + 1));
}

std::optional<TrialRun> on_few_triangles(const Problem& asked, const surface3d::Start& start, int triangles,
                                         double tolerance) try {
    Case c = asked;
    c.time.limit = trial_limit;
    c.time.output.clear();
    c.surface.elements = triangles, c.surface.time_tolerance = tolerance;
    c.surface.coarsen = false;
    c.surface.scheme = asked.scheme;
    c.accuracy.energy = std::max(asked.accuracy.energy, trial_accuracy), c.accuracy.estimate = false;
    return TrialRun(Engine(c, start));
} catch (const SolveError&) {
    return std::nullopt;
}

// None where it does not tell. What stops its mesh concerns few triangles only; another one may do.
std::optional<double> steps_of_all(const TrialRun& trial, double end) {
    const StopReport& stop = trial.summary.stop;
    const bool lost =
        stop.reason == Stop::resolution_lost || stop.reason == Stop::mesh_lost || stop.reason == Stop::solver_failed;
    const bool whole = stop.reason != Stop::time_limit && !lost;
    if (!trial.moved() || (lost && stop.time < 0.5 * end) || (!whole && trial.has_collapsed())) return std::nullopt;
    return trial.steps() * (whole ? 1 : trial.all_by_done(end));
}

// Whether a finer run would follow where the stated error of a fluid exceeds the tolerance.
bool can_be_repeated(const Problem& c, const surface3d::Start& start) {
    return c.law.inertia != 0 && c.accuracy.estimate && c.accuracy.energy < asked_of_rough && start.resizable() &&
           !c.surface_resolution_given();
}

// For surfaces that do not move, whose number of triangles is given.
std::optional<Forecast> forecast_at_rest(const Problem& c) {
    if (c.unknowns != Unknowns::surface || !c.surface.elements) return std::nullopt;
    const double size = std::pow(c.element_order, 2) * *c.surface.elements;
    Forecast out;
    out.resolution = fmt::format("about {} triangles of order {}", *c.surface.elements, c.element_order);
    out.seconds = seconds_at_rest * size, out.bytes = bytes_at_rest * size;
    return out;
}

// For surfaces in motion. The number of steps hardly depends on the triangles, and follows from the tolerance by the
// order of the scheme: a trial run has few of them and a loose tolerance. Where the stated error then exceeds what is
// asked, and a finer run follows, it takes longer than that: so it may be where many steps of a fluid lead to surfaces
// that are rough for the mesh of the trial run.
Forecast forecast_motion(const Problem& c, const surface3d::Start& start) {
    Forecast out;
    try {
        const PauseWatch watch(limit_of_all, [] { return false; });
        const surface3d::MotionSettings wanted = first_settings(c, start);
        const surface3d::CurvedMesh some = start.mesh(surface3d::least_triangles, c.element_order).mesh;
        const int triangles = start.resizable() ? wanted.elements : some.triangles();
        out.resolution = fmt::format("about {} triangles of order {}", triangles, c.element_order);
        out.bytes = bytes_of(c, some, triangles);
        const double tolerance = std::max(wanted.tolerance, trial_tolerance);
        for (int few = surface3d::least_triangles; !out.steps && few <= 4 * surface3d::least_triangles; few *= 2) {
            const int own = start.resizable() ? std::min(few, triangles) : triangles;
            const auto trial = on_few_triangles(c, start, own, tolerance);
            if (trial && trial->is_ill_posed()) out.ill_posed = trial->summary.stop.message;
            if (const auto steps = trial ? steps_of_all(*trial, c.time.end) : std::nullopt) {
                const double per_step = trial->cpu_of_steps / std::pow(loop_threads(), threads_power) / trial->steps() *
                                        std::pow(1.0 * triangles / own, cost_power);
                out.steps = *steps * (c.surface.step ? 1 : steps_by_tolerance(c, tolerance, wanted.tolerance));
                out.seconds = runs_at_once(c) * *out.steps * per_step;
                out.finer_runs = trial->summary.rough_steps > rough_part * trial->steps() && can_be_repeated(c, start);
            }
            if (own == triangles || !out.ill_posed.empty()) break;
        }
    } catch (const Paused&) {  // the initial mesh alone takes long
    }
    pause_if_due();
    return out;
}

// Whether a motion might take more than a minute, by its settings and its initial shape alone.
bool may_be_long(const Problem& c, const surface3d::Start& start) {
    const surface3d::MotionSettings s = first_settings(c, start);
    if (can_be_repeated(c, start) && is_rough(start.mesh(s.elements, c.element_order).mesh)) return true;
    const double steps = c.surface.step ? c.time.end / *c.surface.step
                                        : usual_steps * std::max(1.0, steps_by_tolerance(c, 1e-4, s.tolerance));
    return steps * s.elements * usual_step > long_motion;
}

// Two digits.
std::string rounded(double value) {
    const double last = std::pow(10, std::floor(std::log10(std::max(value, 1e-300))) - 1);
    return fmt::format("{:g}", std::round(value / last) * last);
}

}  // namespace

Forecast forecast(const Problem& c) {
    if (const auto at_rest = forecast_at_rest(c)) return *at_rest;
    if (c.unknowns != Unknowns::moving_surface) return by_its_beginning(c);
    return forecast_motion(c, surface3d::Start(c));
}

std::optional<Forecast> forecast_if_long(const Problem& c, const surface3d::Start& start) {
    std::optional<double> limit = c.time.limit;  // to which this counts, too
    if (limit) *limit *= part_of_limit;
    const PauseWatch watch(limit, [] { return false; });
    try {
        std::optional<Forecast> f = forecast_at_rest(c);
        if (c.unknowns == Unknowns::moving_surface && may_be_long(c, start)) f = forecast_motion(c, start);
        return f && (f->seconds.value_or(0) > long_run || f->finer_runs) ? f : std::nullopt;
    } catch (const Paused&) {  // the run itself finds why, if that is not the part
        return std::nullopt;
    }
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
    return out + (f.finer_runs ? "; the motion is not smooth: finer runs may follow, each at least twice as long" : "");
}

}  // namespace tubule
