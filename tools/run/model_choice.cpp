#include "tools/run/model_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "common/case/read.hpp"
#include "common/run/run_observer.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse.hpp"
#include "surface3d/run/motion_settings.hpp"
#include "tools/auto/choice.hpp"
#include "tools/run/trial_run.hpp"

namespace tubule {
namespace {

// What a pilot may take, in rows (of all its runs) and, should these be slow, in seconds of a processor. A choice of
// the model must be the same each time: rows are counted first.
constexpr int most_rows = 20000, most_rows_of_surface = 600;
constexpr double most_seconds = 20;
// Parts of the fall of the energy, to see whether it speeds up: what grows from little is late by far more than the
// criterion says, since its delays add up.
constexpr double least_parts = 20, most_parts = 1000;
constexpr double rounding = 1e-12;  // of an energy
constexpr double accuracy = 1e-4;   // of the pilots in tier axisym, or better if the case is
constexpr double accuracy_of_surface = 1e-2;
// Measured (docs/decisions/tiers.md, tests/studies/benchmark/model_differences.py): on a length L the viscosity damps
// like a friction of `viscous`/(Re L^2), and slows what friction alone would drive down by the factor 1 +
// `slower`/(gamma Re L^2).
constexpr double viscous = 2, slower = 4.5;

// A model with fewer terms instead of that of a case, its path being the energy over time.
struct SimplerModel {
    ModelKind kind = ModelKind::overdamped;
    // Expected differences from the path of the case, the largest and that at the end, relative to E_ref: in
    // docs/model_differences.csv 0.9 to 6.6 times the measured ones.
    double on_the_way = 0, at_end = 0;
    double seconds = 0;  // that its trial run took: in tier axisym what it takes
    bool rests = false;  // nothing moves
};
struct SimplerModels {
    std::vector<SimplerModel> models;
    std::string unknown;  // why there are none, in words
};

double fall(const EnergyTrace& path) {
    return path.energies().front() - path.energies().back();
}

// Nothing moves: the energy falls by no more than rounding.
bool rests(const EnergyTrace& path) {
    return !(fall(path) > rounding * std::abs(path.energies().front()));
}

double energy_at(const EnergyTrace& path, double time) {
    return path(std::clamp(time, path.times().front(), path.end()));
}

// The largest fall of the energy within this time: what is set in motion lags behind what is not.
double lag(const EnergyTrace& path, double tau) {
    double largest = 0;
    for (int i = 0; i < path.size(); ++i)
        largest = std::max(largest, path.energies()[i] - energy_at(path, path.times()[i] + tau));
    return largest;
}

// The largest difference from the path that is slower by this factor.
double lead(const EnergyTrace& path, double factor) {
    double largest = 0;
    for (int i = 0; i < path.size(); ++i)
        largest = std::max(largest, energy_at(path, path.times()[i] / factor) - path.energies()[i]);
    return largest;
}

// Whether the energy, falling by steps of `part` > 0, needs less than half the time of an earlier step for one of them.
bool speeds_up(const EnergyTrace& path, double part) {
    const std::vector<double>&time = path.times(), &energy = path.energies();
    double since = time.front(), longest = 0;
    int parts = 1;
    for (std::size_t i = 1; i < time.size(); ++i)
        // More parts than there are in the whole fall would only be counted where the energy rises again.
        for (; parts <= 2 * most_parts && energy[i] <= energy[0] - parts * part; ++parts) {
            const double along = (energy[i - 1] - (energy[0] - parts * part)) / (energy[i - 1] - energy[i]);
            const double at = std::lerp(time[i - 1], time[i], along);
            if (at - since < longest / 2) return true;
            longest = std::max(longest, at - since), since = at;
        }
    return false;
}

// The case with this model in the tier that shows its path: tier axisym; of starts that may leave it, tier "auto"; of
// others, few triangles.
Problem pilot_of(const Problem& c, ModelKind kind, bool axisymmetric) {
    Case out = axisymmetric ? c : c.of_surface();
    out.model.kind = kind;
    out.time = {.end = c.time.end, .output = {}, .stationary = {}, .limit = {}};
    out.discretisation = {}, out.surface = {};
    if (axisymmetric) {
        out.accuracy.energy = std::min(c.accuracy.energy, accuracy);
        if (!c.runs_in_tier_axisym()) out.tier = Tier::automatic;
        return out;
    }
    out.surface.elements = surface3d::least_triangles;
    out.accuracy.energy = std::max(c.accuracy.energy, accuracy_of_surface), out.accuracy.estimate = false;
    return out;
}

std::optional<SimplerModel> compared(const Problem& c, ModelKind kind, bool axisymmetric) {
    std::optional<TrialRun> trial;
    try {
        trial.emplace(pilot_of(c, kind, axisymmetric),
                      TrialLimits{axisymmetric ? most_rows : most_rows_of_surface, most_seconds, true});
    } catch (const SolveError&) {
        return {};
    }
    const RunSummary& s = trial->summary;
    const EnergyTrace& path = trial->energies;
    if ((s.stop.reason != Stop::finished && s.stop.reason != Stop::stationary) || path.empty()) return {};
    if (rests(path)) return SimplerModel{.kind = kind, .seconds = trial->seconds, .rests = true};
    if (speeds_up(path, std::clamp(c.accuracy.energy * s.reference_energy / 2, fall(path) / most_parts,
                                   fall(path) / least_parts)))
        return SimplerModel{kind, HUGE_VAL, HUGE_VAL, trial->seconds};
    const double length2 =
        may_have_period(c.shape) ? trial->r_max * trial->r_max : trial->area / (4 * std::numbers::pi);
    const double viscosity = 1 / (c.model.Re * length2), gamma = c.law.friction;
    const double tau = c.law.inertia != 0 ? 1 / (gamma + viscous * viscosity) : 0;
    const double factor = kind == ModelKind::overdamped ? 1 + slower * viscosity / gamma : 1;
    const double at_end = energy_at(path, (path.end() - tau) / factor) - path.energies().back();
    return SimplerModel{kind, (lag(path, tau) + lead(path, factor)) / s.reference_energy, at_end / s.reference_energy,
                        trial->seconds};
}

// Why a path does not tell; empty if it does.
std::string untold(const Problem& c, const Choice& choice) {
    const MotionLaw& law = c.law;
    if (c.velocity.initial != InitialVelocity::rest) return "the case gives a velocity";
    if (law.reservoir || law.free_period || !law.without_loads())
        return "a tension, pressure or force, a reservoir or a free period acts on the membrane";
    if (c.energy.H0_varies() && !c.runs_in_tier_axisym()) return "energy.H0 varies";
    if (!choice.axisymmetric && !choice.start->resizable()) return "the initial shape brings its own triangles";
    return {};
}

// By trial runs of these models: of an axisymmetric start in tier axisym, while no mode m > 0 grows if the case has
// another tier, else on 80 triangles. Nothing is known where a velocity is given, loads or a reservoir act, a start
// brings its own triangles, or a trial run does not come to its end. Where nothing moves the simplest is the only one.
SimplerModels simpler_models(const Problem& c) {
    if (c.law.viscosity == 0) return {{}, "no model is simpler"};
    const Choice choice = c.runs_in_tier_axisym() ? Choice{} : choice_for(c);
    if (std::string why = untold(c, choice); !why.empty()) return {{}, std::move(why)};
    SimplerModels out;
    for (const ModelKind kind : {ModelKind::overdamped, ModelKind::stokes}) {
        if (kind == c.model.kind || (kind == ModelKind::overdamped && !(c.law.friction > 0))) continue;
        const auto one = compared(c, kind, choice.axisymmetric);
        if (one && std::isinf(one->on_the_way)) return {{}, "the fall of the energy speeds up, as where waves grow"};
        if (one) out.models.push_back(*one);
        if (one && one->rests) return out;
    }
    if (out.models.empty())
        out.unknown = choice.axisymmetric && !c.runs_in_tier_axisym()
                          ? "trial runs of simpler models do not come to the end as axisymmetric ones"
                          : "trial runs of simpler models do not come to the end";
    return out;
}

}  // namespace

ModelChoice choose_model(const Problem& given) {
    Case full = given;
    if (given.model.kind == ModelKind::automatic) full.model.kind = ModelKind::fluid;
    const Problem c = full;
    const auto simpler = simpler_models(c);
    if (!simpler.unknown.empty())
        return {c.model.kind, "whether a simpler model does is unknown: " + simpler.unknown, true};
    for (const SimplerModel& m : simpler.models)
        if (m.rests || m.on_the_way <= c.accuracy.energy)
            return {m.kind,
                    m.rests ? fmt::format("nothing moves in a trial run of \"{}\"", model_entry(m.kind).name)
                            : fmt::format("the path of \"{}\" differs by about {:.2g} of E_ref from that of \"{}\"",
                                          model_entry(m.kind).name, m.on_the_way, name(c.model)),
                    false, m.seconds};
    const SimplerModel& best = *std::ranges::min_element(simpler.models, {}, &SimplerModel::on_the_way);
    return {c.model.kind,
            fmt::format("model \"{}\" would differ by about {:.2g} of E_ref on the way, by {:.2g} at the end",
                        model_entry(best.kind).name, best.on_the_way, best.at_end)};
}

ChosenCase with_model(const Problem& c, const ModelChoice& choice) {
    std::vector<std::string> sets = c.sets;
    sets.push_back(fmt::format("model.chosen={}", model_entry(choice.kind).name));
    return {parse_case(c.text, sets, c.path, inputs_of(c)), choice.reason, 0};
}

ChosenCase with_chosen_model(const Problem& c) {
    if (c.model.kind != ModelKind::automatic) return {c, "", 0};
    const PauseWatch watch(c.time.limit, interrupted);
    const double before = watch.seconds();
    ChosenCase out = with_model(c, choose_model(c));
    out.seconds = watch.seconds() - before;
    return out;
}

std::string words_of_choice(const ChosenCase& chosen) {
    return fmt::format("model {}: {}", name(chosen.c.model), chosen.reason);
}

}  // namespace tubule
