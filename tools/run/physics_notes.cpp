#include "tools/run/physics_notes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>
#include <utility>
#include <variant>

namespace tubule {
namespace {

constexpr double large = 3;  // of what the error may be

std::string note(const Problem& c, const std::string& key, const std::string& words) {
    const auto place = c.places.find(key);
    return fmt::format("{}: note: {} {}", place == c.places.end() ? c.path : place->second, key, words);
}

// theory.md (5.14), (5.15): area, volume and length together keep the sum of the squares of all amplitudes, each with
// its own weight.
std::string frozen_wave(const Problem& c) {
    const auto* tube = std::get_if<Tube>(&c.shape);
    const MotionLaw& law = c.law;
    if (!tube || !c.moves() || law.area_is_free() || !law.keeps_volume || law.free_period) return {};
    std::set<std::pair<int, int>> waves;
    for (const TubeMode& mode : tube->modes)
        if (mode.amplitude != 0 && (mode.n != 0 || mode.m != 0)) waves.emplace(mode.n, std::abs(mode.m));
    if (waves.size() != 1) return {};
    return note(c, "shape.mode",
                fmt::format("is a single wave, and can hardly move: area, volume and length are fixed, and together "
                            "they determine its amplitude. Add a second wave or [[shape.noise]], or free one of the "
                            "three: model.volume = \"free\", model.area = \"{}\" or model.period = \"free\"",
                            law.inextensible ? "reservoir" : "free"));
}

std::string sign_of_H0(const Problem& c) {
    const auto* tube = std::get_if<Tube>(&c.shape);
    const auto* sphere = std::get_if<Sphere>(&c.shape);
    if ((!tube && !sphere) || c.is_equilibrium() || c.energy.H0_varies() || !(c.energy.H0 > 0))
        return {};
    const double H = tube ? -1 / tube->radius : -2 / sphere->radius;
    return note(c, "energy.H0",
                fmt::format("= {:g} is positive, but H is negative on a {}: {} = {:.4g} here. H0 = {:.4g} would be "
                            "the H of this shape",
                            c.energy.H0, tube ? "tube" : "sphere", tube ? "-1/radius" : "-2/radius", H, H));
}

std::string renamed_key(const Problem& c) {
    if (!c.places.contains("discretisation.time_order")) return {};
    return note(
        c, "discretisation.time_order",
        fmt::format("= {} is read as time.max_order = {}, its new name, of IDA; the next version does not read it",
                    c.time.max_order, c.time.max_order));
}

}  // namespace

std::vector<std::string> physics_notes(const Problem& c) {
    std::vector<std::string> notes{frozen_wave(c), sign_of_H0(c), renamed_key(c)};
    std::erase(notes, "");
    return notes;
}

std::string balance_warning(const Problem& c, const RunSummary& s, double identity_defect) {
    const double part = std::abs(identity_defect) / s.reference_energy;
    const double allowed = std::max(c.accuracy.energy, s.error_is_known() ? s.estimated_error : 0);
    if (!(s.reference_energy > 0) || !(part > large * allowed)) return {};
    return fmt::format(
        "the energy balance is off by {:.2g}, {:.2g} of E_ref (series identity_defect): so much energy came or went "
        "with the mesh and the steps, not with the membrane, and times and energies are uncertain by as much; a "
        "smoother initial shape, more elements or a tighter accuracy.energy make it smaller",
        std::abs(identity_defect), part);
}

}  // namespace tubule
