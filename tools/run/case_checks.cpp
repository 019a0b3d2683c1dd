#include "tools/run/case_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <set>
#include <utility>
#include <variant>

#include "common/energy/principal_symbol.hpp"
#include "common/run/energy_checks.hpp"
#include "surface3d/run/start.hpp"

namespace tubule {
namespace {

constexpr int triangles = 500, order = 2;  // whose nodes are looked at
// The symbol is negative for certain below this part of the sizes of its terms: far above rounding, and near enough
// to 0 that every run that can be computed ends there.
constexpr double certain = 1e-3;

bool may_be_known(const Problem& c) {
    const bool by_points = std::holds_alternative<MeshFile>(c.shape) || std::holds_alternative<ResultFrame>(c.shape);
    return c.moves() && c.unknowns != Unknowns::automatic && !c.handover && !by_points && !c.energy.H0_varies() &&
           symbol_may_vanish(c.energy);
}

// Curvatures between which waves are looked for: of all directions or, in tier axisym, of those along the profile,
// across which the curvature is that around the axis.
std::array<double, 2> across(const Problem& c, const surface3d::CurvatureField& exact, const Eigen::Vector3d& x,
                             int i) {
    const double mean = exact.H[i] / 2, apart = std::sqrt(std::max(mean * mean - exact.K[i], 0.0));
    const double r = std::hypot(x.x(), x.y());
    if (!c.runs_in_tier_axisym() || apart < 1e-8 * std::abs(mean)) return {mean - apart, mean + apart};
    const double around = -(exact.normal(0, i) * x.x() + exact.normal(1, i) * x.y()) / (r * r);
    return {around, around};
}

struct Worst {
    double symbol = 0, part = 0;  // of the sizes of its terms
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
};

std::string place_of(const Eigen::Vector3d& x) {
    return fmt::format("r = {:.4g}, z = {:.4g}", std::hypot(x.x(), x.y()), x.z());
}

// A formula that has no value somewhere says nothing about the symbol.
std::optional<CaseError> formula_without_value(const Problem& c, const surface3d::StartMesh& start) {
    const std::string key = key_of_formula(c.energy);
    if (key == "energy") return std::nullopt;
    DensityDomain domain(c.energy);
    for (int i = 0; i < start.mesh.size() && domain.restricted(); ++i)
        domain.look(c.energy.H0, start.exact->H[i], start.exact->K[i], i);
    const FormulaDomain::Margin margin = domain.margin();
    if (margin.is_small())
        return not_defined(c, margin, place_of(start.mesh.nodes[static_cast<std::size_t>(margin.place)]));
    for (int i = 0; i < start.mesh.size(); ++i) {
        const double H = start.exact->H[i], K = start.exact->K[i];
        const CurvatureJet<double> f = density(c.energy, H, K);
        if (!std::isfinite(f.f + f.H + f.K + f.HH + f.HK + f.KK))
            return complaint(
                c, key,
                fmt::format("must be finite on the initial shape, but at {}, where H = {:.4g} and K = {:.4g}, it "
                            "or a derivative of it overflows",
                            place_of(start.mesh.nodes[i]), H, K));
    }
    return std::nullopt;
}

Worst worst_of(const Problem& c, const surface3d::StartMesh& start) {
    Worst worst;
    for (int i = 0; i < start.mesh.size(); ++i) {
        const auto [low, high] = across(c, *start.exact, start.mesh.nodes[i], i);
        const CurvatureJet<double> f = density(c.energy, start.exact->H[i], start.exact->K[i]);
        const double symbol = least_principal_symbol(f, low, high), x = std::max(std::abs(low), std::abs(high));
        const double part = symbol / (std::abs(f.HH) + x * (2 * std::abs(f.HK) + x * std::abs(f.KK)));
        if (part < worst.part) worst = {symbol, part, start.mesh.nodes[i]};
    }
    return worst;
}

}  // namespace

CaseError ill_posed_complaint(const Problem& c, const std::string& outcome, const std::string& why) {
    const std::string key = key_of_ill_posed(c);
    return complaint(
        c, key,
        fmt::format("makes the problem ill-posed at the initial shape, {}: {}; {}", outcome, why,
                    key == "energy.k20" ? "it must be above 0, unless energy.k40 or energy.k42 make up for it"
                    : key == "energy"   ? "bring its moduli nearer to 0, or make energy.k20 larger"
                                        : "bring it nearer to 0, or make energy.k20 larger"));
}

std::optional<CaseError> ill_posed_start(const Problem& c) {
    if (!may_be_known(c) || c.expect.stop == Stop::ill_posed) return std::nullopt;
    Case shape = c.of_surface();
    shape.surface = {};
    shape.surface.recovery = Recovery::exact;
    try {
        const surface3d::StartMesh start = surface3d::Start(shape).mesh(triangles, order);
        if (auto without = formula_without_value(c, start)) return without;
        const Worst worst = worst_of(c, start);
        if (!(worst.part < -certain)) return std::nullopt;
        return ill_posed_complaint(c, "and nothing is run",
                                   fmt::format("the principal symbol f_HH + 2 f_HK x + f_KK x^2 is {:.3g} at {}",
                                               worst.symbol, place_of(worst.at)));
    } catch (const std::exception&) {  // the start cannot be meshed: its run says so
        return std::nullopt;
    }
}
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
    if (c.energy.H0_varies() || !(c.energy.H0 > 0)) return {};
    if (std::holds_alternative<Ellipsoid>(c.shape) || ((tube || sphere) && c.is_equilibrium()))
        return note(c, "energy.H0",
                    fmt::format("= {0:g} is positive, but H is negative where a surface is convex: Helfrich's "
                                "spontaneous curvature c0 = {0:g} is H0 = -{0:g}",
                                c.energy.H0));
    if (!tube && !sphere) return {};
    const double H = tube ? -1 / tube->radius : -2 / sphere->radius;
    return note(c, "energy.H0",
                fmt::format("= {:g} is positive, but H is negative on a {}: {} = {:.4g} here. H0 = {:.4g} would be "
                            "the H of this shape",
                            c.energy.H0, tube ? "tube" : "sphere", tube ? "-1/radius" : "-2/radius", H, H));
}

}  // namespace

std::vector<std::string> physics_notes(const Problem& c) {
    std::vector<std::string> notes{frozen_wave(c), sign_of_H0(c)};
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
        "smoother initial shape, more elements or a {} make it smaller",
        std::abs(identity_defect), part, c.surface.step ? "smaller discretisation.step" : "tighter accuracy.energy");
}

}  // namespace tubule
