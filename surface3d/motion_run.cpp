#include "surface3d/motion_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "surface3d/motion_attempt.hpp"
#include "surface3d/motion_series.hpp"
#include "surface3d/start.hpp"

namespace tubule::surface3d {
namespace {

constexpr int most_pairs = 6;

using Clock = std::chrono::steady_clock;

// What the finer run of a pair is compared with, and why that ended.
struct Coarse {
    MotionTrace trace;
    StopReport stop;
    bool known_until(double time) const {
        return !trace.empty() && trace.end() > 0 && trace.end() >= time * (1 - 1e-3);
    }
};

void describe(RunSummary& s, const Case& c, double error, int pairs) {
    s.estimated_error = s.reference_energy > 0 ? error / s.reference_energy : 1;
    s.as_accurate_as_asked = s.estimated_error <= c.accuracy.energy;
    s.details.emplace_back("pairs", std::int64_t{pairs});
}

// The last run: less accurate than asked although nothing is left to refine, or compared with nothing.
void accept(RunSummary& s, const Case& c, bool chosen, const Coarse& coarse) {
    if (!coarse.known_until(s.stop.time))
        s.warnings.push_back(
            fmt::format("the coarser run of the pair came to t = {:.6g} only: the error is not known "
                        "({})",
                        coarse.trace.empty() ? 0 : coarse.trace.end(), coarse.stop.message));
    if (s.as_accurate_as_asked || can_go_on(s.stop.reason)) return;
    s.warnings.push_back(fmt::format("the energy is off by {:.2g} of E_ref (estimated), {:.2g} was asked for",
                                     s.estimated_error, c.accuracy.energy));
    if (chosen || s.stop.reason != Stop::finished) return;
    s.stop = {Stop::resolution_lost, s.stop.time, s.warnings.back(), "ask for less accuracy"};
    s.warnings.pop_back();
}

Coarse run_coarse_once(const Case& c, RunObserver& observer, const MotionSettings& fine, bool by_order,
                       Clock::time_point started) {
    Case lower = c;
    if (by_order) lower.surface.order = element_order(c) > 2 ? element_order(c) - 1 : 3;
    if (c.surface.step) lower.surface.step = 2 * *c.surface.step;
    MotionSettings settings = coarser(fine);
    if (by_order) settings.elements = fine.elements;
    MotionAttempt run(lower, observer, false, settings, nullptr, started);
    run.begin();
    run.go();
    return {std::move(run.trace), run.summary.stop};
}

// With too few triangles, or when their number is not ours to choose, the other run has elements of another order. So
// it has where fewer triangles lose the surface on the way.
Coarse run_coarse(const Case& c, RunObserver& observer, const MotionSettings& fine, bool resizable,
                  Clock::time_point started) {
    const bool fewer = resizable && coarser(fine).elements >= least_triangles;
    Coarse out = run_coarse_once(c, observer, fine, !fewer, started);
    const bool lost = out.stop.reason == Stop::resolution_lost || out.stop.reason == Stop::pinch_off;
    if (!fewer || !lost) return out;
    Coarse other = run_coarse_once(c, observer, fine, true, started);
    return can_go_on(other.stop.reason) || other.known_until(out.stop.time) ? std::move(other) : std::move(out);
}

void run_fine(MotionAttempt& run, const Restart* restart) {
    restart ? run.resume(*restart) : run.begin();
    run.go();
}

}  // namespace

std::vector<std::string> motion_series_names(const Case&) {
    return motion_names();
}

RunSummary run_motion(const Case& c, RunObserver& observer, const Restart* restart) {
    const auto started = Clock::now();
    MotionSettings settings = first_settings(c);
    if (restart) {
        const MotionMemory memory = motion_restart(restart->record).memory;
        settings = {memory.elements, memory.tolerance};
    }
    const bool resizable = start_mesh(c, settings.elements).resizable;
    Coarse coarse;
    if (restart) coarse.trace = MotionTrace(restart->record);
    if (coarse.trace.empty()) {
        coarse = run_coarse(c, observer, settings, resizable, started);
        if (can_go_on(coarse.stop.reason)) {
            MotionAttempt first(c, observer, true, settings, nullptr, started);  // ends as soon: a step to go on from
            run_fine(first, restart);
            describe(first.summary, c, first.summary.reference_energy, 1);  // nothing is known of the error yet
            return first.summary;
        }
    }
    const bool given = settings_given(c) || !resizable;
    for (int pair = 1;; ++pair) {
        MotionAttempt fine(c, observer, true, settings, coarse.trace.empty() ? nullptr : &coarse.trace, started);
        run_fine(fine, restart);
        RunSummary& summary = fine.summary;
        const double difference = coarse.known_until(summary.stop.time) ? fine.difference() : summary.reference_energy;
        describe(summary, c, std::max(difference, fine.defect()), pair);
        if (summary.as_accurate_as_asked || given || pair == most_pairs || !can_be_finer(settings) ||
            can_go_on(summary.stop.reason)) {
            accept(summary, c, given, coarse);
            return summary;
        }
        settings = finer(settings, c.accuracy.energy * summary.reference_energy, difference, fine.defect());
        observer.discard();
        restart = nullptr;
        coarse = {std::move(fine.trace), summary.stop};
    }
}

}  // namespace tubule::surface3d
