// Shape "ellipsoid": half axes a, b, c along x, y, z.
#pragma once

#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "common/geometry/surface_point.hpp"
#include "common/shapes/base_surface.hpp"
#include "common/shapes/curve.hpp"

namespace tubule {

struct Ellipsoid {
    static constexpr const char* kind = "ellipsoid";
    double a = 1, b = 1, c = 1;
};

// The image of the point of the unit sphere in the direction of p.
template <class S>
Vector3<S> position(const Ellipsoid& e, const Vector3<S>& p) {
    const S scale = inverse_sqrt(S(p.dot(p)));
    return {e.a * (p[0] * scale), e.b * (p[1] * scale), e.c * (p[2] * scale)};
}
inline UnitSphere base(const Ellipsoid&) {
    return {};
}
inline Asymmetry asymmetry(const Ellipsoid& e) {
    if (e.a == e.b) return {};
    return {"shape.b", fmt::format("must be a = {}, not {}: tier \"axisym\" is axisymmetric about z", e.a, e.b)};
}
inline Curve meridian(const Ellipsoid& e) {
    require_axisymmetric(e);
    return sphere_image(e);
}

inline double volume(const Ellipsoid& e) {
    return 4 * pi / 3 * e.a * e.b * e.c;
}
// INT K^2 dS: theory.md (7.3).
inline double integral_K2(const Ellipsoid& e) {
    const double a = e.a * e.a, b = e.b * e.b, c = e.c * e.c;
    return 4 * pi * (3 * (a * a + b * b + c * c) + 2 * (a * b + b * c + c * a)) / (15 * a * b * c);
}

template <class Keys>
void keys(Keys& k, Ellipsoid& e) {
    k.number("a", e.a, {.above = 0}, k.required);
    k.number("b", e.b, {.above = 0}, k.required);
    k.number("c", e.c, {.above = 0}, k.required);
}

}  // namespace tubule
