#include "axisym/curve/curve_output.hpp"

#include <cmath>
#include <set>

#include "axisym/curve/curve_samples.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/result/frame_profile.hpp"

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

// What a run needs to resume, by name.
template <class Fields, class State>
void restart_fields(Fields&& f, State& s) {
    f.array("restart_breaks", s.breaks);
    f.array("restart_y", s.y), f.array("restart_rate", s.rate, s.y.size());
    f.number("restart_elements", s.settings.elements), f.number("restart_tolerance", s.settings.tolerance);
    f.number("restart_pair", s.settings.pair), f.number("restart_role", s.settings.is_coarser);
    f.number("restart_total_start", s.total_start), f.number("restart_dissipated", s.dissipated);
    f.number("restart_error", s.error), f.number("restart_reference_energy", s.reference_energy);
    f.number("restart_least_symbol", s.least_symbol), f.number("restart_work", s.work);
    f.array("restart_density", s.settings.density), f.number("restart_excess", s.settings.excess);
    f.number("restart_lost", s.mesh_need.lost), f.array("restart_wanted", s.mesh_need.wanted);
    EnergyTrace::fields(f, s.trace, "restart_trace");
}

// One point of the profile, with curvatures and flow.
struct Sample {
    double r, z, H, K, u_n, u_t, u_theta, p;
};

Sample sample(const CurveMotion& motion, const CurveRestart& state, double s) {
    const CurveSpace& space = motion.space();
    const MotionLayout& at = motion.layout();
    const CurveSample c = space.evaluate(state.y.head(space.size()), s);
    if (const double beside = beside_pole(space, s); beside != s) {
        Sample pole = sample(motion, state, beside);
        pole.r = 0, pole.z = c.z, pole.u_t = 0, pole.u_theta = 0;
        return pole;
    }
    const auto p = profile_point(c.r, c.r1, c.r2, c.z1, c.z2);
    const double t_r = c.r1 * p.inverse_speed, t_z = c.z1 * p.inverse_speed;
    const bool flows = motion.law().inextensible;
    const double* v = flows ? state.y.data() : state.rate.data();
    const double u = space.r().evaluate(v + (flows ? at.u_r : at.r), s)[0];
    double w = space.z().evaluate(v + (flows ? at.u_z : at.z), s)[0];
    if (!flows && at.stretch >= 0) w -= state.y[at.stretch] * space.z().evaluate(state.y.data() + at.z, s)[0];
    Sample out{c.r, c.z, p.H, p.K, u * t_z - w * t_r, u * t_r + w * t_z, 0, 0};
    if (at.swirl >= 0) out.u_theta = space.r().evaluate(state.y.data() + at.swirl, s)[0];
    if (at.p >= 0) out.p = motion.pressures().evaluate(state.y.data() + at.p, s)[0];
    return out;
}

}  // namespace

SeriesTable<CurveRow> curve_series(const Problem& c) {
    const std::vector<int> modes = tracked_modes(c);
    std::vector<std::string> waves;
    for (const int n : modes) waves.push_back(std::to_string(n));
    SeriesTable<CurveRow> table;
    table.add({{"time", [](const CurveRow& r) { return r.time; }},
               {"step_size", [](const CurveRow& r) { return r.integrator.step_size(); }},
               {"order", [](const CurveRow& r) { return static_cast<double>(r.integrator.order()); }},
               {"newton_iterations", [](const CurveRow& r) { return static_cast<double>(r.newton_iterations); }}});
    add_energies(
        table, c.energy, [](const CurveRow& r) -> const auto& { return r.now.o; });
    const MotionLaw law = c.law;
    if (!c.energy.potentials.empty())
        table.add({{"potential_energy", [](const CurveRow& r) { return r.now.o.potential.energy; }}});
    table.add({{"free_energy", [](const CurveRow& r) { return r.now.free_energy; }}});
    if (law.loads_change() || law.supplies_kinetic_energy())
        table.add({{"work", [](const CurveRow& r) { return r.work; }}});
    table.add({{"dissipation", [](const CurveRow& r) { return r.now.balance.dissipation; }},
               {"identity_defect", [](const CurveRow& r) { return r.imbalance; }},
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

Record curve_record(double time, const CurveMotion& motion, const CurveRestart& state, double energy) {
    const CurveSpace& space = motion.space();
    std::vector<double> parameters;
    const auto sample_at = [&](double s) {
        parameters.push_back(s);
        return sample(motion, state, s);
    };
    const std::vector<Sample> samples = sample_profile(space, sample_at, [](Sample& image) { image.u_t = -image.u_t; });

    Record out;
    out.time = time, out.kind = RecordKind::curve;
    out.numbers = {{"energy", energy}, {"length", space.length(state.y.data())}};
    add_columns(out, samples,
                {{"r", &Sample::r}, {"z", &Sample::z}, {"H", &Sample::H}, {"K", &Sample::K}, {"u_n", &Sample::u_n}});
    if (motion.law().inextensible) add_columns(out, samples, {{"u_t", &Sample::u_t}, {"p", &Sample::p}});
    if (motion.law().swirls) add_columns(out, samples, {{"u_theta", &Sample::u_theta}});
    if (motion.forms().bending().H0_varies())  // of a whole cell or period
        out.arrays.push_back(array("H0", motion.forms().H0_at(state.y.head(space.size()), parameters)));
    restart_fields(RecordWriter(out), state);
    return out;
}

Record state_record(double time, const CurveRestart& state) {
    Record out;
    out.time = time, out.kind = RecordKind::curve;
    restart_fields(RecordWriter(out), state);
    return out;
}

CurveRestart curve_restart(const Record& record) {
    CurveRestart s;
    restart_fields(RecordReader(record, RecordKind::curve), s);
    s.trace.cut_after(record.time);
    return s;
}

}  // namespace tubule::axisym
