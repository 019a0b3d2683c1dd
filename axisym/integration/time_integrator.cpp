#include "axisym/integration/time_integrator.hpp"

#include <fmt/format.h>

#include "common/run/run_observer.hpp"

namespace tubule::axisym {

IntegratorCounters& IntegratorCounters::operator+=(const IntegratorCounters& o) {
    steps += o.steps, residuals += o.residuals, jacobians += o.jacobians;
    newton_iterations += o.newton_iterations, error_failures += o.error_failures;
    newton_failures += o.newton_failures;
    return *this;
}

void IntegratorCounters::describe(RunSummary& s, double time_tolerance, const char* integrator, int meshes) const {
    s.effort = fmt::format("{} steps, {} elements", steps, s.elements);
    s.details = {{"integrator", integrator},
                 {"attempts", std::int64_t{s.attempts}},
                 {"meshes", std::int64_t{meshes}},
                 {"elements", std::int64_t{s.elements}},
                 {"time_tolerance", time_tolerance},
                 {"steps", std::int64_t{steps}},
                 {"residuals", std::int64_t{residuals}},
                 {"jacobians", std::int64_t{jacobians}},
                 {"newton_iterations", std::int64_t{newton_iterations}},
                 {"error_test_failures", std::int64_t{error_failures}},
                 {"newton_failures", std::int64_t{newton_failures}}};
}

}  // namespace tubule::axisym
