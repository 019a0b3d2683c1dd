#include "common/run/driver.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tubule {
namespace {

constexpr double rounding = 1e-12;  // of E_ref: no energy is known better

// Reports that the last run is less accurate than asked, where it is.
void judge(RunSummary& s, const Problem& c, const std::string& fixed_by) {
    if (s.as_accurate_as_asked || can_go_on(s.stop.reason)) return;
    const std::string error = s.error_is_known() ? fmt::format("the estimated error of the energy is {:.2g} of E_ref",
                                                               s.estimated_error)
                                                 : "the error of the energy is unknown",
                      missed = fmt::format("{}, but {:.2g} was asked for", error, c.accuracy.energy);
    if (fixed_by.empty() && s.stop.reason == Stop::finished)
        s.stop = {Stop::resolution_lost, s.stop.time, missed, "use a looser accuracy.energy"};
    else
        s.warnings.push_back(fixed_by.empty() ? missed : fmt::format("{}: {}", missed, fixed_by));
}

}  // namespace

RunSummary& drive(const Problem& c, RunObserver& watch, const RunClock& clock, EstimatedRuns& runs) {
    if (const std::string endless = unbounded_below(c.energy); !endless.empty()) watch.note(endless);
    for (int number = 1;; ++number) {
        watch.next_run(number, number);
        RunSummary& s = runs.next();
        s.estimated_error = std::max(s.estimated_error, rounding);
        s.as_accurate_as_asked = !c.accuracy.estimate || s.estimated_error <= c.accuracy.energy;
        if (can_go_on(s.stop.reason)) return s;
        if (!runs.refine(s)) {
            judge(s, c, runs.fixed_by());
            return s;
        }
        if (const auto pause = clock.find_pause(s.stop.time)) {
            s.stop = *pause;
            s.stop.message += ", before a finer run";
            return s;
        }
        watch.discard();
    }
}

}  // namespace tubule
