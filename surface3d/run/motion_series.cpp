#include "surface3d/run/motion_series.hpp"

namespace tubule::surface3d {

SeriesTable<MotionRow> motion_series(const Bending& energy) {
    SeriesTable<MotionRow> table;
    table.add({
        {"time", [](const MotionRow& r) { return r.state.time; }},
        {"step_size", [](const MotionRow& r) { return r.state.step; }},
        {"energy", [](const MotionRow& r) { return r.measures.bending.energy; }},
    });
    table.add_family("energy_<kl>", term_names(energy),
                     [](const MotionRow& r, std::size_t term) { return r.measures.bending.energy_term[term]; });
    table.add({
        {"free_energy", [](const MotionRow& r) { return r.measures.free_energy; }},
        {"work", [](const MotionRow& r) { return r.work; }},
        {"dissipation", [](const MotionRow& r) { return r.measures.dissipation; }},
        {"identity_defect", [](const MotionRow& r) { return r.identity_defect; }},
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
