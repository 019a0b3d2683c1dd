// Table [equilibrium]: a case whose answer is a stationary shape, or a branch of them, instead of a motion.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/energy/bending.hpp"
#include "common/model/model.hpp"

namespace tubule {

// What is held fixed while the energy becomes stationary.
enum class Held { area_and_volume, area, volume, reduced_volume, nothing };

// Families of vesicles, by which the search may begin instead of at the shape of the case.
enum class Family { prolate, oblate, stomatocyte, pear };

// What a branch is followed in: the moduli by the number of their term, or these.
inline constexpr int vary_H0 = -1, vary_area = -2, vary_volume = -3, vary_reduced_volume = -4, vary_tension = -5,
                     vary_pressure = -6, vary_force = -7, vary_alpha = -8, vary_M0 = -9, vary_extension = -10,
                     vary_height = -11,  // of the second ring of a patch
    vary_kg = -12, vary_strength = -13;  // of potential 0; of potential i, i less

struct BranchChoices {
    std::optional<int> parameter;  // absent: one shape only
    std::optional<double> to, step;
    std::optional<int> mode;  // it bifurcates from the first shape along this mode, 1 the lowest
    bool branches = false;    // also those that bifurcate from it, one after another
    // Amplitude of the mode where a bifurcating branch begins, over the radius of a sphere of this area.
    std::optional<double> amplitude;
};

// Words if a branch has no shapes, or too many; else empty.
inline std::string wrong_branch(double from, double to, double step) {
    constexpr int most = 10000;
    const double steps = std::max(0.0, std::ceil(std::abs(to - from) / step - 1e-9));
    if (steps >= 1 && steps <= most) return {};
    return fmt::format("from {} to {} by {} makes {:.7g} steps; the number must be 1 to {}", from, to, step, steps,
                       most);
}

struct EquilibriumChoices {
    std::optional<Held> held;                            // by default what [model] leaves: default_held()
    std::optional<double> area, volume, reduced_volume;  // where absent: those of the initial shape
    std::optional<Family> family;                        // where the search begins; absent: at [shape]
    bool descend = true;                                 // to a minimum; if not, to the closest stationary shape
    std::optional<int> rates;  // of tier surface3d: growth rates of the slowest modes, this many
    std::optional<int> modes;  // stability against e^{i m theta}, m = 0 ... modes, by the dissipation of [model]
    BranchChoices branch;
};

constexpr bool holds_area(Held held) {
    return held == Held::area || held == Held::area_and_volume;
}
constexpr bool holds_volume(Held held) {
    return held == Held::volume || held == Held::area_and_volume;
}

// Area and volume, unless the model leaves them free, or gives a tension or a pressure.
inline Held default_held(const Model& model) {
    const bool area = model.area.value_or(AreaRule::fixed) == AreaRule::fixed && model.tension.is_zero(),
               volume = model.keeps_volume.value_or(true) && !model.has_pressure();
    return area && volume ? Held::area_and_volume : area ? Held::area : volume ? Held::volume : Held::nothing;
}

// What [equilibrium] holds against what [model] says: "" or the complaint about `held`.
inline std::string held_against(const Model& model, Held held) {
    const auto clash = [](const char* what, const char* key) { return std::string("must ") + what + ": see " + key; };
    const bool area = holds_area(held), volume = holds_volume(held), reduced = held == Held::reduced_volume;
    const bool wants_area = model.area == AreaRule::fixed, frees_area = model.area && !wants_area,
               loads_area = !model.tension.is_zero(), wants_volume = model.keeps_volume == true,
               frees_volume = model.keeps_volume == false, loads_volume = model.has_pressure();
    if (wants_area && !area) return clash("hold the area", "model.area");
    if (wants_volume && !volume) return clash("hold the volume", "model.volume");
    if (frees_area && area) return clash("leave the area free", "model.area");
    if (frees_volume && volume) return clash("leave the volume free", "model.volume");
    if (loads_area && (area || reduced)) return clash("leave the area free", "model.tension");
    if (loads_volume && (volume || reduced)) return clash("leave the volume free", "model.pressure");
    return {};
}

// The keys of [equilibrium] for this model and energy; see common/case/keys.hpp. Long: a line for each key and each
// condition.
template <class Keys>
void keys(Keys& k, EquilibriumChoices& e, const Model& model, const Bending& energy) {
    k.choice("held", e.held,
             {{"area-and-volume", Held::area_and_volume},
              {"area", Held::area},
              {"volume", Held::volume},
              {"reduced-volume", Held::reduced_volume},
              {"nothing", Held::nothing}});
    k.number("area", e.area, {.above = 0});
    k.number("volume", e.volume, {.above = 0});
    k.number("reduced_volume", e.reduced_volume, {.above = 0, .to = 1});
    k.choice("family", e.family,
             {{"prolate", Family::prolate},
              {"oblate", Family::oblate},
              {"stomatocyte", Family::stomatocyte},
              {"pear", Family::pear}});
    k.flag("descend", e.descend);
    k.integer("modes", e.modes, {.from = model.free_period ? 1.0 : 0.0, .to = 100});
    k.integer("rates", e.rates, {.from = 1, .to = 200});
    const Held held = e.held.value_or(default_held(model));
    k.check("held", [&]() -> std::string {
        if (const std::string clash = held_against(model, held); !clash.empty() || !model.free_period) return clash;
        if (holds_area(held) || holds_volume(held)) return {};
        return "must hold the area or the volume where model.period is \"free\"";
    });
    const char* not_held = "is not held fixed: see equilibrium.held";
    const bool area = holds_area(held), volume = holds_volume(held),
               reduced = held == Held::reduced_volume || held == Held::area_and_volume;
    k.check("area", [&] { return e.area && !area ? not_held : ""; });
    k.check("volume", [&] { return e.volume && !volume ? not_held : ""; });
    k.check("reduced_volume", [&] {
        if (e.reduced_volume && !reduced) return not_held;
        return e.reduced_volume && e.volume ? "cannot be combined with equilibrium.volume" : "";
    });
    k.check("family",
            [&] { return e.family && !reduced ? "needs area and volume, or the reduced volume, to be held" : ""; });
    k.table("branch", [&](auto& k) {
        std::vector<std::pair<std::string, int>> parameters;
        for (std::size_t i = 0; i < count_terms(energy); ++i)
            parameters.emplace_back(term_key(energy, i), static_cast<int>(i));
        parameters.insert(parameters.end(), {{"energy.H0", vary_H0},
                                             {"energy.kg", vary_kg},
                                             {"energy.alpha", vary_alpha},
                                             {"energy.M0", vary_M0},
                                             {"equilibrium.area", vary_area},
                                             {"equilibrium.volume", vary_volume},
                                             {"equilibrium.reduced_volume", vary_reduced_volume},
                                             {"model.tension", vary_tension},
                                             {"model.pressure", vary_pressure},
                                             {"model.force", vary_force},
                                             {"model.extension", vary_extension},
                                             {"shape.height", vary_height}});
        for (std::size_t i = 0; i < energy.potentials.size(); ++i)
            if (energy.potentials[i].is_wall())
                parameters.emplace_back(fmt::format("energy.potential.{}.strength", i),
                                        vary_strength - static_cast<int>(i));
        k.choice("vary", e.branch.parameter, parameters);
        k.number("to", e.branch.to);
        k.number("step", e.branch.step, {.above = 0});
        k.integer("mode", e.branch.mode, {.from = 1, .to = 100});
        k.number("amplitude", e.branch.amplitude, {.above = 0, .to = 0.5});
        k.flag("branches", e.branch.branches);
        k.check("amplitude", [&] {
            const bool used = e.branch.mode || e.branch.branches;
            return e.branch.amplitude && !used ? "is where a bifurcating branch begins: see mode and branches" : "";
        });
        k.check("", [&] {
            const BranchChoices& b = e.branch;
            if (!b.parameter)
                return b.to || b.step || b.mode || b.branches ? "needs vary: the key that changes along the branch"
                                                              : "";
            if (!b.to || !b.step) return "needs to and step: the end of the branch and the distance between shapes";
            if (*b.parameter == vary_alpha || *b.parameter == vary_M0)
                return energy.alpha ? "" : "varies what the energy does not have: see energy.alpha";
            if (*b.parameter == vary_extension)
                return model.extension ? "" : "varies a distance that is not held: see model.extension";
            if (*b.parameter == vary_force && model.bead_width)
                return model.extension ? "varies a force at a given distance: see model.extension" : "";
            if (*b.parameter == vary_force)
                return model.free_period ? "" : "varies a force at a fixed period: see model.period";
            if (*b.parameter == vary_tension || *b.parameter == vary_pressure) {
                const bool fixed = *b.parameter == vary_tension ? area : volume;
                if (*b.parameter == vary_pressure && model.pressure_of_volume)
                    return "varies a formula: give a number, or vary something else";
                return fixed || held == Held::reduced_volume
                           ? "varies the tension or pressure of what is held: see equilibrium.held"
                           : "";
            }
            const bool is_held = *b.parameter == vary_area             ? area
                                 : *b.parameter == vary_volume         ? volume && !e.reduced_volume
                                 : *b.parameter == vary_reduced_volume ? reduced && !e.volume
                                                                       : true;
            return is_held ? "" : "varies a quantity that is not held fixed: see equilibrium.held";
        });
    });
}

}  // namespace tubule
