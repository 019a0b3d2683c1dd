// The keys of a case file. Every table describes its keys once, as a template over a visitor `Keys`:
// Reader (reader.hpp) reads and checks a file with it, Writer (write.cpp) writes one. The verbs:
//   number, integer, flag, text, increasing (a list of growing numbers)    key, target, what is allowed
//   ramp       a number, or a table of times and values                    key, target
//   formula    a text that is a formula                                    key, target, its variables
//   number_or_formula                                                      key, both targets, its variables
//   absent     a key that belongs to other cases, and why it must not be here
//   choice, kind (which shape)                                             names and what they stand for
//   table, optional_table, tables (a list of tables), entries (tables under open names)    key, target, description
//   check      a condition beyond a single key: gives "" or what is wrong, worded to follow the key
// A target that is a std::optional stays empty where the key is absent.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "common/case/case.hpp"
#include "common/energy/H0_variables.hpp"
#include "common/series/catalogue.hpp"

namespace tubule {

// Which numbers are allowed; `step` > 0 leaves from, from + step, ... to. `note` says where a bound comes from.
struct Range {
    double above = -std::numeric_limits<double>::infinity();
    double from = -std::numeric_limits<double>::infinity();
    double to = std::numeric_limits<double>::infinity();
    int step = 0;
    std::string note = {};
};

template <class T>
struct without_optional {
    using type = T;
};
template <class T>
struct without_optional<std::optional<T>> {
    using type = T;
};
template <class T>
using Choices = std::vector<std::pair<std::string, typename without_optional<T>::type>>;

// Names of entries that are not fixed keys: those listed (for messages), recognised by `accepts`.
struct OpenNames {
    std::vector<std::string> listed;
    bool (*accepts)(std::string_view name);
    std::string form;  // of each, in words
};

template <class Keys>
void keys(Keys& k, EnergyTerm& term) {
    k.number("modulus", term.modulus, {}, k.required);
    k.formula("formula", term.formula, EnergyTerm::variables);
    for (const auto& [key, power] : {std::pair{"H", &term.H}, {"K", &term.K}})
        if (term.formula)
            k.absent(key, "must be absent: the formula says how H and K enter");
        else
            k.integer(key, *power, {.from = 0, .to = most_power});
    k.check("", [&] {
        return term.formula || term.H + term.K > 0
                   ? ""
                   : "needs a power of H - H0 or of K, or a formula; a constant energy per area is model.tension";
    });
}

// What makes the term with this number one too many; else empty.
inline std::string repeated_term(const Bending& energy, std::size_t number) {
    const EnergyTerm& term = energy.terms[number];
    const std::size_t listed = listed_as(term);
    if (listed < n_bending_terms && energy.k[listed] != 0)
        return fmt::format("is the term of {}: give one of the two", term_key(energy, listed));
    for (std::size_t i = 0; i < number; ++i)
        if (term_name(energy.terms[i]) == term_name(term))
            return term.formula ? "must be the only formula: write the sum of both"
                                : fmt::format("has the powers of energy.term.{}: add the moduli", i);
    return {};
}

template <class Keys>
void keys(Keys& k, Bending& energy, Tier tier) {
    std::string moduli;
    for_each_bending_term([&](std::size_t i, const auto& term) {
        k.number(term.key, energy.k[i]);
        moduli += (moduli.empty() ? "" : ", ") + std::string(term.key);
    });
    k.number_or_formula("H0", energy.H0, energy.H0_formula, tier == Tier::surface3d ? H0_of_surface : H0_of_profile);
    k.tables("term", energy.terms, [](auto& k, EnergyTerm& term) { keys(k, term); });
    for (std::size_t i = 0; i < energy.terms.size(); ++i) {
        energy.terms[i].entry = i;
        k.check(fmt::format("term.{}", i), [&] { return repeated_term(energy, i); });
    }
    k.check("", [&]() -> std::string {
        for (std::size_t i = 0; i < count_terms(energy); ++i)
            if (modulus(energy, i) != 0) return {};
        return "needs a modulus other than zero: " + moduli + ", or that of a term [[energy.term]]";
    });
}

template <class Keys>
void keys(Keys& k, Shape& shape) {
    k.kind(shape);
    std::visit([&](auto& which) { keys(k, which); }, shape);
}

// The keys of fixed area, volume and period, and of the loads that act where they are free.
template <class Keys>
void ensemble_keys(Keys& k, Model& model) {
    const bool inextensible = model_entry(model.kind).inextensible;
    Choices<AreaRule> rules{{"fixed", AreaRule::fixed}};
    inextensible ? rules.emplace_back("reservoir", AreaRule::reservoir) : rules.emplace_back("free", AreaRule::free);
    k.choice("volume", model.keeps_volume, {{"free", false}, {"fixed", true}});
    k.choice("area", model.area, rules);
    k.choice("period", model.free_period, {{"fixed", false}, {"free", true}});
    const auto load = [&](const char* key, Ramp& target, bool is_free, const std::string& remedy) {
        if (is_free)
            k.ramp(key, target);
        else
            k.absent(key, "must be absent: only valid with " + remedy);
    };
    load("tension", model.tension, area_rule(model) != AreaRule::fixed,
         fmt::format("area = \"{}\"; what a fixed area needs is the series tension", rules.back().first));
    load("pressure", model.pressure, !model.keeps_volume.value_or(inextensible),
         "volume = \"free\"; what a fixed volume needs is the series pressure");
    load("force", model.force, model.free_period, "period = \"free\"; what a fixed period needs is the series force");
    k.check("period", [&]() -> std::string {
        const MotionLaw law = motion_law(model);
        if (!law.free_period || law.keeps_volume || !law.area_is_free()) return {};
        return "must not be \"free\" with free volume and area: E + tension A - pressure V - force L of a straight "
               "tube "
               "is linear in L and has no rest state; fix area or volume";
    });
}

// Which model stands for "auto": a result has it in its case.
template <class Keys>
void chosen_key(Keys& k, Model& model) {
    if (model.kind != ModelKind::automatic)
        return k.absent("chosen", "must be absent: only valid with kind = \"auto\", to say what is chosen");
    Choices<std::optional<ModelKind>> candidates;
    for (const ModelEntry& m : models)
        if (m.inextensible && m.kind != ModelKind::automatic) candidates.emplace_back(m.name, m.kind);
    k.choice("chosen", model.chosen, candidates);
    k.check("chosen", [&] {
        return model.chosen == ModelKind::overdamped && !(model.gamma.value_or(0) > 0)
                   ? "must not be \"overdamped\" without model.gamma: nothing would resist the motion"
                   : "";
    });
}

template <class Keys>
void keys(Keys& k, Model& model) {
    Choices<ModelKind> kinds;
    for (const ModelEntry& m : models) kinds.emplace_back(m.name, m.kind);
    k.choice("kind", model.kind, kinds);
    const ModelEntry& has = model_entry(model.kind);
    if (has.viscous)
        k.number("Re", model.Re, {.above = 0});
    else
        k.absent("Re", "must be absent: only valid with kind = " + quoted_names(&ModelEntry::viscous));
    if (has.inextensible)
        k.number("gamma", model.gamma, has.viscous ? Range{.from = 0} : Range{.above = 0});
    else
        k.absent("gamma", "must be absent: only valid with kind = " + quoted_names(&ModelEntry::inextensible));
    chosen_key(k, model);
    ensemble_keys(k, model);
}

template <class Keys>
void keys(Keys& k, Velocity& velocity, const Model& model) {
    if (!model_entry(model.kind).inertia) {
        k.absent("initial", "must be absent: only model.kind = " + quoted_names(&ModelEntry::inertia) +
                                " has a velocity at the start");
        return k.absent("omega", "must be absent as well");
    }
    k.choice("initial", velocity.initial,
             {{"rest", InitialVelocity::rest},
              {"rotation", InitialVelocity::rotation},
              {"result", InitialVelocity::result}});
    if (velocity.initial == InitialVelocity::rotation)
        k.number("omega", velocity.omega, {}, k.required);
    else
        k.absent("omega", "must be absent: only valid with initial = \"rotation\"");
}

template <class Keys>
void keys(Keys& k, Accuracy& accuracy, bool moves, Tier tier) {
    k.number("energy", accuracy.energy, {.above = 1e-12, .to = 0.1});
    if (moves)
        k.choice("relative_to", accuracy.relative_to_energy, {{"magnitude", false}, {"energy", true}});
    else
        k.absent("relative_to", "must be absent: without a table [time] nothing moves");
    if (moves && tier != Tier::axisym)
        k.flag("estimate", accuracy.estimate);
    else
        k.absent("estimate", "must be absent: only valid for motions in three dimensions");
    if (moves)
        k.number("r_min", accuracy.r_min, {.above = 0});
    else
        k.absent("r_min", "must be absent: without a table [time] nothing moves");
}

template <class Keys>
void keys(Keys& k, Discretisation& d) {
    k.integer("elements", d.elements, {.from = 4, .to = 100000});
    k.integer("order", d.order, {.from = 3, .to = 7, .step = 2});
    k.integer("smoothness", d.smoothness, {.from = 1, .to = d.order - 1.0, .note = "order - 1"});
    k.number("time_tolerance", d.time_tolerance, {.above = 1e-14, .to = 0.1});
    k.flag("symmetry", d.symmetry);
    k.choice(
        "parametrisation", d.parametrisation,
        {{"graph", Parametrisation::graph}, {"even", Parametrisation::even}, {"material", Parametrisation::material}});
}

// The keys that a time scheme accepts.
template <class Keys>
void keys_of_scheme(Keys& k, SurfaceDiscretisation& d, const SchemeEntry& scheme) {
    const auto absent = [&](const char* key, const char* what) {
        k.absent(key, fmt::format("must be absent: scheme \"{}\" {}", scheme.name, what));
    };
    if (scheme.smooths) {
        k.number("smoothing", d.smoothing, {.from = 0});
    } else {
        const auto smoothing = std::find_if(schemes.begin(), schemes.end(), [](const auto& s) { return s.smooths; });
        k.absent("smoothing", fmt::format("must be absent: only valid with scheme = \"{}\"", smoothing->name));
    }
    if (scheme.controls_steps)
        k.number("time_tolerance", d.time_tolerance, {.above = 1e-14, .to = 0.1});
    else
        absent("time_tolerance", "does not adapt its step");
    if (scheme.controls_mesh) {
        k.number("relaxation", d.relaxation, {.above = 0});
        k.flag("follow_curvature", d.follow_curvature);
        k.flag("coarsen", d.coarsen);
    } else {
        for (const char* key : {"relaxation", "follow_curvature", "coarsen"}) absent(key, "does not control its mesh");
    }
}

template <class Keys>
void keys(Keys& k, SurfaceDiscretisation& d, bool moves) {
    k.integer("elements", d.elements, {.from = 20, .to = 1000000});
    k.integer("order", d.order, {.from = 2, .to = 4, .step = 1});
    k.choice("mesh", d.mesh,
             {{"uniform", MeshKind::uniform}, {"graded", MeshKind::graded}, {"irregular", MeshKind::irregular}});
    if (moves) {
        k.absent("recovery", "must be absent: the time scheme determines the curvatures of a moving surface");
        Choices<Scheme> choices;
        for (std::size_t i = 0; i < schemes.size(); ++i) choices.emplace_back(schemes[i].name, Scheme{i});
        k.choice("scheme", d.scheme, choices);
        k.number("step", d.step, {.above = 0});
        keys_of_scheme(k, d, d.scheme ? entry(*d.scheme) : SchemeEntry{});
        return;
    }
    k.choice("recovery", d.recovery,
             {{"elementwise", Recovery::elementwise},
              {"normal", Recovery::normal},
              {"weak", Recovery::weak},
              {"lifted", Recovery::lifted},
              {"patch-nodal", Recovery::patch_nodal},
              {"patch", Recovery::patch},
              {"exact", Recovery::exact}});
    k.number("smoothing", d.smoothing, {.from = 0});
    for (const char* key : {"scheme", "step", "time_tolerance", "relaxation", "follow_curvature", "coarsen"})
        k.absent(key, "must be absent: only valid with a table [time]");
}

template <class Keys>
void keys(Keys& k, TimeSpan& time, Tier tier) {
    k.number("end", time.end, {.above = 0}, k.required);
    k.increasing("output", time.output, {.from = 0, .to = time.end, .note = "time.end"});
    k.number("stationary", time.stationary, {.above = 0});
    k.number("limit", time.limit, {.above = 0});
    if (tier != Tier::axisym) {
        for (const char* key : {"integrator", "max_order"})
            k.absent(key, "must be absent: only valid with tier = \"axisym\"");
        return;
    }
    k.choice("integrator", time.integrator, {{"ida", Integrator::ida}, {"rosenbrock", Integrator::rosenbrock}});
    if (time.integrator == Integrator::ida)
        k.integer("max_order", time.max_order, {.from = 1, .to = 5});
    else
        k.absent("max_order", "must be absent: only valid with integrator = \"ida\"");
}

template <class Keys>
void keys(Keys& k, Expectation& expected, double end) {
    Range values;
    if (expected.series == "time") values = {.from = 0, .to = end, .note = "time.end"};
    k.number("value", expected.value, values, k.required);
    k.number("rel", expected.rel, {.above = 0});
    k.number("abs", expected.abs, {.above = 0});
    k.check("", [&]() -> std::string {
        if (!expected.rel && !expected.abs) return "needs a tolerance: rel, abs or both";
        if (!expected.abs && expected.value == 0)
            return "needs abs: a relative tolerance is meaningless for the value 0";
        return {};
    });
}

// A file groups the expectations by time; the case keeps them in one list.
template <class Keys>
void keys(Keys& k, Expect& expect, double end) {
    struct Moment {
        double time = 0;
        std::vector<Expectation> values;
    };
    std::vector<Expectation> at_end;
    std::vector<Moment> moments;
    for (const Expectation& value : expect.values) {
        if (!value.time) {
            at_end.push_back(value);
            continue;
        }
        const auto given = [&](const Expectation& other) { return other.series == value.series; };
        if (moments.empty() || moments.back().time != *value.time || std::ranges::any_of(moments.back().values, given))
            moments.push_back({*value.time, {}});  // a table has each series once
        moments.back().values.push_back(value);
    }
    for (Moment& moment : moments) std::ranges::sort(moment.values, {}, &Expectation::series);  // as a table has them

    Choices<Stop> stops;
    for (const StopKind& kind : stop_kinds) stops.emplace_back(kind.name, kind.reason);
    k.choice("stop", expect.stop, stops);

    // At the end the series "time" is the time of stopping, also called stop_time; at a moment, `time` is that moment.
    const std::string form = "a table, such as {value = 1.5, rel = 1e-3}";
    OpenNames in_end{expectable_series(), [](std::string_view n) { return n == "stop_time" || is_expectable(n); },
                     form};
    OpenNames in_moment{expectable_series(), [](std::string_view n) { return n != "time" && is_expectable(n); }, form};
    in_end.listed.push_back("stop_time");
    in_moment.listed.erase(in_moment.listed.begin());
    for (Expectation& value : at_end)
        if (value.series == "time") value.series = "stop_time";
    k.entries(in_end, at_end, &Expectation::series, [&](auto& k, Expectation& value) {
        if (value.series == "stop_time") value.series = "time";
        keys(k, value, end);
    });
    k.tables("at", moments, [&](auto& k, Moment& moment) {
        k.number("time", moment.time, {.from = 0, .to = end, .note = "time.end"}, k.required);
        k.entries(in_moment, moment.values, &Expectation::series,
                  [&](auto& k, Expectation& value) { keys(k, value, end); });
        k.check("", [&] { return moment.values.empty() ? "is empty: add a series and its expected value" : ""; });
    });

    expect.values = at_end;
    for (const Moment& moment : moments)
        for (Expectation value : moment.values) {
            value.time = moment.time;
            expect.values.push_back(value);
        }
}

// Parts of the energy are expected of terms that the case has.
template <class Keys>
void check_expected_terms(Keys& k, const Case& c) {
    const std::vector<std::string> names = term_names(c.energy);
    for (const Expectation& value : c.expect.values)
        k.check("expect", [&]() -> std::string {
            const std::string_view part = energy_part(value.series);
            if (part.empty() || std::ranges::find(names, part) != names.end()) return {};
            return fmt::format("has {}, but the energy has no such term; its parts are energy_{}", value.series,
                               fmt::join(names, ", energy_"));
        });
}

// Why tier "axisym" cannot use an initial shape.
inline Asymmetry not_axisymmetric(const Shape& shape) {
    return std::visit(
        [](const auto& which) -> Asymmetry {
            if constexpr (requires { asymmetry(which); }) return asymmetry(which);
            return {};
        },
        shape);
}

// If the smallest initial radius is known.
template <class Keys>
void check_neck(Keys& k, const Case& c) {
    std::visit(
        [&](const auto& shape) {
            if constexpr (requires { narrowest(shape); })
                k.check("accuracy.r_min", [&]() -> std::string {
                    const Neck neck = narrowest(shape);
                    if (c.accuracy.r_min < neck.radius) return {};
                    return fmt::format("must be below the smallest radius of the start ({:.6g} at z = {:.6g}), not {}",
                                       neck.radius, neck.z, c.accuracy.r_min);
                });
        },
        c.shape);
}

// Where a branch begins, if the case says so and not the area or volume of its start.
inline std::optional<double> branch_begin(const Case& c) {
    const int parameter = *c.equilibrium->branch.parameter;
    if (parameter == vary_area) return c.equilibrium->area;
    if (parameter == vary_volume) return c.equilibrium->volume;
    if (parameter == vary_reduced_volume) return c.equilibrium->reduced_volume;
    const Loads loads = loads_at(motion_law(c.model), 0);
    if (parameter == vary_tension) return loads.tension;
    if (parameter == vary_pressure) return loads.pressure;
    if (parameter == vary_force) return loads.force;
    return parameter == vary_H0 ? c.energy.H0 : modulus(c.energy, parameter);
}

// Refuses what axisymmetric equilibria do not combine with.
template <class Keys>
void check_equilibrium_keys(Keys& k, const Case& c, const MotionLaw& law) {
    for (const auto& [key, load] :
         {std::pair{"model.tension", &law.tension}, {"model.pressure", &law.pressure}, {"model.force", &law.force}})
        k.check(key, [&] {
            return load->is_constant() ? "" : "must be a number: nothing moves in a case with [equilibrium]";
        });
    k.check("model.kind", [&] {
        return c.equilibrium->modes && law.inertia != 0
                   ? fmt::format("must not be \"{}\" with equilibrium.modes: growth rates neglect inertia",
                                 name(c.model))
                   : "";
    });
    k.check("accuracy.relative_to", [&] {
        return c.accuracy.relative_to_energy ? "must not be \"energy\" with [equilibrium]: nothing starts" : "";
    });
    k.check("equilibrium.volume", [&]() -> std::string {
        const EquilibriumChoices& e = *c.equilibrium;
        if (is_tube(c.shape) || c.model.free_period || !e.area || !e.volume) return {};
        const double most = std::pow(*e.area, 1.5) / (6 * std::sqrt(pi));
        if (*e.volume <= most) return {};
        return fmt::format("must be at most {:.6g}: no shape with this equilibrium.area encloses more", most);
    });
    k.check("equilibrium.branch", [&]() -> std::string {
        const BranchChoices& b = c.equilibrium->branch;
        if (!b.parameter || !b.to || !b.step) return {};
        const std::optional<double> from = branch_begin(c);
        return from ? wrong_branch(*from, *b.to, *b.step) : "";
    });
    k.check("shape.kind", [&] {
        return std::holds_alternative<Torus>(c.shape)
                   ? "must not be \"torus\": equilibria are closed cells, or tubes with "
                     "mirror symmetry"
                   : "";
    });
}

// Refuses what has no law for a varying spontaneous curvature. Long: a line for each.
template <class Keys>
void check_varying_H0(Keys& k, const Case& c) {
    if (!c.energy.H0_varies()) return;
    const bool from_points = c.energy.H0_from_points();
    const std::string number = from_points ? "has a column H0, but H0 must be a number " : "must be a number ";
    k.check(from_points ? "shape.path" : "energy.H0", [&]() -> std::string {
        const MotionLaw law = motion_law(c.model);
        if (c.tier == Tier::automatic)
            return number + "in tier \"auto\", whose growth rates are those of a constant H0; try tier = \"axisym\"";
        if (c.tier == Tier::surface3d && !c.moves())
            return number + "without a table [time]: give the surface a motion";
        if (law.free_period) return number + "with model.period = \"free\"; keep the period fixed";
        if (!c.equilibrium) return {};
        if (uses(*c.energy.H0_formula, 1) || uses(*c.energy.H0_formula, 2))
            return "must be a formula of area alone in a case with [equilibrium], where no point has a place at the "
                   "start";
        if (c.equilibrium->modes) return number + "with equilibrium.modes; leave the modes out";
        if (c.equilibrium->branch.parameter == vary_H0) return number + "where the branch varies it";
        return {};
    });
    for (const auto& [key, given] : {std::pair{"discretisation.relaxation", c.surface.relaxation.has_value()},
                                     {"discretisation.follow_curvature", c.surface.follow_curvature}})
        k.check(key, [&, given = given] {
            return given ? "must be absent where energy.H0 varies: the nodes go with the membrane" : "";
        });
    k.check("discretisation.parametrisation", [&]() -> std::string {
        const auto chosen = c.discretisation.parametrisation;
        if (!chosen || *chosen == Parametrisation::material) return {};
        return "must be \"material\" or absent where energy.H0 varies: it goes with the points of the profile";
    });
}

template <class Keys>
void check_surface_scheme(Keys& k, const Case& c, const MotionLaw& law, const SchemeEntry& scheme) {
    k.check("discretisation.scheme", [&]() -> std::string {
        if (!scheme.controls_steps && !c.surface.step)
            return fmt::format("\"{}\" needs discretisation.step: it does not adapt the step", scheme.name);
        if (!scheme.with_inertia && law.inertia != 0)
            return fmt::format("must not be \"{}\" for a fluid: bending waves grow in its steps", scheme.name);
        if (scheme.general) return {};
        if (!law.inextensible) return fmt::format("must not be \"{}\" for a gradient flow", scheme.name);
        if (law.inertia == 0 && law.friction == 0)
            return fmt::format("must not be \"{}\" for a Stokes flow without friction: rigid motions are undetermined",
                               scheme.name);
        if (law.reservoir || law.free_period || !law.without_loads())
            return fmt::format("must not be \"{}\" with model.{}", scheme.name,
                               law.reservoir     ? "area = \"reservoir\""
                               : law.free_period ? "period = \"free\""
                                                 : "pressure");
        if (c.energy.H0_varies())
            return fmt::format("must not be \"{}\" where energy.H0 varies: it has no force along the surface",
                               scheme.name);
        if (const auto key = term_beyond_paper(c.energy); !key.empty())
            return fmt::format("must not be \"{}\" with {}: it has k20, k40 and k42 only", scheme.name, key);
        return {};
    });
}

// Refuses, with model.kind = "auto", what only some of the models have.
template <class Keys>
void check_chosen_model(Keys& k, const Case& c) {
    if (c.model.kind != ModelKind::automatic) return;
    k.check("model.chosen", [&] {
        return c.model.chosen && !model_entry(*c.model.chosen).inertia && c.velocity.initial != InitialVelocity::rest
                   ? fmt::format("must not be \"{}\" with a velocity.initial: only \"fluid\" has one",
                                 model_entry(*c.model.chosen).name)
                   : "";
    });
    k.check("model.kind", [&]() -> std::string {
        if (c.equilibrium)
            return "must not be \"auto\" with [equilibrium]: nothing moves; \"fluid\" and \"overdamped\" have the same "
                   "equilibria";
        if (!c.surface.scheme || entry(*c.surface.scheme).general) return {};
        return fmt::format(
            "must not be \"auto\" with discretisation.scheme = \"{}\", which does not support all models; name one",
            entry(*c.surface.scheme).name);
    });
}

// Conditions across tables. Long: a line for each.
template <class Keys>
void check_together(Keys& k, const Case& c) {
    const MotionLaw law = motion_law(c.model);
    check_varying_H0(k, c);
    k.check("velocity.initial", [&] {
        return c.velocity.initial == InitialVelocity::result && !std::holds_alternative<ResultFrame>(c.shape)
                   ? "must not be \"result\": only shape.kind = \"result\" has a velocity"
                   : "";
    });
    check_chosen_model(k, c);
    k.check("model.period", [&] {
        return law.free_period && !may_have_period(c.shape) ? "must not be \"free\": only a tube has a period" : "";
    });
    const SchemeEntry scheme = c.surface.scheme ? entry(*c.surface.scheme) : SchemeEntry{};
    if (c.tier == Tier::automatic) {
        k.check("discretisation.scheme", [&]() -> std::string {
            if (scheme.controls_steps) return {};
            return fmt::format("must not be \"{}\" in tier \"auto\": it has no error estimate", scheme.name);
        });
        if (not_axisymmetric(c.shape).first.empty()) check_neck(k, c);
        return;
    }
    if (c.tier == Tier::surface3d) return check_surface_scheme(k, c, law, scheme);
    const auto [key, complaint] = not_axisymmetric(c.shape);
    k.check(key, [&] { return complaint; });
    k.check("discretisation.parametrisation", [&]() -> std::string {
        const auto chosen = c.discretisation.parametrisation;
        if (chosen == Parametrisation::graph && !can_be_graph(c))
            return "must not be \"graph\": only the gradient flow of a tube with free volume and area, under tension "
                   "and pressure that do not change, is computed as a graph";
        if (chosen == Parametrisation::material && !law.inextensible && !c.energy.H0_varies())
            return "must not be \"material\": the gradient flow has no flow along the membrane";
        return {};
    });
    k.check("time.integrator", [&] {
        return c.time.integrator == Integrator::rosenbrock && !begins_as_graph(c)
                   ? "must not be \"rosenbrock\": it integrates graphs r(z) alone, the gradient flow of a tube with "
                     "free "
                     "volume and area under constant loads; omit it"
                   : "";
    });
    if (c.equilibrium) check_equilibrium_keys(k, c, law);
    check_neck(k, c);
}

template <class Keys>
void keys(Keys& k, AutoChoices& a) {
    k.number("noise", a.noise, {.above = 0, .to = 0.1});
    k.number("largest", a.largest, {.above = 0, .to = 0.1});
    k.integer("modes", a.modes, {.from = 1, .to = 20});
    k.check("noise", [&]() -> std::string {
        if (a.noise < a.largest) return {};
        return fmt::format("must be below auto.largest = {}, not {}", a.largest, a.noise);
    });
}

// Tier auto moves the shape and chooses between the other two tiers.
template <class Keys>
void automatic_keys(Keys& k, Case& c) {
    k.absent("equilibrium", "must be absent: only valid with tier = \"axisym\"");
    k.table("model", [&](auto& k) { keys(k, c.model); });
    k.table("velocity", [&](auto& k) { keys(k, c.velocity, c.model); });
    k.table("auto", [&](auto& k) { keys(k, c.automatic); });
    k.table("time", [&](auto& k) { keys(k, c.time, c.tier); });
}

// Tier axisym moves a profile or computes its equilibria.
template <class Keys>
void motion_keys(Keys& k, Case& c) {
    k.table("model", [&](auto& k) { keys(k, c.model); });
    k.optional_table("equilibrium", c.equilibrium,
                     [&](auto& k, EquilibriumChoices& e) { keys(k, e, c.model, c.energy); });
    if (c.equilibrium)
        k.absent("velocity", "must be absent: nothing moves in a case with [equilibrium]");
    else
        k.table("velocity", [&](auto& k) { keys(k, c.velocity, c.model); });
}

// Tier surface3d moves a surface if there is a table [time].
template <class Keys>
void surface_motion_keys(Keys& k, Case& c) {
    k.absent("equilibrium", "must be absent: only valid with tier = \"axisym\"");
    std::optional<TimeSpan> time;
    if (c.moves()) time = c.time;
    k.optional_table("time", time, [&](auto& k, TimeSpan& t) { keys(k, t, c.tier); });
    if (time) c.time = *time;
    if (!c.moves()) {
        for (const char* key : {"model", "velocity"})
            k.absent(key, "must be absent: without a table [time] nothing moves");
        return;
    }
    k.table("model", [&](auto& k) { keys(k, c.model); });
    k.table("velocity", [&](auto& k) { keys(k, c.velocity, c.model); });
}

template <class Keys>
void keys(Keys& k, Case& c) {
    k.choice("tier", c.tier, {{"axisym", Tier::axisym}, {"surface3d", Tier::surface3d}, {"auto", Tier::automatic}},
             k.required);
    k.table("about", [&](auto& k) {
        k.text("title", c.title);
        k.text("source", c.source);
    });
    k.table("energy", [&](auto& k) { keys(k, c.energy, c.tier); });
    if (c.tier != Tier::automatic) k.absent("auto", "must be absent: only valid with tier = \"auto\"");
    if (c.tier == Tier::axisym)
        motion_keys(k, c);
    else if (c.tier == Tier::surface3d)
        surface_motion_keys(k, c);
    else
        automatic_keys(k, c);
    k.table("shape", [&](auto& k) { keys(k, c.shape); });
    k.table("accuracy", [&](auto& k) { keys(k, c.accuracy, c.tier != Tier::surface3d || c.moves(), c.tier); });
    k.table("discretisation", [&](auto& k) {
        if (c.tier == Tier::surface3d)
            keys(k, c.surface, c.moves());
        else if (c.tier == Tier::automatic)
            keys(k, c.surface, true);
        else if (c.equilibrium)
            k.integer("order", c.discretisation.order, {.from = 3, .to = 7, .step = 2});
        else
            keys(k, c.discretisation);
    });
    if (c.equilibrium)
        k.table("time", [&](auto& k) {
            for (const char* key : {"end", "output", "stationary"})
                k.absent(key, "must be absent: nothing moves in a case with [equilibrium]");
            k.number("limit", c.time.limit, {.above = 0});
        });
    else if (c.tier == Tier::axisym)
        k.table("time", [&](auto& k) { keys(k, c.time, c.tier); });
    // The shapes of a branch are numbered as if that were their time.
    const double end = c.equilibrium ? std::numeric_limits<int>::max() : c.time.end;
    k.table("expect", [&](auto& k) { keys(k, c.expect, end); });
    check_expected_terms(k, c);
    check_together(k, c);
}

}  // namespace tubule
