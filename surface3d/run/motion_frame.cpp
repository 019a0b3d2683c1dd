#include "surface3d/run/motion_frame.hpp"

#include "common/result/record.hpp"
#include "surface3d/motion/schemes/time_scheme.hpp"

namespace tubule::surface3d {

namespace {

// What a run needs to resume, by name.
template <class Fields, class State>
void state_fields(Fields&& f, State& s) {
    const auto nodes = s.X.cols();
    f.number("restart_step", s.step), f.number("restart_lambda", s.lambda);
    f.number("restart_tension", s.tension), f.number("restart_period", s.period);
    f.number("restart_stretch", s.stretch), f.optional_number("restart_force", s.force);
    f.array("restart_w", s.w, nodes), f.array("restart_u", s.u), f.optional_array("restart_p", s.p);
}
template <class Fields, class Memory>
void memory_fields(Fields&& f, Memory& m) {
    f.number("restart_next_step", m.next_step), f.number("restart_relaxation", m.scale.relaxation);
    f.number("restart_last_order", m.order);
    f.number("restart_elements", m.settings.elements), f.number("restart_tolerance", m.settings.tolerance);
    f.number("restart_difference", m.settings.difference), f.number("restart_pair", m.settings.pair);
    f.number("restart_role", m.settings.role), f.number("restart_coarser_by", m.settings.coarser_by);
    f.number("restart_area", m.scale.area), f.number("restart_volume", m.scale.volume);
    f.number("restart_least_variation", m.scale.least_variation),
        f.number("restart_lowest_total", m.balance.lowest_total);
    f.number("restart_total_start", m.balance.total_start), f.number("restart_dissipated", m.balance.dissipated);
    f.number("restart_work", m.balance.work), f.number("restart_supplied", m.balance.supplied),
        f.number("restart_area_past", m.balance.past.area);
    f.number("restart_volume_past", m.balance.past.volume), f.number("restart_length_past", m.balance.past.length);
    f.optional_number("restart_force_past", m.balance.force_past);
    f.optional_number("restart_source_past", m.balance.source_past);
    f.optional_number("restart_bead_distance", m.scale.bead_distance);
    f.number("restart_corrected", m.balance.corrected), f.number("restart_error", m.error);
    f.number("restart_reference_energy", m.scale.reference_energy), f.number("restart_defect", m.balance.imbalance);
    f.number("restart_dissipation_past", m.balance.dissipation_past), f.number("restart_moved", m.moved);
    f.number("restart_steps", m.count.steps), f.number("restart_rejected", m.count.rejected);
    f.number("restart_mesh_since", m.count.mesh_since), f.number("restart_meshes", m.count.meshes);
    f.number("restart_coarser", m.count.thinned);  // meshes of fewer triangles, on the way
    f.number("restart_grid", m.initial_mesh_of);
    f.number("restart_rough", m.count.rough), f.number("restart_linear_solves", m.linear_work.solves);
    f.number("restart_gmres_iterations", m.linear_work.iterations), f.number("restart_lu_solves", m.linear_work.lu);
}

void add_state(Record& out, const MotionState& s, const MotionMemory& memory) {
    RecordWriter writer(out);
    state_fields(writer, s);
    if (s.memory) s.memory->save(writer, s);
    memory_fields(writer, memory);
    if (memory.H0.size() > 0) writer.array("H0", memory.H0);
}

}  // namespace

Record state_record(const MotionState& s, const MotionMemory& memory) {
    Record out;
    out.time = s.time, out.kind = RecordKind::surface;
    out.arrays = {array("points", s.X)};
    add_state(out, s, memory);
    return out;
}

Record motion_record(const MovingSurface& surface, const MotionState& s, const MotionMeasures& m,
                     const MotionMemory& memory, std::size_t mesh_number) {
    const Bending& bending = surface.bending();
    Record out;
    out.time = s.time, out.mesh = mesh_number, out.kind = RecordKind::surface;
    out.numbers = {{"energy", m.bending.energy}};
    Eigen::VectorXd energy_density(s.X.cols());
    for (int i = 0; i < energy_density.size(); ++i)
        energy_density[i] = density_at(bending, m.fields.H0_at(bending, i), m.fields.H[i], m.fields.K[i]).f;
    const Eigen::VectorXd u_n = m.velocity.cwiseProduct(m.fields.normal).colwise().sum().transpose();
    out.arrays = {array("points", s.X), array("normal", m.fields.normal), array("u", m.velocity), array("u_n", u_n)};
    if (s.p.size() > 0) out.arrays.push_back(array("p", surface.pressure_at_nodes(s)));
    for (const Array& more : {array("H", m.fields.H), array("K", m.fields.K), array("energy_density", energy_density)})
        out.arrays.push_back(more);
    add_state(out, s, memory);
    return out;
}

MotionRestart motion_restart(const Record& record, Scheme scheme) {
    MotionRestart out;
    const RecordReader reader(record, RecordKind::surface);
    out.state.time = record.time;
    reader.array("points", out.state.X);
    state_fields(reader, out.state);
    if (out.state.step > 0) out.state.memory = restored_memory(scheme, reader, out.state);
    memory_fields(reader, out.memory);
    if (find_array(record, "H0")) reader.array("H0", out.memory.H0, out.state.X.cols());
    return out;
}

SeriesTable<MotionRow> motion_series(const Problem& c) {
    const Bending& energy = c.energy;
    SeriesTable<MotionRow> table;
    table.add({
        {"time", [](const MotionRow& r) { return r.state.time; }},
        {"step_size", [](const MotionRow& r) { return r.state.step; }},
    });
    add_energies(table, energy, [](const MotionRow& r) -> const Observables& { return r.measures.bending; });
    if (!energy.potentials.empty())
        table.add({{"potential_energy", [](const MotionRow& r) { return r.measures.bending.potential; }}});
    table.add({
        {"free_energy", [](const MotionRow& r) { return r.measures.free_energy; }},
        {"work", [](const MotionRow& r) { return r.work; }},
        {"dissipation", [](const MotionRow& r) { return r.measures.dissipation; }},
        {"identity_defect", [](const MotionRow& r) { return r.imbalance; }},
        {"area", [](const MotionRow& r) { return r.measures.bending.area; }},
        {"volume", [](const MotionRow& r) { return r.measures.bending.volume; }},
        {"height", [](const MotionRow& r) { return r.measures.height; }},
        {"volume_drift", [](const MotionRow& r) { return r.volume_drift; }},
        {"r_min", [](const MotionRow& r) { return r.measures.r_min; }},
        {"r_max", [](const MotionRow& r) { return r.measures.r_max; }},
        {"kinetic_energy", [](const MotionRow& r) { return r.measures.kinetic; }},
        {"speed", [](const MotionRow& r) { return r.measures.speed; }},
        {"momentum_x", [](const MotionRow& r) { return r.measures.momentum.x(); }},
        {"momentum_y", [](const MotionRow& r) { return r.measures.momentum.y(); }},
        {"momentum_z", [](const MotionRow& r) { return r.measures.momentum.z(); }},
        {"angular_momentum_x", [](const MotionRow& r) { return r.measures.angular_momentum.x(); }},
        {"angular_momentum_y", [](const MotionRow& r) { return r.measures.angular_momentum.y(); }},
        {"angular_momentum_z", [](const MotionRow& r) { return r.measures.angular_momentum.z(); }},
        {"lambda", [](const MotionRow& r) { return r.state.lambda; }},
        {"tension", [](const MotionRow& r) { return r.measures.tension; }},
        {"pressure", [](const MotionRow& r) { return r.measures.pressure; }},
        {"force", [](const MotionRow& r) { return r.measures.force; }},
    });
    if (!energy.potentials.empty())
        table.add({{"potential_force", [](const MotionRow& r) { return r.measures.bending.potential_force; }}});
    if (c.law.beads) table.add({{"bead_distance", [](const MotionRow& r) { return r.measures.length; }}});
    table.add({
        {"stretching", [](const MotionRow& r) { return r.measures.stretching; }},
        {"correction_energy", [](const MotionRow& r) { return r.correction_energy; }},
        {"integral_H2", [](const MotionRow& r) { return r.measures.bending.integral_H2; }},
        {"integral_K", [](const MotionRow& r) { return r.measures.bending.integral_K; }},
        {"quality", [](const MotionRow& r) { return r.measures.quality.worst; }},
        {"turn", [](const MotionRow& r) { return r.measures.turn.angle; }},
        {"energy_error", [](const MotionRow& r) { return r.energy_error; }},
        {"elements", [](const MotionRow& r) { return static_cast<double>(r.elements); }},
        {"wall_seconds", [](const MotionRow& r) { return r.wall_seconds; }},
    });
    return table;
}

}  // namespace tubule::surface3d
