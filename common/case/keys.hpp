// The keys of a case file. Every table describes its keys once, as a template over a visitor `Keys`:
// Reader (reader.hpp) reads and checks a file with it, Writer (write.cpp) writes one. The verbs:
//   number, integer, flag, text, increasing (a list of growing numbers)    key, target, what is allowed
//   ramp       a number, or a table of times and values                    key, target
//   formula    a text that is a formula                                    key, target, its variables
//   number_or_formula, ramp_or_formula                                     key, both targets, its variables
//   absent     a key that belongs to other shapes, and why it must not be here
//   choice, kind (which shape)                                             names and what they stand for
//   table, optional_table, tables (a list of tables), entries (tables under open names)    key, target, description
//   check      a condition beyond a single key: gives "" or what is wrong, worded to follow the key
// A target that is a std::optional stays empty where the key is absent. Which keys go together: requirements.hpp.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
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
void keys(Keys& k, Units& units) {
    const auto quantity = [&](const char* key, std::string& text, QuantityKind kind, bool needed) {
        k.text(key, text, needed, quantity_words(kind));
        k.check(key, [&] { return text.empty() && !needed ? "" : wrong_quantity(text, kind); });
    };
    quantity("length", units.length, QuantityKind::length, k.required);
    quantity("bending_rigidity", units.bending_rigidity, QuantityKind::energy, k.required);
    quantity("temperature", units.temperature, QuantityKind::temperature, false);
    quantity("viscosity", units.viscosity, QuantityKind::viscosity, false);
    quantity("density", units.density, QuantityKind::density, false);
    quantity("friction", units.friction, QuantityKind::friction, false);
}

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
void keys(Keys& k, Potential& p, Tier tier) {
    using Kind = Potential::Kind;
    k.choice("kind", p.kind, {{"plane", Kind::plane}, {"sphere", Kind::sphere}, {"formula", Kind::formula}},
             k.required);
    const bool sphere = p.kind == Kind::sphere;
    if (sphere)
        k.number("radius", p.radius, {.above = 0}, k.required);
    else
        k.absent("radius", "must be absent: only a sphere has one");
    if (!p.is_wall()) {
        if (tier == Tier::surface3d)
            k.formula("formula", p.formula, Potential::in_space, k.required);
        else
            k.formula("formula", p.formula, Potential::variables, k.required);
        for (const char* key : {"z", "side", "law", "strength", "range"})
            k.absent(key, "must be absent: the formula says how the energy depends on the place");
        return;
    }
    k.absent("formula", "must be absent: kind = \"formula\" has one");
    k.number("z", p.z);
    k.choice("side", p.behind, {{sphere ? "outside" : "above", false}, {sphere ? "inside" : "below", true}});
    k.choice("law", p.law, {{"morse", Potential::Law::morse}, {"9-3", Potential::Law::nine_three}});
    k.number("strength", p.strength, {.from = 0}, k.required);
    k.number("range", p.range, {.above = 0}, k.required);
}

