#include "surface3d/run/motion_forecast.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse.hpp"
#include "surface3d/motion/motion_forms.hpp"
#include "surface3d/run/surface_simulation.hpp"

namespace tubule::surface3d {
namespace {

// Measured choices: docs/decisions/time_and_memory.md, "What will a run take?".
constexpr double pilot_limit = 6;         // seconds of each pilot run
constexpr double limit = 15;              // of all of them, with their initial meshes
constexpr double pilot_tolerance = 3e-5;  // tighter ones take more steps than a forecast needs
constexpr double cost_power = 1.2;        // of the number of triangles: the cost of a step
// Cost of a run with its coarser ones, over its own: with one, or with two where orders are high.
constexpr double with_coarser_run = 1.35, with_coarser_runs = 1.6;
constexpr double threads_power = 0.6;                         // two of them are worth 1.5
constexpr double bytes_at_rest = 25e6, bytes_per_entry = 70;  // of the matrices of all triangles
// Fluids of which this part of the steps leads to rough surfaces may need finer runs, for tolerances below this.
constexpr double rough_part = 0.1, asked_of_rough = 5e-3;
constexpr double usual_steps = 100, usual_step = 0.5e-3;  // at the loosest tolerance; seconds for a triangle

// CPU seconds of this process over the speedup by its threads on a quiet machine.
double quiet_seconds() {
    return std::clock() / (CLOCKS_PER_SEC * std::pow(loop_threads(), threads_power));
}

// Memory of both runs: their matrices and factors.
double bytes_of(const Problem& c, const CurvedMesh& mesh, int triangles) {
    const double width = MotionUnknowns(mesh, c.law, c.energy).width();
    return bytes_at_rest + bytes_per_entry * triangles * width * width;
}

double runs_at_once(const Problem& c) {
    if (!c.accuracy.estimate) return 1;
    return is_of_high_order(c) ? with_coarser_runs : with_coarser_run;
}

double steps_by_tolerance(const Problem& c, double from, double to) {
    return std::pow(from / to, 1.0 / (entry(c.scheme).most_order + 1));
}

struct PilotRun {
    double steps = 0, seconds_per_step = 0;
    bool useful = false, rough = false;
    std::string ill_posed = {};  // why it cannot begin
};

// A pilot run on `triangles`. What stops its mesh concerns few triangles only; another one may do.
PilotRun pilot_run(const Problem& asked, const Start& start, int triangles, double tolerance) {
    Case rough = asked;
    rough.time.limit = pilot_limit;
    rough.time.output.clear();
    rough.surface.coarsen = false;
    rough.surface.scheme = asked.scheme;
    rough.accuracy.energy = std::max(asked.accuracy.energy, 0.05);
    const Problem c(rough);
    Pilot pilot;
    const RunClock clock(c.time, pilot);
    SurfaceSimulation run(c, pilot, {.elements = triangles, .tolerance = tolerance}, nullptr);
    try {
        run.begin(start);
        const double before = quiet_seconds();
        Loop loop = loop_of(run, c, pilot, clock);
        loop.begin();
        loop.go();
        const Stop stop = run.summary.stop.reason;
        if (stop == Stop::ill_posed && !pilot.moved()) return {.ill_posed = run.summary.stop.message};
        const bool lost = stop == Stop::resolution_lost || stop == Stop::mesh_lost || stop == Stop::solver_failed;
        const bool whole = stop != Stop::time_limit && !lost;
        if (!pilot.moved() || (lost && run.summary.stop.time < 0.5 * c.time.end)) return {};
        if (!whole && pilot.has_collapsed()) return {};
        return {pilot.steps() * (whole ? 1 : pilot.all_by_done(c.time.end)), (quiet_seconds() - before) / pilot.steps(),
                true, run.memory().count.rough > rough_part * run.memory().count.steps};
    } catch (const SolveError&) {
    }
    return {};
}

// Whether a finer run would follow where the stated error of a fluid exceeds the tolerance.
bool can_be_repeated(const Problem& c, const Start& start) {
    return c.law.inertia != 0 && c.accuracy.estimate && c.accuracy.energy < asked_of_rough && start.resizable() &&
           !c.surface_resolution_given();
}

bool is_rough(const StartMesh& start) {
    const SurfaceSpace space(start.mesh);
    return is_rough(smoothness_of(start.mesh, motion_fields(space, start.mesh, Projection(space, start.mesh)).H));
}

Forecast by_pilot_runs(const Problem& c, const Start& start) {
    const PauseWatch watch(limit, [] { return false; });
    Forecast out;
    try {
        const MotionSettings wanted = first_settings(c, start);
        const CurvedMesh some = start.mesh(least_triangles, c.element_order).mesh;
        const int triangles = start.resizable() ? wanted.elements : some.triangles();
        out.resolution = fmt::format("about {} triangles of order {}", triangles, c.element_order);
        out.bytes = bytes_of(c, some, triangles);
        const double tolerance = std::max(wanted.tolerance, pilot_tolerance);
        for (int few = std::min(least_triangles, triangles); !out.steps && few <= 4 * least_triangles; few *= 2) {
            const int own = start.resizable() ? std::min(few, triangles) : triangles;
            const PilotRun pilot = pilot_run(c, start, own, tolerance);
            if (pilot.useful) {
                out.steps = pilot.steps * (c.surface.step ? 1 : steps_by_tolerance(c, tolerance, wanted.tolerance));
                const double per_step = pilot.seconds_per_step * std::pow(1.0 * triangles / own, cost_power);
                out.seconds = runs_at_once(c) * *out.steps * per_step;
            }
            out.ill_posed = pilot.ill_posed;
            out.finer_runs = pilot.rough && can_be_repeated(c, start);
            if (own == triangles || !out.ill_posed.empty()) break;
        }
    } catch (const Paused&) {  // the initial mesh alone takes long
    }
    return out;
}

}  // namespace

bool may_be_long(const Problem& c, const Start& start) {
    const MotionSettings s = first_settings(c, start);
    if (can_be_repeated(c, start) && is_rough(start.mesh(s.elements, c.element_order))) return true;
    const double steps = c.surface.step ? c.time.end / *c.surface.step
                                        : usual_steps * std::max(1.0, steps_by_tolerance(c, 1e-4, s.tolerance));
    return steps * s.elements * usual_step > 20;
}

Forecast forecast_motion(const Problem& c, const Start& start) {
    Forecast out = by_pilot_runs(c, start);
    pause_if_due();
    return out;
}

}  // namespace tubule::surface3d
