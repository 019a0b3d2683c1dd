#include "axisym/graph/graph_output.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "common/result/record.hpp"

namespace tubule::axisym {

SeriesTable<GraphRow> graph_series(const Problem& c) {
    std::vector<std::string> waves;
    for (const int n : tracked_graph_modes(c)) waves.push_back(std::to_string(n));
    SeriesTable<GraphRow> table;
    table.add({{"time", [](const GraphRow& r) { return r.time; }},
               {"step_size", [](const GraphRow& r) { return r.integrator.step_size(); }},
               {"order", [](const GraphRow& r) { return static_cast<double>(r.integrator.order()); }},
               {"newton_iterations", [](const GraphRow& r) { return static_cast<double>(r.newton_iterations); }}});
    add_energies(table, c.energy, [](const GraphRow& r) -> const Observation& { return r.o; });
    table.add({{"free_energy", [](const GraphRow& r) { return r.o.free_energy; }},
               {"dissipation", [](const GraphRow& r) { return r.o.dissipation; }},
               {"identity_defect", [](const GraphRow& r) { return r.imbalance; }},
               {"area", [](const GraphRow& r) { return r.o.area; }},
               {"volume", [](const GraphRow& r) { return r.o.volume; }},
               {"r_min", [](const GraphRow& r) { return r.o.r_min; }},
               {"r_max", [](const GraphRow& r) { return r.o.r_max; }}});
    table.add_family("mode_<n>", waves, [](const GraphRow& r, std::size_t wave) {
        const Eigen::Map<const Eigen::VectorXd> x(r.x, r.mesh.space.size());
        const auto& f = r.mesh.modes[wave];
        return std::hypot(f[0].dot(x), f[1].dot(x));
    });
    table.add({{"tension", [](const GraphRow& r) { return r.mesh.forms.loads().tension; }},
               {"pressure", [](const GraphRow& r) { return r.mesh.forms.loads().pressure; }},
               {"force",
                [](const GraphRow& r) {
                    return r.mesh.forms.axial_force(Eigen::Map<const Eigen::VectorXd>(r.x, r.mesh.space.size()));
                }},
               {"energy_error", [](const GraphRow& r) { return r.energy_error; }},
               {"elements", [](const GraphRow& r) { return static_cast<double>(r.elements); }},
               {"wall_seconds", [](const GraphRow& r) { return r.wall_seconds; }}});
    return table;
}

namespace {

// Points of the period at which a profile is sampled: every element, divided evenly.
std::vector<double> sample_points(const std::vector<double>& knots, double length) {
    std::vector<double> ends{0};
    for (double knot : knots)
        if (knot > ends.back() + 1e-12 * length && knot < length * (1 - 1e-12)) ends.push_back(knot);
    ends.push_back(length);
    const int parts = std::clamp(static_cast<int>(256 / ends.size()), 4, 16);
    std::vector<double> points;
    for (std::size_t i = 0; i + 1 < ends.size(); ++i)
        for (int j = 0; j < parts; ++j) points.push_back(ends[i] + (ends[i + 1] - ends[i]) * j / parts);
    points.push_back(length);
    return points;
}

// What a run needs to resume, by name.
template <class Fields, class State>
void restart_fields(Fields&& f, State& s) {
    f.number("restart_z0", s.cell.z0), f.number("restart_z1", s.cell.z1);
    f.number("restart_mirror", s.cell.mirror), f.number("restart_copies", s.cell.copies);
    f.number("restart_reference_energy", s.reference_energy);
    f.number("restart_energy_start", s.energy_start), f.number("restart_dissipated", s.dissipated);
    f.number("restart_error_max", s.error_max), f.number("restart_time_tolerance", s.time_tolerance);
    f.number("restart_defect", s.mesh_loss), f.number("restart_least_symbol", s.least_symbol);
    f.number("restart_rosenbrock", s.rosenbrock), f.number("restart_attempts", s.attempts);
    f.array("restart_breaks", s.breaks), f.array("restart_coefficients", s.coefficients);
    f.array("restart_error_total", s.error_total), f.array("restart_error_spatial", s.error_spatial);
}

}  // namespace

Record graph_record(double time, const SplineSpace& space, const GraphRestart& s, const Eigen::VectorXd& rate,
                    double energy) {
    const Cell& cell = space.cell();
    const auto spline = space.unfold(s.coefficients, 0);
    std::vector<double> z = sample_points(spline.knots, cell.period()), r, H, K, u_n;
    for (double point : z) {
        const double turn = cell.length() * (cell.mirror ? 2 : 1);
        double inside = point - cell.z0 - std::floor((point - cell.z0) / turn) * turn;
        if (inside > cell.length()) inside = 2 * cell.length() - inside;
        inside = std::clamp(cell.z0 + inside, cell.z0, cell.z1);
        const int e = space.element_at(inside);
        const auto [value, slope, second] = space.evaluate(s.coefficients.data(), e, inside);
        const auto p = graph_point(value, slope, second);
        r.push_back(value);
        H.push_back(p.H);
        K.push_back(p.K);
        u_n.push_back(space.evaluate(rate.data(), e, inside)[0] * p.inverse_speed);
    }
    Record out;
    out.time = time, out.kind = RecordKind::graph;
    out.numbers = {{"degree", space.degree()}, {"length", cell.period()}, {"energy", energy}};
    out.arrays = {array("knots", spline.knots),
                  array("coefficients", spline.coefficients),
                  array("z", z),
                  array("r", r),
                  array("H", H),
                  array("K", K),
                  array("u_n", u_n)};
    restart_fields(RecordWriter(out), s);
    return out;
}

GraphRestart graph_restart(const Record& record) {
    GraphRestart s;
    restart_fields(RecordReader(record, RecordKind::graph), s);
    return s;
}

}  // namespace tubule::axisym