template <class Keys>
void keys(Keys& k, Bending& energy, Tier tier) {
    std::string moduli;
    for_each_bending_term([&](std::size_t i, const auto& term) {
        k.number(term.key, energy.k[i]);
        moduli += (moduli.empty() ? "" : ", ") + std::string(term.key);
    });
    k.number("kg", energy.kg, {.from = 0});
    k.number_or_formula("H0", energy.H0, energy.H0_formula, tier == Tier::surface3d ? H0_of_surface : H0_of_profile);
    k.number("alpha", energy.alpha, {.from = 0});
    k.number("M0", energy.M0);
    k.tables("term", energy.terms, [](auto& k, EnergyTerm& term) { keys(k, term); });
    k.tables("potential", energy.potentials, [&](auto& k, Potential& p) { keys(k, p, tier); });
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

inline constexpr std::array<std::string_view, 1> pressure_variables{"V"};

template <class Keys>
void keys(Keys& k, Sources& source, Tier tier) {
    const auto formula = [&](const std::string& key, std::shared_ptr<const Formula>& target) {
        if (tier == Tier::surface3d)
            k.formula(key, target, Sources::in_space);
        else
            k.formula(key, target, Sources::variables);
    };
    const std::array components = tier == Tier::surface3d ? std::array{"force_x", "force_y", "force_z"}
                                                          : std::array{"force_r", "force_theta", "force_z"};
    for (std::size_t i = 0; i < components.size(); ++i) formula(components[i], source.force[i]);
    formula("mass", source.mass);
}

template <class Keys>
void keys(Keys& k, Model& model, Tier tier) {
    Choices<ModelKind> kinds;
    Choices<std::optional<ModelKind>> candidates;  // that can stand for "auto"
    for (const ModelEntry& m : models) {
        kinds.emplace_back(m.name, m.kind);
        if (m.inextensible && m.kind != ModelKind::automatic) candidates.emplace_back(m.name, m.kind);
    }
    k.choice("kind", model.kind, kinds);
    k.number("Re", model.Re, {.above = 0});
    k.number("gamma", model.gamma, model_entry(model.kind).viscous ? Range{.from = 0} : Range{.above = 0});
    k.choice("chosen", model.chosen, candidates);
    k.choice("volume", model.keeps_volume, {{"free", false}, {"fixed", true}});
    k.choice("area", model.area,
             {{"fixed", AreaRule::fixed}, {"free", AreaRule::free}, {"reservoir", AreaRule::reservoir}});
    k.choice("period", model.free_period, {{"fixed", false}, {"free", true}});
    k.ramp("tension", model.tension);
    k.ramp_or_formula("pressure", model.pressure, model.pressure_of_volume, pressure_variables);
    k.ramp("force", model.force);
    k.number("bead_width", model.bead_width, {.above = 0});
    k.ramp("extension", model.extension);
    k.choice("rim", model.rim, {{"clamped", Rim::clamped}, {"hinged", Rim::hinged}});
    k.table("source", [&](auto& k) { keys(k, model.source, tier); });
    k.check("extension", [&] {
        return model.extension && !model.force.is_zero()
                   ? "holds the distance that model.force pulls at: give one of them"
                   : "";
    });
}

template <class Keys>
void keys(Keys& k, Velocity& velocity) {
    k.choice("initial", velocity.initial,
             {{"rest", InitialVelocity::rest},
              {"rotation", InitialVelocity::rotation},
              {"result", InitialVelocity::result}});
    k.number("omega", velocity.omega, {}, velocity.initial == InitialVelocity::rotation);
}

template <class Keys>
void keys(Keys& k, Accuracy& accuracy) {
    k.number("energy", accuracy.energy, {.above = 1e-12, .to = 0.1});
    k.choice("relative_to", accuracy.relative_to_energy, {{"magnitude", false}, {"energy", true}});
    k.flag("estimate", accuracy.estimate);
    k.number("r_min", accuracy.r_min, {.above = 0});
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

template <class Keys>
void keys(Keys& k, SurfaceDiscretisation& d) {
    k.integer("elements", d.elements, {.from = 20, .to = 1000000});
    k.integer("order", d.order, {.from = 2, .to = 4, .step = 1});
    k.choice("mesh", d.mesh,
             {{"uniform", MeshKind::uniform}, {"graded", MeshKind::graded}, {"irregular", MeshKind::irregular}});
    k.choice("recovery", d.recovery,
             {{"elementwise", Recovery::elementwise},
              {"normal", Recovery::normal},
              {"weak", Recovery::weak},
              {"lifted", Recovery::lifted},
              {"patch-nodal", Recovery::patch_nodal},
              {"patch", Recovery::patch},
              {"exact", Recovery::exact}});
    k.number("smoothing", d.smoothing, {.from = 0});
    Choices<Scheme> choices;
    for (std::size_t i = 0; i < schemes.size(); ++i) choices.emplace_back(schemes[i].name, Scheme{i});
    k.choice("scheme", d.scheme, choices);
    k.number("step", d.step, {.above = 0});
    k.number("time_tolerance", d.time_tolerance, {.above = 1e-14, .to = 0.1});
    k.number("relaxation", d.relaxation, {.above = 0});
    k.flag("follow_curvature", d.follow_curvature);
    k.flag("coarsen", d.coarsen);
}

template <class Keys>
void keys(Keys& k, TimeSpan& time, bool moves) {
    k.number("end", time.end, {.above = 0}, moves);
    k.increasing("output", time.output, {.from = 0, .to = time.end, .note = "time.end"});
    k.number("stationary", time.stationary, {.above = 0});
    k.number("limit", time.limit, {.above = 0});
    k.choice("integrator", time.integrator, {{"ida", Integrator::ida}, {"rosenbrock", Integrator::rosenbrock}});
    k.integer("max_order", time.max_order, {.from = 1, .to = 5});
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
    std::vector<std::string> names = term_names(c.energy);
    const bool varies = c.equilibrium && c.equilibrium->branch.parameter == vary_kg;
    if (c.energy.kg > 0 || varies) names.emplace_back("kg");
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
                    return fmt::format(
                        "must be below the smallest radius of the initial shape ({:.6g} at z = {:.6g}), not {}",
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
    if (parameter == vary_extension) return c.model.extension ? std::optional(c.model.extension->at(0)) : std::nullopt;
    if (parameter == vary_height) return std::nullopt;
    if (parameter == vary_alpha) return c.energy.alpha;
    if (parameter == vary_kg) return c.energy.kg;
    if (parameter <= vary_strength) return c.energy.potentials[vary_strength - parameter].strength;
    if (parameter == vary_M0) return c.energy.M0;
    return parameter == vary_H0 ? c.energy.H0 : modulus(c.energy, parameter);
}

// Conditions on the values of several keys.
template <class Keys>
void check_values(Keys& k, const Case& c) {
    if (c.tier == Tier::axisym) {
        const auto [key, complaint] = not_axisymmetric(c.shape);
        k.check(key, [&] { return complaint; });
    }
    if (c.tier != Tier::surface3d && not_axisymmetric(c.shape).first.empty()) check_neck(k, c);
    if (!c.equilibrium) return;
    k.check("equilibrium.volume", [&]() -> std::string {
        const EquilibriumChoices& e = *c.equilibrium;
        if (is_tube(c.shape) || may_have_rim(c.shape) || c.model.free_period || !e.area || !e.volume) return {};
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

template <class Keys>
void keys(Keys& k, Case& c) {
    k.choice("tier", c.tier, {{"axisym", Tier::axisym}, {"surface3d", Tier::surface3d}, {"auto", Tier::automatic}},
             k.required);
    k.table("about", [&](auto& k) {
        k.text("title", c.title);
        k.text("source", c.source);
    });
    k.optional_table("units", c.units, [](auto& k, Units& units) { keys(k, units); });
    k.table("energy", [&](auto& k) { keys(k, c.energy, c.tier); });
    k.table("auto", [&](auto& k) { keys(k, c.automatic); });
    k.table("model", [&](auto& k) { keys(k, c.model, c.tier); });
    k.optional_table("equilibrium", c.equilibrium,
                     [&](auto& k, EquilibriumChoices& e) { keys(k, e, c.model, c.energy); });
    k.table("velocity", [&](auto& k) { keys(k, c.velocity); });
    k.table("shape", [&](auto& k) { keys(k, c.shape); });
    k.table("accuracy", [&](auto& k) { keys(k, c.accuracy); });
    k.table("discretisation", [&](auto& k) {
        if (c.tier != Tier::axisym)
            keys(k, c.surface);
        else if (c.equilibrium)
            k.integer("order", c.discretisation.order, {.from = 3, .to = 7, .step = 2});
        else
            keys(k, c.discretisation);
    });
    if (c.tier == Tier::surface3d && !c.equilibrium) {
        std::optional<TimeSpan> time = c.moves() ? std::optional(c.time) : std::nullopt;
        k.optional_table("time", time, [&](auto& k, TimeSpan& t) { keys(k, t, true); });
        if (time) c.time = *time;
    } else {
        k.table("time", [&](auto& k) { keys(k, c.time, !c.equilibrium); });
    }
    // The shapes of a branch are numbered as if that were their time.
    const double end = c.equilibrium ? std::numeric_limits<int>::max() : c.time.end;
    k.table("expect", [&](auto& k) { keys(k, c.expect, end); });
    check_expected_terms(k, c);
    check_values(k, c);
}

}  // namespace tubule
