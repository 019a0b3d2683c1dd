#include "surface3d/run/motion_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "common/run/driver.hpp"
#include "surface3d/run/companion_runs.hpp"

namespace tubule::surface3d {
namespace {

// Error over the tolerance beyond which a run is not finished, where a finer run can replace it.
constexpr double beyond_use = 3;

// Whether a finer run cannot help.
bool ended_by_physics(const StopReport& stop) {
    return exit_code(stop.reason) == exit_code(Stop::pinch_off);
}

class MotionRuns : public EstimatedRuns {
public:
    MotionRuns(const Problem& c, RunObserver& watch, const RunClock& clock, const Start& start, const Restart* restart)
        : case_(c),
          watch_(watch),
          clock_(clock),
          start_(start),
          restart_(restart),
          settings_(restart ? motion_restart(restart->record, c.scheme).memory.settings : first_settings(c, start)) {}

    RunSummary& next() override {
        CompanionRuns companions(case_, start_, clock_, settings_);
        if (fixed_by().empty() && can_be_finer(settings_)) companions.give_up = beyond_use * case_.accuracy.energy;
        SurfaceSimulation run(case_, watch_, settings_, case_.accuracy.estimate ? &companions : nullptr);
        const Restart* restart = std::exchange(restart_, nullptr);
        if (restart)
            run.resume(*restart, start_);
        else
            run.begin(start_);
        loop_of(run, case_, watch_, clock_).go_from(restart ? &restart->record : nullptr);
        const MotionMemory& memory = run.memory();
        ended_ = {std::move(run.summary),
                  {memory.error, companions.in_time(), companions.spare() * memory.balance.imbalance}};
        judge(companions.stop());
        return ended_.summary;
    }

    bool refine(const RunSummary& last) override {
        if (last.as_accurate_as_asked || last.stop.reason == Stop::ill_posed) return false;
        if (!fixed_by().empty() || !can_be_finer(settings_)) return false;
        settings_ = finer(settings_, case_.accuracy.energy * last.reference_energy, ended_.errors);
        return true;
    }

    std::string fixed_by() const override {
        if (!start_.resizable()) return "the triangles are given";
        return case_.surface_resolution_given() ? "discretisation.elements, time_tolerance or step are given" : "";
    }

private:
    // The results of the last run that the next one needs.
    struct Ended {
        RunSummary summary;
        MotionErrors errors;
    };

    // The stated error: unknown where a companion ended earlier, unless physics ended both for the same reason.
    void judge(const std::optional<StopReport>& companion) {
        RunSummary& s = ended_.summary;
        const bool paused = companion && can_go_on(companion->reason);
        const bool known = case_.accuracy.estimate && (!companion || companion->time >= s.stop.time * (1 - 1e-3));
        const bool together = companion && ended_by_physics(s.stop) && s.stop.reason == companion->reason;
        if (companion && !paused && !known && !together)
            s.warnings.push_back(
                fmt::format("the coarser run beside it ended at t = {:.6g} with {}{}: the error after that is unknown",
                            companion->time, name(companion->reason),
                            companion->message.empty() ? "" : " (" + companion->message + ")"));
        if (!known && !together) ended_.errors.energy = s.reference_energy;
        const double error = std::max(ended_.errors.energy, ended_.errors.imbalance);
        s.estimated_error = s.reference_energy > 0 ? error / s.reference_energy : 1;
    }

    const Problem& case_;
    RunObserver& watch_;
    const RunClock& clock_;
    const Start& start_;
    const Restart* restart_;  // until a run has resumed from it
    MotionSettings settings_;
    Ended ended_;
};

}  // namespace

void check_restart(const Problem& c, const Record& record) {
    motion_restart(record, c.scheme);
    if (c.accuracy.estimate) check_companions(c, record);
}

RunSummary run_motion(const Problem& c, const Start& start, RunObserver& observer, const Restart* restart) {
    return drive_runs<MotionRuns>(c, observer, start, restart);
}

}  // namespace tubule::surface3d
