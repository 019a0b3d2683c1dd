#include "common/energy/potential.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace tubule {
namespace {

// Morse: w (exp(-2 s) - 2 exp(-s)) with s = d/range - 1; 9-3: w/2 ((range/d)^9 - 3 (range/d)^3).
std::string text_of(const Potential& p, const char* r2) {
    if (!p.is_wall()) return "(" + p.formula->text + ")";
    const std::string z = fmt::format("(z - ({:.17g}))", p.z),
                      outside = p.kind == Potential::Kind::plane
                                    ? z
                                    : fmt::format("(sqrt({} + {}^2) - {:.17g})", r2, z, p.radius),
                      d = p.behind ? "(-" + outside + ")" : outside;
    if (p.law == Potential::Law::morse) {
        const std::string s = fmt::format("({}/{:.17g} - 1)", d, p.range);
        return fmt::format("({:.17g})*(exp(-2*{}) - 2*exp(-{}))", p.strength, s, s);
    }
    const std::string x = fmt::format("({:.17g}/{})", p.range, d);
    return fmt::format("({:.17g})*({}^9 - 3*{}^3)", p.strength / 2, x, x);
}

std::optional<Formula> sum_of(std::span<const Potential> potentials, const char* r2,
                              std::span<const std::string_view> variables) {
    if (potentials.empty()) return std::nullopt;
    std::string text;
    for (const Potential& p : potentials) text += (text.empty() ? "" : " + ") + text_of(p, r2);
    return parse_formula(text, variables);
}

}  // namespace

double Potential::distance(double r, double z_at) const {
    const double outside = kind == Kind::plane ? z_at - z : std::hypot(r, z_at - z) - radius;
    return behind ? -outside : outside;
}

std::optional<Formula> potential_density(std::span<const Potential> potentials) {
    return sum_of(potentials, "r^2", Potential::variables);
}

std::optional<Formula> potential_density_in_space(std::span<const Potential> potentials) {
    return sum_of(potentials, "x^2 + y^2", Potential::in_space);
}

}  // namespace tubule
