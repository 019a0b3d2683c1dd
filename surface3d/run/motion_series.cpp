#include "surface3d/run/motion_series.hpp"

namespace tubule::surface3d {
namespace {

struct Series {
    const char* name;
    double (*value)(const MotionRow&);
};

constexpr Series before_terms[] = {
    {"time", [](const MotionRow& r) { return r.state.time; }},
    {"step_size", [](const MotionRow& r) { return r.state.step; }},
    {"energy", [](const MotionRow& r) { return r.measures.bending.energy; }},
};
constexpr Series after_terms[] = {
    {"dissipation", [](const MotionRow& r) { return r.measures.dissipation; }},
    {"identity_defect", [](const MotionRow& r) { return r.identity_defect; }},
    {"area", [](const MotionRow& r) { return r.measures.bending.area; }},
    {"volume", [](const MotionRow& r) { return r.measures.bending.volume; }},
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
    {"stretching", [](const MotionRow& r) { return r.measures.stretching; }},
    {"correction_energy", [](const MotionRow& r) { return r.correction_energy; }},
    {"integral_H2", [](const MotionRow& r) { return r.measures.bending.integral_H2; }},
    {"integral_K", [](const MotionRow& r) { return r.measures.bending.integral_K; }},
    {"quality", [](const MotionRow& r) { return r.measures.quality.worst; }},
    {"turn", [](const MotionRow& r) { return r.measures.turn.angle; }},
    {"energy_error", [](const MotionRow& r) { return r.energy_error; }},
    {"elements", [](const MotionRow& r) { return static_cast<double>(r.elements); }},
    {"wall_seconds", [](const MotionRow& r) { return r.wall_seconds; }},
};

}  // namespace

std::vector<double> motion_values(const MotionRow& row) {
    std::vector<double> out;
    for (const Series& s : before_terms) out.push_back(s.value(row));
    const auto& terms = row.measures.bending.energy_term;
    out.insert(out.end(), terms.begin(), terms.end());
    for (const Series& s : after_terms) out.push_back(s.value(row));
    return out;
}

std::vector<std::string> motion_names() {
    std::vector<std::string> out;
    for (const Series& s : before_terms) out.push_back(s.name);
    for_each_bending_term([&](std::size_t, const auto& term) { out.push_back(std::string("energy_") + term.name); });
    for (const Series& s : after_terms) out.push_back(s.name);
    return out;
}

}  // namespace tubule::surface3d
