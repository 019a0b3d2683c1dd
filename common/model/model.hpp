// The models of motion: the table of those that a case can name, and the law of motion of each.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/formula/formula.hpp"
#include "common/model/ramp.hpp"
#include "common/model/sources.hpp"

namespace tubule {

enum class ModelKind { gradient_flow, overdamped, stokes, fluid, automatic };

// What holds the area: nothing; the area itself, by one number in gradient flow and locally in inextensible models; or
// a reservoir, which feeds an inextensible membrane uniformly.
enum class AreaRule { free, fixed, reservoir };

// How a patch is held where it ends in a ring: by its place, or by its place and its angle.
enum class Rim { clamped, hinged };

// Two beads at the poles of a closed surface, drawn apart along the axis, or one at the pole of a patch, drawn away
// from the plane of the ring: theory.md (2.23). The force of the loads draws them, or their distance is that of the
// initial shape and an extension.
struct Beads {
    double width = 0;  // of the weight that places a bead
    std::optional<Ramp> extension{};

    // Rate and kinks of the distance that is held; none where the force is given.
    double rate(double t) const { return extension ? extension->slope(t) : 0; }
    double next_kink(double t) const { return extension ? extension->next_kink(t) : HUGE_VAL; }
    bool change() const { return extension && !extension->is_constant(); }
};

// What a case says about its law of motion.
struct Model {
    ModelKind kind = ModelKind::gradient_flow;
    std::optional<ModelKind> chosen{};  // of "auto": the model that stands for it, once chosen
    double Re = 1;                      // of viscous models: 1/Re is the viscosity
    std::optional<double> gamma{};      // of inextensible models: friction; by default 0 of viscous ones, else 1
    std::optional<bool> keeps_volume;   // by default as the model has it
    std::optional<AreaRule> area{};     // by default free in gradient flow, else fixed
    bool free_period = false;           // of tubes
    // Given where area, volume and period are free: theory.md (3.16).
    Ramp tension{}, pressure{}, force{};
    std::shared_ptr<const Formula> pressure_of_volume{};  // instead of the ramp
    std::optional<double> bead_width{};                   // none: no beads
    std::optional<Ramp> extension{};                      // of their distance, where that is held
    Rim rim = Rim::clamped;                               // of patches
    Sources source{};

    bool has_pressure() const { return pressure_of_volume || !pressure.is_zero(); }
};

// One model. Names and allowed keys of case files, options and messages are derived from this table.
struct ModelEntry {
    ModelKind kind;
    const char* name;   // as in case files
    bool inextensible;  // locally, div u = 0; such models keep the volume unless the case frees it
    bool inertia;       // the velocity has an initial value
    bool viscous;       // takes Re; other models have no viscosity
};
inline constexpr std::array models{
    ModelEntry{ModelKind::gradient_flow, "gradient-flow", false, false, false},
    ModelEntry{ModelKind::overdamped, "overdamped", true, false, false},
    ModelEntry{ModelKind::stokes, "stokes", true, false, true},
    ModelEntry{ModelKind::fluid, "fluid", true, true, true},
    // A fluid, or a simpler model that does instead of it, which is chosen before anything runs.
    ModelEntry{ModelKind::automatic, "auto", true, true, true},
};

constexpr const ModelEntry& model_entry(ModelKind kind) {
    for (const ModelEntry& m : models)
        if (m.kind == kind) return m;
    throw std::logic_error("a model without an entry in the table");
}
inline std::string name(const Model& model) {
    return model_entry(model.kind).name;
}

// The names of all models with a property, for messages: "stokes" or "fluid", in quotes.
inline std::string quoted_names(bool ModelEntry::*has) {
    std::string text;
    for (const ModelEntry& m : models)
        if (m.*has) text += (text.empty() ? "\"" : " or \"") + std::string(m.name) + "\"";
    return text;
}

// Tension, pressure (inside minus outside) and axial force at one time; or their rates of change. The force works along
// the length: the period of a tube, or the distance of beads.
struct Loads {
    double tension = 0, pressure = 0, force = 0;
    std::shared_ptr<const Formula> of_volume{};  // the pressure, instead of the number

