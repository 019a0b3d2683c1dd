#include "surface3d/run/motion_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "surface3d/run/motion_attempt.hpp"
#include "surface3d/run/motion_series.hpp"
#include "surface3d/run/motion_start.hpp"

namespace tubule::surface3d {
namespace {

// Nothing of it is cured by a finer run.
bool ended_by_physics(const StopReport& stop) {
    return exit_code(stop.reason) == exit_code(Stop::pinch_off);
}

bool known_until(const EnergyTrace& trace, double time) {
    return !trace.empty() && trace.end() > 0 && trace.end() >= time * (1 - 1e-3);
}

class MotionRuns : public PairedRuns {
public:
    MotionRuns(const Case& c, const Start& start, RunObserver& watch, const RunClock& clock, const Restart* restart)
        : case_(c), start_(start), watch_(watch), clock_(clock), restart_(restart), settings_(first_settings(c)) {
        if (!restart) return;
        begun_ = motion_restart(restart->record, time_scheme(c)).memory.settings;
        if (begun_->role == Role::reported) settings_ = *begun_;
    }

    void show_start() override { MotionAttempt(case_, watch_, clock_, settings_, nullptr).begin(start_); }

    // With too few triangles, or when their number is not ours to choose, the other run has elements of another order.
    // So it has where fewer triangles lose the surface on the way.
    RunSummary& run_coarser() override {
        const bool begun = begun_ && begun_->role == Role::other_order;
        const bool fewer = start_.resizable() && coarser(settings_, Role::fewer_triangles).elements >= least_triangles;
        if (begun || !fewer) return run_coarser(Role::other_order);
        const Stop first = run_coarser(Role::fewer_triangles).stop.reason;
        if (first != Stop::resolution_lost && first != Stop::pinch_off) return ended_.summary;
        Ended before = std::move(ended_);
        const Stop second = run_coarser(Role::other_order).stop.reason;
        if (!can_go_on(second) && !known_until(ended_.trace, before.summary.stop.time)) ended_ = std::move(before);
        return ended_.summary;
    }

    RunSummary& run_reported(const EndedRun& coarser) override { return run(case_, settings_, &coarser); }
    EndedRun ended() override { return {ended_.trace, ended_.summary.stop}; }

    // Where the coarser run ended earlier, all of the energy, but not if the same happened to both.
    double error(const EndedRun& other) override {
        RunSummary& s = ended_.summary;
        const bool known = known_until(other.trace, s.stop.time);
        if (!known)
            s.warnings.push_back(
                fmt::format("the coarser run of the pair ended at t = {:.6g} with {}: the error after that is unknown",
                            other.stop.time, name(other.stop.reason)));
        const bool together = ended_by_physics(s.stop) && s.stop.reason == other.stop.reason;
        if (!known && !together) ended_.difference = s.reference_energy;
        return std::max(ended_.difference, ended_.defect);
    }

    bool refine(const RunSummary& last) override {
        if (last.as_accurate_as_asked || last.stop.reason == Stop::ill_posed) return false;
        if (!fixed_by().empty() || !can_be_finer(settings_)) return false;
        settings_ = finer(settings_, case_.accuracy.energy * last.reference_energy, ended_.difference, ended_.defect);
        return true;
    }

    std::string fixed_by() const override {
        if (!start_.resizable()) return "the triangles are given";
        return settings_given(case_) ? "discretisation.elements, time_tolerance or step are given" : "";
    }

private:
    // What is left of the last run.
    struct Ended {
        RunSummary summary;
        EnergyTrace trace;
        double difference = 0, defect = 0;
    };

    RunSummary& run_coarser(Role role) {
        Case other = case_;
        const int order = element_order(case_);
        if (role == Role::other_order) other.surface.order = order > 2 ? order - 1 : 3;
        if (case_.surface.step) other.surface.step = 2 * *case_.surface.step;
        return run(other, coarser(settings_, role), nullptr);
    }

    // Goes on with the run that was interrupted, if it is that one.
    RunSummary& run(const Case& c, const MotionSettings& settings, const EndedRun* coarser) {
        MotionAttempt run(c, watch_, clock_, settings, coarser);
        if (restart_ && begun_->role == settings.role) {
            run.summary.warnings = start_.notes();
            run.resume(*std::exchange(restart_, nullptr));
        } else {
            run.begin(start_);
        }
        run.go();
        ended_ = {std::move(run.summary), std::move(run.trace), run.difference(), run.defect()};
        return ended_.summary;
    }

    const Case& case_;
    const Start& start_;
    RunObserver& watch_;
    const RunClock& clock_;
    const Restart* restart_;               // until the run goes on from it
    std::optional<MotionSettings> begun_;  // of the run that was interrupted
    MotionSettings settings_;              // of the run to be reported
    Ended ended_;
};

}  // namespace

void check_restart(const Case& c, const Record& record) {
    motion_restart(record, time_scheme(c)), pair_memory(record);
}

RunSummary run_motion(const Case& c, const Start& start, RunObserver& observer, const Restart* restart) {
    const RunClock clock(c, observer);
    return clock.pausing([&] {
        MotionRuns runs(c, start, observer, clock, restart);
        RunPairs pairs(runs, c, observer, begin_time(c), restart ? &restart->record : nullptr);
        return drive(c, observer, clock, pairs);
    });
}

}  // namespace tubule::surface3d
