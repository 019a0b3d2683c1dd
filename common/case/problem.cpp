#include "common/case/problem.hpp"

#include <cctype>
#include <memory>
#include <string>
#include <utility>

#include "common/case/read.hpp"

namespace tubule {
namespace {

constexpr double high_accuracy = 1e-4;  // from here on, without inertia, steps of higher order pay

Unknowns unknowns_of(const Case& c) {
    if (c.equilibrium) return c.tier == Tier::surface3d ? Unknowns::surface_equilibrium : Unknowns::equilibrium;
    if (c.tier == Tier::automatic) return Unknowns::automatic;
    if (c.tier == Tier::surface3d) return c.moves() ? Unknowns::moving_surface : Unknowns::surface;
    return begins_as_graph(c) ? Unknowns::graph : Unknowns::curve;
}

Scheme scheme_of(const Case& c, bool inertia) {
    if (c.surface.scheme) return *c.surface.scheme;
    if (!inertia && c.accuracy.energy < high_accuracy) return scheme_named("bdf");
    return default_scheme(inertia);
}

// The order of curved triangles. Those of a file are measured by fits through its points, which order 4 makes no
// better.
int default_order(const Case& c) {
    const bool measured = !c.moves() && !c.equilibrium;
    return measured && std::holds_alternative<MeshFile>(c.shape) ? 3 : 4;
}

// A formula of r and z as one of x, y and z.
std::shared_ptr<const Formula> in_space(const Formula& of_profile) {
    // sqrt has no derivatives at the axis: this has, and even powers of r are right to rounding.
    const std::string r = "sqrt(x^2 + y^2 + 1e-20)", &from = of_profile.text;
    const auto is_letter = [&](std::size_t at) {
        return at < from.size() && std::isalpha(static_cast<unsigned char>(from[at]));
    };
    std::string text;
    for (std::size_t i = 0; i < from.size(); ++i)
        if (from[i] == 'r' && !is_letter(i - 1) && !is_letter(i + 1))
            text += r;
        else
            text += from[i];
    return std::make_shared<const Formula>(parse_formula(text, Potential::in_space));
}

}  // namespace

Problem::Problem(Case c)
    : Case(std::move(c)),
      unknowns(unknowns_of(*this)),
      law(motion_law(model)),
      held((equilibrium ? equilibrium->held : std::nullopt).value_or(default_held(model))),
      scheme(scheme_of(*this, law.inertia != 0)),
      element_order(surface.order.value_or(default_order(*this))),
      begin_time(handover ? handover->time : 0) {}

bool Problem::runs_in_tier_axisym() const {
    switch (unknowns) {
        case Unknowns::graph:
        case Unknowns::curve:
        case Unknowns::equilibrium:
            return true;
        default:
            return false;
    }
}

Problem Problem::of_profile(double end, std::vector<double> output) const {
    Case out = *this;
    out.tier = Tier::axisym;
    out.time.end = end, out.time.output = std::move(output);
    return out;
}

Problem Problem::of_surface() const {
    if (law.source.force[0] || law.source.force[1])
        throw complaint(*this, "model.source",
                        "must have no force_r and no force_theta where a case goes on in tier surface3d, which has "
                        "force_x and force_y instead");
    Case out = *this;
    out.tier = Tier::surface3d;
    for (Potential& p : out.energy.potentials)
        if (p.formula && tier != Tier::surface3d) p.formula = in_space(*p.formula);
    return out;
}

}  // namespace tubule
