#include "common/shapes/formula_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/geometry/profile_point.hpp"

namespace tubule {
namespace {

constexpr int along = 400, around = 48;  // samples
constexpr double same = 1e-6;            // of the radius: r and its derivatives where the formula should repeat itself

constexpr double least = 1e-100, most = 1e100;  // what can be computed with

bool uses(const FormulaShape& shape, int variable) {
    return std::ranges::any_of(shape.r->steps, [&](const Formula::Step& step) {
        return step.op == Formula::Op::variable && step.number == variable;
    });
}

// The first variable from end to end.
double extent(const FormulaShape& shape) {
    return shape.length.value_or(pi);
}

std::string place(const FormulaShape& shape, double first, double second) {
    const auto& names = shape.length ? FormulaShape::of_tube : FormulaShape::of_cell;
    const std::string out = fmt::format("{} = {:.6g}", names[0], first);
    return uses(shape, 1) ? out + fmt::format(", {} = {:.6g}", names[1], second) : out;
}

std::string not_positive(const FormulaShape& shape) {
    for (int j = 0; j < (uses(shape, 1) ? around : 1); ++j)
        for (int i = 0; i <= along; ++i) {
            const double first = extent(shape) * i / along, second = 2 * pi * j / around;
            const double r = radius_at(shape, first, second);
            if (r > least && r < most) continue;
            if (!std::isfinite(r))
                return fmt::format("must be defined everywhere, but not at {}", place(shape, first, second));
            return fmt::format("must be {} everywhere, but it is {:.6g} at {}",
                               r > 0 ? fmt::format("between {:g} and {:g}", least, most) : "positive", r,
                               place(shape, first, second));
        }
    return {};
}

using J = Jet<double, 1, 2>;

std::string not_repeating(const FormulaShape& shape, bool in_first) {
    const double period = in_first ? extent(shape) : 2 * pi;
    for (int i = 0; i < around; ++i) {
        const double other = (in_first ? 2 * pi : extent(shape)) * i / around;
        const auto at = [&](double x) {
            const J varies = J::variable(x, 0), fixed(other);
            return in_first ? radius_at(shape, varies, fixed) : radius_at(shape, fixed, varies);
        };
        const J a = at(0), b = at(period);
        const double allowed = same * std::abs(a.v);
        const auto& names = shape.length ? FormulaShape::of_tube : FormulaShape::of_cell;
        const double unit = period / (2 * pi);
        if (std::abs(a.v - b.v) > allowed)
            return fmt::format("must repeat itself in {} after {:.6g}, but it is {:.6g} at 0 and {:.6g} there",
                               names[in_first ? 0 : 1], period, a.v, b.v);
        if (std::abs(a.d[0] - b.d[0]) * unit > allowed || std::abs(a.dd[0] - b.dd[0]) * unit * unit > allowed)
            return fmt::format(
                "has a kink where it repeats itself in {}: its slope is {:.4g} at 0 and {:.4g} after "
                "{:.6g}, its second derivative {:.4g} and {:.4g}",
                names[in_first ? 0 : 1], a.d[0], b.d[0], period, a.dd[0], b.dd[0]);
    }
    return {};
}

// At a pole a smooth r depends on phi like r0 + slope . (cos phi, sin phi) times the distance.
std::string pointed(const FormulaShape& shape) {
    for (const double pole : {0.0, pi}) {
        const double r = radius_at(shape, pole, 0.0);
        for (int j = 0; j < around; ++j) {
            const double phi = 2 * pi * j / around;
            const J here = radius_at(shape, J::variable(pole, 0), J(phi)),
                    across = radius_at(shape, J::variable(pole, 0), J(phi + pi));
            if (std::abs(here.v - r) > same * r)
                return fmt::format("must have one value at each pole, but at theta = {:.6g} it is {:.6g} and {:.6g}",
                                   pole, r, here.v);
            if (std::abs(here.d[0] + across.d[0]) > same * r)
                return fmt::format(
                    "has a tip at the pole theta = {:.6g}: there its slope in theta is {:.4g} along one "
                    "meridian and {:.4g} along the opposite one; their sum must be 0",
                    pole, here.d[0], across.d[0]);
        }
    }
    return {};
}

}  // namespace

Asymmetry asymmetry(const FormulaShape& shape) {
    if (!shape.r || !uses(shape, 1)) return {};
    return {"shape.r", fmt::format("must not contain {}: tier \"axisym\" is axisymmetric and has no modes m > 0",
                                   (shape.length ? FormulaShape::of_tube : FormulaShape::of_cell)[1])};
}

Curve meridian(const FormulaShape& shape) {
    require_axisymmetric(shape);
    using J1 = Jet<double, 1, 1>;
    if (shape.length)
        return curve_of(Topology::tube, *shape.length, [shape](const J1& t) {
            const J1 z = *shape.length * t;
            return std::array{radius_at(shape, z, J1(0.0)), z};
        });
    return curve_of(Topology::cell, 0, [shape](const J1& t) {
        const J1 theta = pi * (1.0 - t), r = radius_at(shape, theta, J1(0.0));
        return std::array{r * sin(theta), r * cos(theta)};
    });
}

double mean_radius(const FormulaShape& shape) {
    double sum = 0;
    for (int i = 0; i < along; ++i) sum += radius_at(shape, extent(shape) * (i + 0.5) / along, 0.0);
    return sum / along;
}

Neck narrowest(const FormulaShape& shape) {
    Neck best{0, std::numeric_limits<double>::infinity()};
    if (!shape.r || !shape.length) return best;
    for (int i = 0; i < along; ++i) {
        const double z = *shape.length * i / along, r = radius_at(shape, z, 0.0);
        if (r < best.radius) best = {z, r};
    }
    return best;
}

std::string complaint(const FormulaShape& shape) {
    if (!shape.r) return {};
    std::string out = not_positive(shape);
    if (out.empty() && shape.length) out = not_repeating(shape, true);
    if (out.empty() && uses(shape, 1)) out = not_repeating(shape, false);
    if (out.empty() && !shape.length) out = pointed(shape);
    return out;
}

}  // namespace tubule
