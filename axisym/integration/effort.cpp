#include "axisym/integration/effort.hpp"

#include <fmt/format.h>

namespace tubule::axisym {

void describe(const Effort& effort, RunSummary& s) {
    const IntegratorCounters& n = effort.counters;
    s.effort = fmt::format("{} steps, {} elements", n.steps, s.elements);
    s.details = {{"integrator", effort.integrator},
                 {"attempts", std::int64_t{s.attempts}},
                 {"meshes", std::int64_t{effort.meshes}},
                 {"elements", std::int64_t{s.elements}},
                 {"time_tolerance", effort.time_tolerance},
                 {"steps", std::int64_t{n.steps}},
                 {"residuals", std::int64_t{n.residuals}},
                 {"jacobians", std::int64_t{n.jacobians}},
                 {"newton_iterations", std::int64_t{n.newton_iterations}},
                 {"error_test_failures", std::int64_t{n.error_failures}},
                 {"newton_failures", std::int64_t{n.newton_failures}}};
}

}  // namespace tubule::axisym
