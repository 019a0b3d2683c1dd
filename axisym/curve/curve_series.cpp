#include "axisym/curve/curve_series.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "axisym/curve/curve_setup.hpp"

namespace tubule::axisym {
namespace {

std::set<int> tracked_modes(const Case& c) {
    std::set<int> waves;
    if (const Tube* tube = std::get_if<Tube>(&c.shape))
        for (const TubeMode& mode : tube->modes)
            if (mode.n > 0) waves.insert(mode.n);
    return waves;
}

}  // namespace

std::vector<std::string> curve_series_names(const Case& c) {
    std::vector<std::string> names{"time", "step_size", "order", "newton_iterations", "energy"};
    for_each_bending_term([&](std::size_t, const auto& term) { names.push_back(std::string("energy_") + term.name); });
    for (const char* name : {"dissipation", "identity_defect", "area", "volume", "r_min", "r_max"})
        names.push_back(name);
    for (const int n : tracked_modes(c)) names.push_back(fmt::format("mode_{}", n));
    if (motion_law(c.model).inextensible)
        for (const char* name : {"kinetic_energy", "speed", "momentum_z", "angular_momentum_z", "lambda"})
            names.push_back(name);
    for (const char* name : {"energy_error", "elements", "wall_seconds"}) names.push_back(name);
    return names;
}

std::vector<double> curve_values(const Case& c, const CurveMotion& motion, const CurveRow& row) {
    const CurveObservation& o = row.now.o;
    const CurveMotion::Balance& balance = row.now.balance;
    std::vector<double> out{row.time, row.flow.step_size(), static_cast<double>(row.flow.order()),
                            static_cast<double>(row.flow.counters().newton_iterations), o.energy};
    out.insert(out.end(), o.energy_term.begin(), o.energy_term.end());
    const double neck = std::isfinite(row.now.neck.radius) ? row.now.neck.radius : 0;
    out.insert(out.end(), {balance.dissipation, row.identity_defect, o.area, o.volume, neck, o.r_max});
    for (const int n : tracked_modes(c)) out.push_back(mode_amplitude(motion.space(), row.y, n));
    const int lambda = motion.layout().lambda;
    if (motion.law().inextensible)
        out.insert(out.end(), {balance.kinetic, balance.speed, balance.momentum_z, balance.angular_z,
                               lambda < 0 ? 0 : row.y[lambda]});
    out.insert(out.end(), {row.energy_error, static_cast<double>(row.elements), row.wall_seconds});
    return out;
}

}  // namespace tubule::axisym
