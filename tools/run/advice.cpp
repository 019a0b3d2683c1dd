#include "tools/run/advice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "axisym/curve/curve_setup.hpp"
#include "common/run/run_observer.hpp"
#include "surface3d/run/motion_settings.hpp"
#include "tools/auto/choice.hpp"
#include "tools/run/model_choice.hpp"
#include "tools/run/trial_run.hpp"

namespace tubule {
namespace {

constexpr double watch_limit = 3;  // seconds of a processor: a busy machine must not change what is advised
constexpr double watch_accuracy = 1e-3;

std::string reason_of(const RunSummary& s) {
    for (const auto& [name, value] : s.details)
        if (name == "reason") return std::get<std::string>(value);
    return {};
}

// An axisymmetric initial shape runs in tier "axisym" unless modes m > 0 grow.
void choose_tier(const Problem& c, const Forecast& expected, Advice& out) {
    Case watched = c;
    watched.tier = Tier::automatic;
    watched.discretisation = {}, watched.surface = {}, watched.time.limit = {};
    watched.accuracy.energy = std::max(c.accuracy.energy, watch_accuracy);
    const TrialRun trial(watched, {.seconds = watch_limit, .axisymmetric = true});
    const RunSummary& s = trial.summary;
    out.reason = reason_of(s);
    if (s.stop.reason == Stop::interrupted) {
        out.tier = "auto";
        if (!trial.switched) out.reason += fmt::format(", as far as a trial shows, until t = {:.3g}", s.stop.time);
        return;
    }
    out.tier = "axisym";
    const bool of_surface = c.unknowns == Unknowns::moving_surface;
    out.seconds = of_surface ? forecast(c.of_profile(c.time.end, {})).seconds : expected.seconds;
}

void choose_mesh(const Problem& c, const surface3d::Start& start, const Forecast& expected, Advice& out) {
    out.seconds = expected.seconds;
    if (!few_triangles_do(c, start)) return;
    Case given = c.of_surface();
    given.surface.elements = out.elements = surface3d::least_triangles;
    out.seconds = forecast(given).seconds;
    out.reason += ", and is smooth";
}

void advise_model(const Problem& c, Advice& out) {
    const ModelChoice chosen = choose_model(c);
    if (chosen.unknown) return;
    if (chosen.kind != c.model.kind && out.tier == "axisym") out.seconds = chosen.seconds;
    out.model = model_entry(chosen.kind).name;
    out.reason += "; " + chosen.reason;
}

// What only tier axisym has.
bool begins_as_patch(const Problem& c) {
    if (std::holds_alternative<Patch>(c.shape)) return true;
    if (!std::holds_alternative<ResultFrame>(c.shape) || c.tier != Tier::axisym) return false;
    return is_patch(axisym::initial_curve(c).topology);
}

}  // namespace

std::optional<Advice> advice(const Problem& c, const Forecast& expected) {
    if (!c.moves()) return {};
    Advice out;
    if (begins_as_patch(c)) {
        out.tier = "axisym", out.model = name(c.model), out.accuracy = c.accuracy.energy;
        out.seconds = expected.seconds, out.reason = "only this tier has patches";
        advise_model(c, out);
        return out;
    }
    out.tier = "surface3d", out.model = name(c.model), out.accuracy = c.accuracy.energy;
    const Choice choice = choice_for(c);
    if (!choice.axisymmetric) {
        out.reason = choice.reason;
        choose_mesh(c, *choice.start, expected, out);
        return out;
    }
    choose_tier(c, expected, out);
    advise_model(c, out);
    return out;
}

std::string words(const Advice& a) {
    const std::string time = a.seconds ? fmt::format(": some {:.2g} s", std::max(*a.seconds, 0.1)) : "";
    const std::string mesh = a.elements ? fmt::format("{} elements, ", *a.elements) : "";
    return fmt::format("tier {}, model {}, {}accuracy {:g}{}; {}", a.tier, a.model, mesh, a.accuracy, time, a.reason);
}

}  // namespace tubule
