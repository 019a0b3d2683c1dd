#include "tools/run/advice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <variant>

#include "common/run/run.hpp"
#include "common/solve/interrupt.hpp"
#include "surface3d/run/motion_settings.hpp"
#include "surface3d/run/motion_start.hpp"
#include "tools/auto/auto_run.hpp"
#include "tools/run/forecast.hpp"
#include "tools/run/model_advice.hpp"

namespace tubule {
namespace {

constexpr double watch_limit = 3;  // seconds of a processor: a busy machine must not change what is advised
constexpr double watch_accuracy = 1e-3;
// So few triangles are accurate to `few_reach` where they have the energy of the start to `few_start`: of the scenes of
// docs/both_tiers and of tests/command/advice_study.py those with 3e-4 and less are, while a neck with 1.3e-3 states no
// error and a rough fluid with 3e-3 is lost.
constexpr int few = surface3d::least_triangles;
constexpr double few_reach = 1e-2, few_start = 5e-4;

// Ends a run of tier "auto" that takes long, or goes on in three dimensions.
class Brief : public RunObserver {
public:
    bool interrupted() override { return tubule::interrupted() || switched || std::clock() > end_; }
    void note(const std::string&) override { switched = true; }
    bool switched = false;

private:
    std::clock_t end_ = std::clock() + static_cast<std::clock_t>(watch_limit * CLOCKS_PER_SEC);
};

std::string reason_of(const RunSummary& s) {
    for (const auto& [name, value] : s.details)
        if (name == "reason") return std::get<std::string>(value);
    return {};
}

// Of an axisymmetric start: "axisym" unless waves around the axis grow.
void choose_tier(const Case& c, const Choice& choice, const Forecast& expected, Advice& out) {
    Case watched = c;
    watched.tier = Tier::automatic;
    watched.discretisation = {}, watched.surface = {}, watched.time.limit = {};
    watched.accuracy.energy = std::max(c.accuracy.energy, watch_accuracy);
    Brief brief;
    const RunSummary s = run_auto(watched, choice, brief, nullptr, nullptr);
    out.reason = reason_of(s);
    if (s.stop.reason == Stop::interrupted) {
        out.tier = "auto";
        if (!brief.switched) out.reason += fmt::format(", as far as a trial shows, until t = {:.3g}", s.stop.time);
        return;
    }
    out.tier = "axisym";
    out.seconds = c.tier == Tier::surface3d ? forecast(axisym_case(c, c.time.end, {})).seconds : expected.seconds;
}

// Two digits.
std::string number(double value) {
    return fmt::format("{:.2g}", value);
}

bool few_triangles_do(const Case& c, const surface3d::Start& start) {
    if (c.accuracy.energy < few_reach || !start.resizable() || c.surface.order) return false;
    const surface3d::StartMesh mesh = start.mesh(few, element_order(c));
    const surface3d::Observables o = surface3d::observe_start(c, mesh);
    const double energy = surface3d::free_energy(c, o, mesh.mesh.period);
    return surface3d::error_of_start(c, start, few, energy) <=
           few_start * surface3d::reference_energy(c, o, mesh.mesh.period);
}

void choose_mesh(const Case& c, const surface3d::Start& start, const Forecast& expected, Advice& out) {
    out.seconds = expected.seconds;
    if (!few_triangles_do(c, start)) return;
    Case given = surface_case(c);
    given.surface.elements = out.elements = few;
    out.seconds = forecast(given).seconds;
    out.reason += ", and is smooth";
}

void choose_model(const Case& c, Advice& out) {
    const auto simpler = simpler_models(c);
    if (simpler.empty()) return;
    for (const SimplerModel& m : simpler)
        if (m.on_the_way <= c.accuracy.energy) {
            out.model = model_entry(m.kind).name;
            if (out.tier == "axisym") out.seconds = m.seconds;
            out.reason += fmt::format("; the path of \"{}\" differs by about {} of E_ref from that of \"{}\"",
                                      out.model, number(m.on_the_way), name(c.model));
            return;
        }
    const SimplerModel& best = *std::min_element(
        simpler.begin(), simpler.end(), [](const auto& a, const auto& b) { return a.on_the_way < b.on_the_way; });
    out.reason += fmt::format("; model \"{}\" would differ by about {} of E_ref on the way, by {} at the end",
                              model_entry(best.kind).name, number(best.on_the_way), number(best.at_end));
}

}  // namespace

std::optional<Advice> advice(const Case& c, const Forecast& expected) {
    if (!c.moves()) return {};
    Advice out;
    out.tier = "surface3d", out.model = name(c.model), out.accuracy = c.accuracy.energy;
    const Choice choice = choice_for(c);
    if (!choice.axisymmetric) {
        out.reason = choice.reason;
        choose_mesh(c, *choice.start, expected, out);
        return out;
    }
    choose_tier(c, choice, expected, out);
    choose_model(c, out);
    return out;
}

std::string words(const Advice& a) {
    const std::string time = a.seconds ? fmt::format(": some {} s", number(std::max(*a.seconds, 0.1))) : "";
    const std::string mesh = a.elements ? fmt::format("{} elements, ", *a.elements) : "";
    return fmt::format("tier {}, model {}, {}accuracy {:g}{}; {}", a.tier, a.model, mesh, a.accuracy, time, a.reason);
}

}  // namespace tubule
