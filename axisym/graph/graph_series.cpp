#include "axisym/graph/graph_series.hpp"

#include <cmath>

namespace tubule::axisym {

SeriesTable<GraphRow> graph_series(const Problem& c) {
    std::vector<std::string> waves;
    for (const int n : tracked_graph_modes(c)) waves.push_back(std::to_string(n));
    SeriesTable<GraphRow> table;
    table.add({{"time", [](const GraphRow& r) { return r.time; }},
               {"step_size", [](const GraphRow& r) { return r.flow.step_size(); }},
               {"order", [](const GraphRow& r) { return static_cast<double>(r.flow.order()); }},
               {"newton_iterations", [](const GraphRow& r) { return static_cast<double>(r.newton_iterations); }},
               {"energy", [](const GraphRow& r) { return r.o.energy; }}});
    table.add_family("energy_<kl>", term_names(c.energy),
                     [](const GraphRow& r, std::size_t term) { return r.o.energy_term[term]; });
    table.add({{"free_energy", [](const GraphRow& r) { return r.o.free_energy; }},
               {"dissipation", [](const GraphRow& r) { return r.o.dissipation; }},
               {"identity_defect", [](const GraphRow& r) { return r.identity_defect; }},
               {"area", [](const GraphRow& r) { return r.o.area; }},
               {"volume", [](const GraphRow& r) { return r.o.volume; }},
               {"r_min", [](const GraphRow& r) { return r.o.r_min; }},
               {"r_max", [](const GraphRow& r) { return r.o.r_max; }}});
    table.add_family("mode_<n>", waves, [](const GraphRow& r, std::size_t wave) {
        const Eigen::Map<const Eigen::VectorXd> x(r.x, r.stage.space.size());
        const auto& f = r.stage.modes[wave];
        return std::hypot(f[0].dot(x), f[1].dot(x));
    });
    table.add({{"tension", [](const GraphRow& r) { return r.stage.forms.loads().tension; }},
               {"pressure", [](const GraphRow& r) { return r.stage.forms.loads().pressure; }},
               {"force",
                [](const GraphRow& r) {
                    return r.stage.forms.axial_force(Eigen::Map<const Eigen::VectorXd>(r.x, r.stage.space.size()));
                }},
               {"energy_error", [](const GraphRow& r) { return r.energy_error; }},
               {"elements", [](const GraphRow& r) { return static_cast<double>(r.elements); }},
               {"wall_seconds", [](const GraphRow& r) { return r.wall_seconds; }}});
    return table;
}

}  // namespace tubule::axisym
