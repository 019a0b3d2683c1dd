#include "axisym/curve/curve_series.hpp"

#include <cmath>
#include <set>

namespace tubule::axisym {
namespace {

// Numbers n > 0 of the initial modes, each once.
std::vector<int> tracked_modes(const Problem& c) {
    std::set<int> waves;
    if (const Tube* tube = std::get_if<Tube>(&c.shape))
        for (const TubeMode& mode : tube->modes)
            if (mode.n > 0) waves.insert(mode.n);
    return {waves.begin(), waves.end()};
}

double lambda(const CurveRow& r) {
    const int at = r.motion.layout().lambda;
    return at < 0 ? 0 : r.y[at];
}

}  // namespace

SeriesTable<CurveRow> curve_series(const Problem& c) {
    const std::vector<int> modes = tracked_modes(c);
    std::vector<std::string> waves;
    for (const int n : modes) waves.push_back(std::to_string(n));
    SeriesTable<CurveRow> table;
    table.add({{"time", [](const CurveRow& r) { return r.time; }},
               {"step_size", [](const CurveRow& r) { return r.flow.step_size(); }},
               {"order", [](const CurveRow& r) { return static_cast<double>(r.flow.order()); }},
               {"newton_iterations", [](const CurveRow& r) { return static_cast<double>(r.newton_iterations); }},
               {"energy", [](const CurveRow& r) { return r.now.o.energy; }}});
    table.add_family("energy_<kl>", term_names(c.energy),
                     [](const CurveRow& r, std::size_t term) { return r.now.o.energy_term[term]; });
    if (c.energy.kg > 0) table.add({{"energy_kg", [](const CurveRow& r) { return r.now.o.energy_kg; }}});
    if (c.energy.alpha)
        table.add({{"energy_alpha", [](const CurveRow& r) { return r.now.o.energy_alpha; }},
                   {"M", [](const CurveRow& r) { return r.now.o.M; }}});
    const MotionLaw law = c.law;
    if (!c.energy.potentials.empty())
        table.add({{"potential_energy", [](const CurveRow& r) { return r.now.o.potential.energy; }}});
    table.add({{"free_energy", [](const CurveRow& r) { return r.now.free_energy; }}});
    if (law.loads_change() || law.supplies_kinetic_energy())
        table.add({{"work", [](const CurveRow& r) { return r.work; }}});
    table.add({{"dissipation", [](const CurveRow& r) { return r.now.balance.dissipation; }},
               {"identity_defect", [](const CurveRow& r) { return r.identity_defect; }},
               {"area", [](const CurveRow& r) { return r.now.o.area; }},
               {"volume", [](const CurveRow& r) { return r.now.o.volume; }},
               {"r_min", [](const CurveRow& r) { return std::isfinite(r.now.neck.radius) ? r.now.neck.radius : 0; }},
               {"r_max", [](const CurveRow& r) { return r.now.o.r_max; }}});
    table.add_family("mode_<n>", waves, [modes](const CurveRow& r, std::size_t wave) {
        return mode_amplitude(r.motion.space(), r.y, modes[wave]);
    });
    if (law.inextensible)
        table.add({{"kinetic_energy", [](const CurveRow& r) { return r.now.balance.kinetic; }},
                   {"speed", [](const CurveRow& r) { return r.now.balance.speed; }},
                   {"momentum_z", [](const CurveRow& r) { return r.now.balance.momentum_z; }},
                   {"angular_momentum_z", [](const CurveRow& r) { return r.now.balance.angular_z; }},
                   {"lambda", lambda}});
    table.add({{"tension", [](const CurveRow& r) { return r.now.balance.loads.tension; }},
               {"pressure", [](const CurveRow& r) { return r.now.balance.loads.pressure; }}});
    if (may_have_period(c.shape) || law.beads || has_two_rings(c.shape))
        table.add({{"force", [](const CurveRow& r) { return r.now.balance.loads.force; }}});
    if (!c.energy.potentials.empty())
        table.add({{"potential_force", [](const CurveRow& r) { return r.now.o.potential.force; }}});
    if (law.beads) table.add({{"bead_distance", [](const CurveRow& r) { return r.now.length; }}});
    if (law.free_period) table.add({{"height", [](const CurveRow& r) { return r.now.length; }}});
    table.add({{"energy_error", [](const CurveRow& r) { return r.energy_error; }},
               {"elements", [](const CurveRow& r) { return static_cast<double>(r.elements); }},
               {"wall_seconds", [](const CurveRow& r) { return r.wall_seconds; }}});
    return table;
}

}  // namespace tubule::axisym
