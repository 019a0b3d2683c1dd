// The driver of all runs that estimate their error: it runs a case with finer and finer settings until the energy is as
// accurate as asked, nothing finer is left to try, or the run is to pause.
#pragma once

#include <string>

#include "common/case/problem.hpp"
#include "common/run/run_clock.hpp"
#include "common/run/run_observer.hpp"

namespace tubule {

// The runs of a case, and how their error is estimated. There are: an error that the run itself carries along
// (axisym/graph/graph_run), a run beside a coarser one (axisym/curve/curve_run, surface3d/run/motion_run), a shape on
// several meshes (surface3d/run/single_surface).
class EstimatedRuns {
public:
    virtual ~EstimatedRuns() = default;

    // One run with the present settings; the first one resumes an interrupted one, if there is one. It sets stop,
    // energy, E_ref and the estimated error of the summary, which lives until the next call.
    virtual RunSummary& next() = 0;

    // Makes the settings finer. False if the run is accurate enough, or nothing finer is worth a try.
    virtual bool refine(const RunSummary& last) = 0;

    // What of the case fixes how fine its runs are, in words; empty if the program is free to choose.
    virtual std::string fixed_by() const = 0;
};

// Runs the case; everything the observer has been given belongs to the run whose summary is returned. A run that ends
// as it should, but less accurate than asked, has a warning if the case fixes how fine it is, else it is a failure.
RunSummary& drive(const Problem& c, RunObserver& watch, const RunClock& clock, EstimatedRuns& runs);

// As drive(), of Runs(c, watch, clock, more...). Where making them or their first state pauses, the summary says so.
template <class Runs, class... More>
RunSummary drive_runs(const Problem& c, RunObserver& watch, const More&... more) {
    const RunClock clock(c.time, watch);
    return clock.pausing([&]() -> RunSummary {
        Runs runs(c, watch, clock, more...);
        return drive(c, watch, clock, runs);
    });
}

}  // namespace tubule
