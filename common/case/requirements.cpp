#include "common/case/requirements.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tubule {
namespace needs {
namespace {

using P = const Problem&;
using Test = std::function<bool(const Problem&)>;

SchemeEntry scheme_of(P p) {
    return p.surface.scheme ? entry(*p.surface.scheme) : SchemeEntry{};
}
Property kind_with(bool ModelEntry::*has) {
    return {"model.kind = " + quoted_names(has), [has](P p) { return model_entry(p.model.kind).*has; }};
}

// Tiers and what they compute.
const Property axisym{"tier = \"axisym\"", [](P p) { return p.tier == Tier::axisym; }},
    automatic_tier{"tier = \"auto\"", [](P p) { return p.tier == Tier::automatic; }},
    surface{"tier = \"surface3d\"", [](P p) { return p.tier == Tier::surface3d; }},
    named_tier{"tier = \"axisym\" or \"surface3d\"", [](P p) { return p.tier != Tier::automatic; }},
    time{"a table [time]", [](P p) { return p.tier != Tier::surface3d || p.moves() || p.equilibrium; }},
    single_surface{"a single surface, without [time]", [](P p) { return !p.moves(); }},
    motion{"a motion, without [equilibrium]", [](P p) { return !p.equilibrium; }},
    moving_surface{"a surface in motion", [](P p) { return p.tier != Tier::axisym && p.moves(); }};

// Models, and what is fixed.
const Property inertia = kind_with(&ModelEntry::inertia), viscous = kind_with(&ModelEntry::viscous),
               inextensible = kind_with(&ModelEntry::inextensible),
               extensible{"model.kind = \"gradient-flow\"", [](P p) { return !p.law.inextensible; }},
               named_model{"a model that is named", [](P p) { return p.model.kind != ModelKind::automatic; }},
               automatic{"model.kind = \"auto\"", [](P p) { return p.model.kind == ModelKind::automatic; }};
const Property chosen_inertia{"model.chosen = \"fluid\"",
                              [](P p) { return model_entry(p.model.chosen.value_or(p.model.kind)).inertia; }},
    no_inertia{"a model without inertia", [](P p) { return p.law.inertia == 0; }},
    gamma{"model.gamma > 0", [](P p) { return p.model.gamma.value_or(0) > 0; }},
    resisted{"inertia or friction", [](P p) { return p.law.inertia != 0 || p.law.friction != 0; }};
const Property free_area{"model.area = \"free\" or \"reservoir\"", [](P p) { return p.law.area_is_free(); }},
    free_volume{"model.volume = \"free\"", [](P p) { return !p.law.keeps_volume; }},
    free_period{"model.period = \"free\"", [](P p) { return p.law.free_period; }},
    fixed_period{"model.period = \"fixed\"", [](P p) { return !p.law.free_period; }},
    beads{"model.bead_width", [](P p) { return p.law.beads.has_value(); }},
    pulled{"model.period = \"free\" or model.bead_width", [](P p) { return p.law.free_period || p.law.beads; }},
    kept{"a fixed area or volume", [](P p) { return p.law.keeps_volume || !p.law.area_is_free(); }},
    fixed_area{"model.area = \"fixed\"", [](P p) { return !p.law.area_is_free(); }},
    as_begun{"fixed area and period, without tension, pressure or force",
             [](P p) { return !p.law.reservoir && !p.law.free_period && p.law.without_loads(); }};

// Shapes and energies.
const Property tube{"a tube", [](P p) { return may_have_period(p.shape); }},
    frame{"shape.kind = \"result\"", [](P p) { return std::holds_alternative<ResultFrame>(p.shape); }},
    number_H0{"a number energy.H0", [](P p) { return !p.energy.H0_varies(); }},
    H0_of_area{"variable area alone where [equilibrium] is",
               [](P p) {
                   const auto& H0 = p.energy.H0_formula;
                   return !p.equilibrium || (!uses(*H0, 1) && !uses(*H0, 2));
               }},
    axisym_rest{"tier = \"axisym\" where [equilibrium] is",
                [](P p) { return !p.equilibrium || p.tier == Tier::axisym; }},
    alpha{"energy.alpha", [](P p) { return p.energy.alpha.has_value(); }},
    no_alpha{"an energy without energy.alpha", [](P p) { return !p.energy.alpha; }},
    no_potential{"a case without energy.potential", [](P p) { return p.energy.potentials.empty(); }},
    closed{"a closed surface", [](P p) { return !is_tube(p.shape); }},
    whole{"a closed surface or a tube", [](P p) { return !std::holds_alternative<Patch>(p.shape); }},
    smooth_shape{"an initial shape whose curvature does not jump (a capsule needs shape.smooth)",
                 [](P p) {
                     const auto* capsule = std::get_if<Capsule>(&p.shape);
                     return p.equilibrium || !capsule || capsule->smooth > 0;
                 }},
    rim{"shape.kind = \"patch\"", [](P p) { return may_have_rim(p.shape); }},
    two_rings{"shape.second_radius", [](P p) { return has_two_rings(p.shape); }},
    no_family{"a case without equilibrium.family", [](P p) { return !p.equilibrium || !p.equilibrium->family; }},
    no_modes{"a case without equilibrium.modes", [](P p) { return !p.equilibrium || !p.equilibrium->modes; }},
    other_branch{"a branch that does not vary it",
                 [](P p) { return !p.equilibrium || p.equilibrium->branch.parameter != vary_H0; }},
    few_terms{"the terms k20, k40 and k42 alone", [](P p) { return term_beyond_paper(p.energy).empty(); }};

// Discretisations.
const Property graph{"a graph r(z): the gradient flow of a tube, free volume and area, constant tension and pressure",
                     can_be_graph},
    begun_as_graph{graph.words, begins_as_graph},
    along{"a flow along the membrane: an inextensible model, or H0 that varies",
          [](P p) { return p.law.inextensible || p.energy.H0_varies(); }},
    smooth_splines{"discretisation.smoothness of 2 or more",
                   [](P p) { return p.tier != Tier::axisym || p.discretisation.smoothness != 1; }},
    ida{"time.integrator = \"ida\"", [](P p) { return p.time.integrator == Integrator::ida; }},
    step{"discretisation.step", [](P p) { return p.surface.step.has_value(); }},
    general{"a discretisation.scheme for all models", [](P p) { return scheme_of(p).general; }},
    adapts_step{"a scheme that adapts its step",
                [](P p) { return p.tier == Tier::axisym || scheme_of(p).controls_steps; }},
    adapts_mesh{"a scheme that controls its mesh", [](P p) { return scheme_of(p).controls_mesh; }},
    smooths{"scheme = \"paper\", or without [time]", [](P p) { return !p.moves() || scheme_of(p).smooths; }},
    rotation{"velocity.initial = \"rotation\"", [](P p) { return p.velocity.initial == InitialVelocity::rotation; }};

Test begins(InitialVelocity how) {
    return [how](P p) { return p.velocity.initial == how; };
}
Test varied(int parameter) {
    return [parameter](P p) { return p.equilibrium && p.equilibrium->branch.parameter == parameter; };
}
bool patch(P p) {
    return std::holds_alternative<Patch>(p.shape);
}
Test area_is(AreaRule rule) {
    return [rule](P p) { return p.model.area == rule; };
}
Test varies(Ramp MotionLaw::*load) {
    return [load](P p) { return !(p.law.*load).is_constant(); };
}
Test scheme_without(bool SchemeEntry::*has) {
    return [has](P p) { return p.tier != Tier::axisym && !(scheme_of(p).*has); };
}
Test parametrised(Parametrisation how) {
    return [how](P p) { return p.tier == Tier::axisym && p.discretisation.parametrisation == how; };
}

// A key that is valid with these properties alone, and one of which some values are.
Requirement key(std::string name, std::vector<Property> all, std::string reason = {}) {
    return {std::move(name), {}, std::move(all), std::move(reason)};
}
Requirement value(std::string name, Test counts, std::vector<Property> all, std::string reason = {}) {
    return {std::move(name), std::move(counts), std::move(all), std::move(reason), "not be {}:"};
}
Requirement number(std::string name, Test counts, std::vector<Property> all, std::string reason) {
    return {std::move(name), std::move(counts), std::move(all), std::move(reason), "be a number: what varies is"};
}

const std::vector<Requirement> rows{
    key("auto", {automatic_tier}),
    key("equilibrium", {named_tier}),
    key("equilibrium.family", {axisym}, "begin with a shape of the case, or with a result of tier axisym"),
    value("equilibrium.branch.vary", varied(vary_height), {two_rings}, "it is the distance of the rings"),
    value("equilibrium.branch.vary", varied(vary_kg), {axisym, whole}, "the gradient term is computed there alone"),
    key("equilibrium.rates", {surface}, "the rates of each m are those of equilibrium.modes"),
    key("equilibrium.modes", {axisym, no_inertia}, "rates of tier axisym neglect inertia"),
    value(
        "shape.kind", [](P p) { return std::holds_alternative<Torus>(p.shape) && p.tier == Tier::axisym; }, {motion},
        "equilibria of this tier are closed cells, or tubes with mirror symmetry"),

    value("shape.kind", patch, {axisym}, "tier surface3d has closed surfaces and periodic tubes"),
    key("model.rim", {rim}, "it says how a patch is held"),

    key("model", {time}, "nothing moves without it"),
    key("model.Re", {viscous}),
    key("model.gamma", {inextensible}),
    key("model.chosen", {automatic}, "it says what is chosen"),
    value(
        "model.chosen", [](P p) { return p.model.chosen == ModelKind::overdamped; }, {gamma},
        "nothing else would resist the motion"),
    value("model.kind", automatic.holds, {motion}, "all models have the same equilibria: name one"),
    value("model.kind", automatic.holds, {general}, "name a model"),
    value("model.area", area_is(AreaRule::free), {extensible}, "try \"reservoir\""),
    value("model.area", area_is(AreaRule::reservoir), {inextensible}, "try \"free\""),
    value("model.period", free_period.holds, {tube}),
    value("model.period", free_period.holds, {kept},
          "E + tension A - pressure V - force L of a straight tube is linear in L and has no equilibrium"),
    key("model.tension", {free_area}, "what a fixed area needs is the series tension"),
    key("model.pressure", {free_volume}, "what a fixed volume needs is the series pressure"),
    key("model.force", {pulled}, "what a fixed period needs is the series force"),
    key("model.bead_width", {closed}, "beads pull at the poles"),
    key("model.extension", {beads}, "it is that of the distance of two beads"),
    number("model.tension", varies(&MotionLaw::tension), {motion}, "equilibria are those of a constant value"),
    number("model.pressure", varies(&MotionLaw::pressure), {motion}, "equilibria are those of a constant value"),
    number("model.force", varies(&MotionLaw::force), {motion}, "equilibria are those of a constant value"),
    number(
        "model.extension", [](P p) { return p.law.beads && p.law.beads->change(); }, {motion},
        "equilibria have a constant distance"),
    key("model.source", {named_tier, motion, named_model, fixed_period, whole, resisted},
        "its force and its membrane go to a motion"),
    key("model.source.mass", {inextensible, fixed_area}, "it says how fast the area grows"),
    key("model.source.force_theta", {inertia}, "in other models of this tier nothing turns about the axis"),
    key("velocity", {time, motion}, "nothing moves without it"),
    key("velocity.initial", {inertia}),
    value("velocity.initial", begins(InitialVelocity::rotation), {chosen_inertia}),
    value("velocity.initial", begins(InitialVelocity::result), {chosen_inertia, frame}),
    key("velocity.omega", {inertia, rotation}),

    key("accuracy.relative_to", {time}, "nothing moves without it"),
    value("accuracy.relative_to", [](P p) { return p.accuracy.relative_to_energy; }, {motion}),
    key("accuracy.r_min", {time}, "nothing moves without it"),
    key("accuracy.estimate", {moving_surface}),

    key("time.end", {motion}),
    key("time.output", {motion}),
    key("time.stationary", {motion}),
    key("time.integrator", {axisym, motion}),
    value(
        "time.integrator", [](P p) { return p.time.integrator == Integrator::rosenbrock; }, {no_alpha, begun_as_graph},
        "omit it"),
    key("time.max_order", {axisym, motion, ida}),
    value("discretisation.parametrisation", parametrised(Parametrisation::graph), {no_alpha, graph}),
    value("discretisation.parametrisation", parametrised(Parametrisation::even), {number_H0},
          "where H0 varies, points move with the membrane"),
    value("discretisation.parametrisation", parametrised(Parametrisation::material), {along}),
    key("discretisation.recovery", {single_surface}, "the scheme determines the curvatures of a surface in motion"),
    key("discretisation.smoothing", {smooths}),
    key("discretisation.scheme", {time}),
    key("discretisation.step", {time}),
    key("discretisation.time_tolerance", {time, adapts_step}),
    key("discretisation.relaxation", {time, adapts_mesh, number_H0}, "where H0 varies, nodes move with the membrane"),
    key("discretisation.follow_curvature", {time, adapts_mesh, number_H0},
        "where H0 varies, nodes move with the membrane"),
    key("discretisation.coarsen", {time, adapts_mesh}),
    value("discretisation.scheme", scheme_without(&SchemeEntry::controls_steps), {named_tier},
          "it has no error estimate"),
    value("discretisation.scheme", scheme_without(&SchemeEntry::controls_steps), {step}, "it does not adapt the step"),
    value("discretisation.scheme", scheme_without(&SchemeEntry::with_inertia), {no_inertia},
          "bending waves grow in its steps"),
    value("discretisation.scheme", scheme_without(&SchemeEntry::general),
          {inextensible, resisted, as_begun, number_H0, few_terms, no_alpha, no_potential}),
    key("energy.potential", {time, no_family, resisted, fixed_period},
        "it holds the membrane at a place, and a motion then needs inertia or model.gamma > 0"),
    {"energy.potential",
     [](P p) { return std::ranges::any_of(p.energy.potentials, &Potential::is_wall); },
     {closed},
     "tubes have formulas"},
    {"energy.kg",
     [](P p) { return p.energy.kg > 0; },
     {axisym_rest, whole, smooth_shape, smooth_splines},
     "elsewhere grad H is not defined, or not computed",
     "be 0: a gradient term is"},
    key("units.viscosity", {viscous}, "the others have none"),
    key("units.density", {inertia}, "the others have no mass"),
    key("units.friction", {time}, "nothing moves without it"),
    key("energy.M0", {alpha}),
    number("energy.H0", [](P p) { return p.energy.H0_varies(); },
           {named_tier, time, axisym_rest, fixed_period, no_modes, other_branch, H0_of_area}, {}),
};

}  // namespace
}  // namespace needs

const std::vector<Requirement>& requirements() {
    return needs::rows;
}

const Property* missing_property(const Requirement& row, const Problem& p) {
    if (row.counts && !row.counts(p)) return nullptr;
    const auto missing = std::ranges::find_if(row.needs, [&](const Property& need) { return !need.holds(p); });
    return missing == row.needs.end() ? nullptr : &*missing;
}

bool can_have(const Problem& p, std::string_view key) {
    return std::ranges::none_of(
        needs::rows, [&](const Requirement& row) { return row.key == key && !row.counts && missing_property(row, p); });
}

}  // namespace tubule