    double pressure_at(double volume) const;
    double pressure_slope(double volume) const;  // dP/dV
    // F - E of theory.md (3.16), (3.24); of rates of change, the rate at which they do work, (3.20). NaN where the
    // formula has no value somewhere from the volume 1 to this one.
    double energy(double area, double volume, double length) const;
    // The same with magnitudes, a part of E_ref: theory.md (11.1).
    double scale(double area, double volume, double length) const;
};

// The dimensionless law of motion of a membrane, theory.md (3.1), u its velocity and b the bending force:
//   inertia (d_t u + grad_w u) = 2 viscosity div D(u) - friction u - grad p - p H nu + b nu + pressure nu
// with lambda = -pressure where the volume is kept, and with sources a body force on the right. An extensible membrane moves along its normal alone, without p:
// friction u.nu = b + tension H + pressure. The multiplier of an area that is kept as a whole is a tension, too.
struct MotionLaw {
    double inertia = 0;        // 0 or 1
    double viscosity = 0;      // 1/Re
    double friction = 0;       // gamma
    bool inextensible = true;  // div u is the same everywhere, by the pressure p; 0 without a reservoir or a source
    bool keeps_volume = true;  // by the number lambda
    bool keeps_area = false;   // of extensible membranes: as a whole, by one number
    bool reservoir = false;    // of inextensible ones: feeds the membrane uniformly; the mean of p is -tension
    bool free_period = false;  // of tubes: the period follows the axial force
    // What falls is F = E + tension A - pressure V - force L: theory.md (3.16).
    Ramp tension{}, pressure{}, force{};
    std::shared_ptr<const Formula> pressure_of_volume{};  // instead of the ramp
    std::optional<Beads> beads{};
    Rim rim = Rim::clamped;  // of patches
    Sources source{};

    // The L2 gradient flow of F: nothing is kept.
    bool unconstrained() const { return !inextensible && !keeps_volume && !keeps_area; }
    bool area_is_free() const { return inextensible ? reservoir : !keeps_area; }
    // The area is neither free nor what a source makes of it.
    bool conserves_area() const { return !area_is_free() && !source.mass; }
    // Whether F is E alone at all times, and nothing acts at places; whether work is done on the membrane in time.
    bool without_loads() const {
        return tension.is_zero() && pressure.is_zero() && force.is_zero() && !pressure_of_volume && !beads && !source.act();
    }
    bool supplies_kinetic_energy() const { return reservoir && inertia != 0; }
    bool loads_change() const {
        return source.act() || !tension.is_constant() || !pressure.is_constant() || !force.is_constant() || (beads && beads->change());
    }
};

inline Loads loads_at(const MotionLaw& law, double t) {
    return {law.tension.at(t), law.pressure.at(t), law.force.at(t), law.pressure_of_volume};
}
// Rates of change; at a kink those after it.
inline Loads load_rates(const MotionLaw& law, double t) {
    return {law.tension.slope(t), law.pressure.slope(t), law.force.slope(t)};
}
inline double next_kink(const MotionLaw& law, double t) {
    return std::min({law.tension.next_kink(t), law.pressure.next_kink(t), law.force.next_kink(t),
                     law.beads ? law.beads->next_kink(t) : HUGE_VAL});
}
// The scale of F - E over all times, a part of E_ref: theory.md (11.1).
inline double load_scale(const MotionLaw& law, double area, double volume, double length) {
    const Loads largest{law.tension.largest(), law.pressure.largest(), law.force.largest(), law.pressure_of_volume};
    return largest.scale(area, volume, length);
}

// How far the formula of the pressure, if there is one, is from volumes where it is not defined.
FormulaDomain::Margin pressure_domain(const MotionLaw& law, double volume);

inline AreaRule area_rule(const Model& model) {
    return model.area.value_or(model_entry(model.kind).inextensible ? AreaRule::fixed : AreaRule::free);
}

// The friction of a model that is given none. That of a gradient flow is always 1.
constexpr double default_friction(const ModelEntry& model) {
    return model.viscous ? 0 : 1;
}

inline MotionLaw motion_law(const Model& model) {
    const ModelEntry& has = model_entry(model.kind);
    const AreaRule area = area_rule(model);
    std::optional<Beads> beads;
    if (model.bead_width) beads = Beads{*model.bead_width, model.extension};
    return {.inertia = has.inertia ? 1.0 : 0.0,
            .viscosity = has.viscous ? 1 / model.Re : 0,
            .friction = has.inextensible ? model.gamma.value_or(default_friction(has)) : 1,
            .inextensible = has.inextensible,
            .keeps_volume = model.keeps_volume.value_or(has.inextensible),
            .keeps_area = !has.inextensible && area == AreaRule::fixed,
            .reservoir = area == AreaRule::reservoir,
            .free_period = model.free_period,
            .tension = model.tension,
            .pressure = model.pressure,
            .force = model.force,
            .pressure_of_volume = model.pressure_of_volume,
            .beads = std::move(beads),
            .rim = model.rim,
            .source = model.source};
}

}  // namespace tubule
