#include "surface3d/run/motion_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "surface3d/run/motion_attempt.hpp"
#include "surface3d/run/motion_series.hpp"
#include "surface3d/run/motion_start.hpp"

namespace tubule::surface3d {
namespace {

constexpr int most_pairs = 6;

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

// Nothing of it is cured by a finer run.
bool ended_by_physics(const StopReport& stop) {
    return exit_code(stop.reason) == exit_code(Stop::pinch_off);
}

// The last run: less accurate than asked although nothing is left to refine, or compared with nothing.
void accept(RunSummary& s, const Case& c, bool chosen, const Coarse& coarse) {
    if (!coarse.known_until(s.stop.time)) {
        const std::string why = coarse.stop.message.empty() ? "" : fmt::format(" ({})", coarse.stop.message);
        s.warnings.push_back(
            fmt::format("the coarser run of the pair came to t = {:.6g} only: the error after that is not known{}",
                        coarse.trace.empty() ? 0 : coarse.trace.end(), why));
    }
    if (s.as_accurate_as_asked || can_go_on(s.stop.reason)) return;
    s.warnings.push_back(fmt::format("the energy is off by {:.2g} of E_ref (estimated), {:.2g} was asked for",
                                     s.estimated_error, c.accuracy.energy));
    if (chosen || s.stop.reason != Stop::finished) return;
    s.stop = {Stop::resolution_lost, s.stop.time, s.warnings.back(), "ask for less accuracy"};
    s.warnings.pop_back();
}

// The runs of a case: in pairs, each finer than the one before.
class Pairs {
public:
    Pairs(const Case& c, const Start& start, RunObserver& watch, const Restart* restart)
        : case_(c), start_(start), watch_(watch), restart_(restart), settings_(first_settings(c)) {
        if (restart) {
            begun_ = motion_restart(restart->record, time_scheme(c)).memory.settings;
            if (begun_->role == Role::reported) settings_ = *begun_, coarse_.trace = {restart->record, coarser_trace};
        }
    }

    RunSummary run() {
        if (coarse_.trace.empty()) {
            // The result shows the start, whatever ends the coarser run.
            if (!restart_) MotionAttempt(case_, watch_, settings_, nullptr, started_).begin(start_);
            RunSummary other = run_coarse();
            if (can_go_on(other.stop.reason)) return unfinished(std::move(other));
            watch_.discard();  // the start, and what the other was saved with
            restart_ = nullptr;
        }
        const bool given = settings_given(case_) || !start_.resizable();
        for (;;) {
            MotionAttempt fine = attempt(case_, settings_, coarse_.trace.empty() ? nullptr : &coarse_.trace);
            RunSummary& s = fine.summary;
            const bool together = ended_by_physics(s.stop) && s.stop.reason == coarse_.stop.reason;
            const bool known = together || coarse_.known_until(s.stop.time);
            const double difference = known ? fine.difference() : s.reference_energy;
            describe(s, case_, std::max(difference, fine.defect()), settings_.pair);
            const bool enough = s.as_accurate_as_asked || s.stop.reason == Stop::ill_posed || can_go_on(s.stop.reason);
            const bool most = given || settings_.pair >= most_pairs || !can_be_finer(settings_);
            const auto pause = enough || most ? std::nullopt : find_pause(case_, watch_, started_, s.stop.time);
            if (pause) s.stop = *pause, s.stop.message += ", before a finer run";
            if (enough || most || pause) {
                accept(s, case_, given, coarse_);
                return s;
            }
            settings_ = finer(settings_, case_.accuracy.energy * s.reference_energy, difference, fine.defect());
            watch_.discard();
            coarse_ = {std::move(fine.trace), s.stop};
        }
    }

private:
    // Goes on with the run that was interrupted, if it is that one.
    MotionAttempt attempt(const Case& c, const MotionSettings& settings, const MotionTrace* coarser) {
        MotionAttempt out(c, watch_, settings, coarser, started_);
        const bool again = restart_ && begun_->role == settings.role;
        if (again) {
            out.summary.warnings = start_.notes();
            out.resume(*restart_);
            restart_ = nullptr;
        } else {
            out.begin(start_);
        }
        out.go();
        return out;
    }

    RunSummary run_coarse(Role role) {
        Case other = case_;
        const int order = element_order(case_);
        if (role == Role::other_order) other.surface.order = order > 2 ? order - 1 : 3;
        if (case_.surface.step) other.surface.step = 2 * *case_.surface.step;
        MotionAttempt run = attempt(other, coarser(settings_, role), nullptr);
        coarse_ = {std::move(run.trace), run.summary.stop};
        return run.summary;
    }

    // With too few triangles, or when their number is not ours to choose, the other run has elements of another order.
    // So it has where fewer triangles lose the surface on the way.
    RunSummary run_coarse() {
        const bool begun = begun_ && begun_->role == Role::other_order;
        const bool fewer = start_.resizable() && coarser(settings_, Role::fewer_triangles).elements >= least_triangles;
        if (begun || !fewer) return run_coarse(Role::other_order);
        RunSummary first = run_coarse(Role::fewer_triangles);
        if (first.stop.reason != Stop::resolution_lost && first.stop.reason != Stop::pinch_off) return first;
        Coarse before = std::move(coarse_);
        RunSummary second = run_coarse(Role::other_order);
        if (can_go_on(second.stop.reason) || coarse_.known_until(before.stop.time)) return second;
        coarse_ = std::move(before);
        return first;
    }

    // The coarser run has been saved, to go on with.
    RunSummary unfinished(RunSummary s) {
        describe(s, case_, s.reference_energy, settings_.pair);  // nothing is known of the error yet
        s.stop.message +=
            fmt::format(", at t = {:.6g} of the coarser run, which tells the error of the other", s.stop.time);
        s.stop.time = begin_time(case_);
        return s;
    }

    const Case& case_;
    const Start& start_;
    RunObserver& watch_;
    const Restart* restart_;
    const Clock::time_point started_ = Clock::now();
    std::optional<MotionSettings> begun_;  // of the run that was interrupted
    MotionSettings settings_;              // of the run to be reported
    Coarse coarse_;
};

}  // namespace

std::vector<std::string> motion_series_names(const Case&) {
    return motion_names();
}

void check_restart(const Case& c, const Record& record) {
    motion_restart(record, time_scheme(c));
}

RunSummary run_motion(const Case& c, const Start& start, RunObserver& observer, const Restart* restart) {
    return Pairs(c, start, observer, restart).run();
}

}  // namespace tubule::surface3d
