#include "axisym/graph/graph_series.hpp"

#include <fmt/format.h>

#include <cmath>

namespace tubule::axisym {

std::vector<std::string> graph_series_names(const Case& c) {
    std::vector<std::string> names{"time", "step_size", "order", "newton_iterations", "energy"};
    for_each_bending_term([&](std::size_t, const auto& term) { names.push_back(std::string("energy_") + term.name); });
    for (const char* n : {"dissipation", "identity_defect", "area", "volume", "r_min", "r_max"}) names.push_back(n);
    for (int n : tracked_graph_modes(c)) names.push_back(fmt::format("mode_{}", n));
    for (const char* n : {"energy_error", "elements", "wall_seconds"}) names.push_back(n);
    return names;
}

std::vector<double> graph_values(const GraphStage& stage, const GraphRow& row) {
    const Observation& o = row.o;
    std::vector<double> out{row.time, row.flow.step_size(), static_cast<double>(row.flow.order()),
                            static_cast<double>(row.newton_iterations), o.energy};
    out.insert(out.end(), o.energy_term.begin(), o.energy_term.end());
    out.insert(out.end(), {o.dissipation, row.identity_defect, o.area, o.volume, o.r_min, o.r_max});
    const Eigen::Map<const Eigen::VectorXd> c(row.x, stage.space.size());
    for (const auto& f : stage.modes) out.push_back(std::hypot(f[0].dot(c), f[1].dot(c)));
    out.insert(out.end(), {row.energy_error, static_cast<double>(row.elements), row.wall_seconds});
    return out;
}

}  // namespace tubule::axisym
