// Shape "formula": with a length, one period of a tube r(z, theta); without, a closed surface r(theta, phi) about the
// origin, theta being the angle from the z axis.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/formula/formula.hpp"
#include "common/geometry/surface_point.hpp"
#include "common/shapes/curve.hpp"
#include "common/shapes/tube.hpp"

namespace tubule {

struct FormulaShape {
    static constexpr const char* kind = "formula";
    static constexpr std::array<std::string_view, 2> of_tube{"z", "theta"}, of_cell{"theta", "phi"};
    std::shared_ptr<const Formula> r;
    std::optional<double> length;
};

// r where the variables of the formula are (first, second). S is double or a Jet.
template <class S>
S radius_at(const FormulaShape& shape, const S& first, const S& second) {
    const S variables[]{first, second};
    return evaluate(*shape.r, variables);
}

// The point at the height and on the meridian of p, or in its direction.
template <class S>
Vector3<S> position(const FormulaShape& shape, const Vector3<S>& p) {
    using std::atan2, std::sqrt;
    Vector3<S> at = p;
    const double along = std::hypot(scalar_part(p[0]), scalar_part(p[1])), size = along + std::abs(scalar_part(p[2]));
    if (along < 1e-9 * size) at[0] = at[0] + 1e-9 * size;  // angles have no derivatives on the axis
    const S rho = sqrt(S(at[0] * at[0] + at[1] * at[1])), around = atan2(at[1], at[0]);
    if (shape.length) {
        const S scale = radius_at(shape, at[2], around) * inverse(rho);
        return {at[0] * scale, at[1] * scale, p[2]};
    }
    const S r = radius_at(shape, S(atan2(rho, at[2])), around);
    return p * S(r * inverse_sqrt(S(p.dot(p))));
}
Asymmetry asymmetry(const FormulaShape& shape);
Curve meridian(const FormulaShape& shape);
// The average of r along the meridian theta = 0.
double mean_radius(const FormulaShape& shape);
// The smallest r of a tube over the meridian theta = 0, to about the distance of samples; infinite of closed surfaces.
Neck narrowest(const FormulaShape& shape);

// Why this is no surface, worded to follow "shape.r": it is not defined, not positive, does not repeat itself, or has a
// tip at a pole. Empty if it is one.
std::string complaint(const FormulaShape& shape);

template <class Keys>
void keys(Keys& k, FormulaShape& shape) {
    k.number("length", shape.length, {.above = 0});
    k.formula("r", shape.r, shape.length ? FormulaShape::of_tube : FormulaShape::of_cell, k.required);
    k.check("r", [&] { return complaint(shape); });
}

}  // namespace tubule
