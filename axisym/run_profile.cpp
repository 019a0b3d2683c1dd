#include "axisym/run_profile.hpp"

#include "axisym/curve/coarser_curve.hpp"
#include "axisym/curve/curve_run.hpp"
#include "axisym/graph/graph_output.hpp"
#include "axisym/graph/graph_run.hpp"

namespace tubule::axisym {

std::vector<std::string> series_names(const Problem& c) {
    return c.unknowns == Unknowns::graph ? graph_series(c).names() : curve_series(c).names();
}

void check_restart(const Record& record) {
    if (kind_of(record) == RecordKind::curve)
        curve_restart(record), CoarserCurve::check_restart(record);
    else
        graph_restart(record);
}

RunSummary run_profile(const Problem& c, RunObserver& observer, const Restart* restart) {
    const Record* from = restart ? &restart->record : nullptr;
    if (c.unknowns != Unknowns::graph || (from && kind_of(*from) == RecordKind::curve))
        return run_curve(c, observer, from);
    RunSummary summary = run_graph(c, observer, from);
    if (summary.stop.reason != Stop::overhang || c.discretisation.parametrisation) return summary;
    observer.discard();
    return run_curve(c, observer);
}

}  // namespace tubule::axisym
