#include "axisym/run.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "axisym/curve/curve_frame.hpp"
#include "axisym/curve/curve_run.hpp"
#include "axisym/graph/graph_frame.hpp"
#include "axisym/graph/graph_run.hpp"

namespace tubule::axisym {
namespace {

// Whether the case can be computed as a graph r(z), and nothing else is asked for.
bool begins_as_graph(const Case& c) {
    return std::holds_alternative<Tube>(c.shape) && motion_law(c.model).unconstrained() &&
           c.discretisation.parametrisation.value_or(Parametrisation::graph) == Parametrisation::graph;
}

}  // namespace

void describe_effort(RunSummary& s) {
    const FlowCounters& n = s.counters;
    s.effort = fmt::format("{} steps, {} elements", n.steps, s.elements);
    s.details = {{"attempts", std::int64_t{s.attempts}},
                 {"meshes", std::int64_t{s.meshes}},
                 {"elements", std::int64_t{s.elements}},
                 {"time_tolerance", s.time_tolerance},
                 {"steps", std::int64_t{n.steps}},
                 {"residuals", std::int64_t{n.residuals}},
                 {"jacobians", std::int64_t{n.jacobians}},
                 {"newton_iterations", std::int64_t{n.newton_iterations}},
                 {"error_test_failures", std::int64_t{n.error_failures}},
                 {"newton_failures", std::int64_t{n.newton_failures}}};
}

std::vector<std::string> series_names(const Case& c) {
    return begins_as_graph(c) ? graph_series_names(c) : curve_series_names(c);
}

void check_restart(const Record& record) {
    if (kind_of(record) == RecordKind::curve)
        curve_restart(record);
    else
        restart_state(record);
}

RunSummary run(const Case& c, RunObserver& observer, const Restart* restart) {
    const Record* from = restart ? &restart->record : nullptr;
    if (!begins_as_graph(c) || (from && kind_of(*from) == RecordKind::curve)) return run_curve(c, observer, from);
    RunSummary summary = run_graph(c, observer, from);
    if (summary.stop.reason != Stop::overhang || c.discretisation.parametrisation) return summary;
    observer.discard();
    return run_curve(c, observer);
}

}  // namespace tubule::axisym
