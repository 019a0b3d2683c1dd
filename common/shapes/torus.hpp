// Shape "torus": a tube of radius `tube_radius` around the circle of radius `radius` in the plane z = 0.
#pragma once

#include <cmath>
#include <string>

#include "common/geometry/profile_point.hpp"
#include "common/geometry/surface_point.hpp"
#include "common/shapes/curve.hpp"

namespace tubule {

struct Torus {
    static constexpr const char* kind = "torus";
    double radius = 2, tube_radius = 1;
};

// The point of the torus nearest to p.
template <class S>
Vector3<S> position(const Torus& torus, const Vector3<S>& p) {
    const S inverse_rho = inverse_sqrt(S(p[0] * p[0] + p[1] * p[1]));
    const S cosine = p[0] * inverse_rho, sine = p[1] * inverse_rho;
    const S along = p[0] * cosine + p[1] * sine - torus.radius;
    const S scale = torus.tube_radius * inverse_sqrt(S(along * along + p[2] * p[2]));
    const S rho = along * scale + torus.radius;
    return {rho * cosine, rho * sine, p[2] * scale};
}
inline Torus base(const Torus& torus) {
    return torus;
}
inline Curve meridian(const Torus& torus) {
    return curve_of(Topology::tube, 0, [torus](const auto& t) {
        const auto angle = 2 * pi * t;
        return std::array{torus.radius + torus.tube_radius * cos(angle), torus.tube_radius * sin(angle)};
    });
}

inline double area(const Torus& t) {
    return 4 * pi * pi * t.radius * t.tube_radius;
}
inline double volume(const Torus& t) {
    return 2 * pi * pi * t.radius * t.tube_radius * t.tube_radius;
}
// INT H^2 dS and INT K^2 dS: theory.md (7.1).
inline double integral_H2(const Torus& t) {
    const double a = t.tube_radius, c = t.radius;
    return 4 * pi * pi * c * c / (a * std::sqrt(c * c - a * a));
}
inline double integral_K2(const Torus& t) {
    const double a = t.tube_radius, c = t.radius;
    return 4 * pi * pi * c / (a * a * a) * (c / std::sqrt(c * c - a * a) - 1);
}

template <class Keys>
void keys(Keys& k, Torus& torus) {
    k.number("radius", torus.radius, {.above = 0}, k.required);
    k.number("tube_radius", torus.tube_radius, {.above = 0}, k.required);
    k.check("tube_radius", [&] {
        return torus.tube_radius < torus.radius ? std::string()
                                                : "must be below shape.radius: the torus intersects itself";
    });
}

}  // namespace tubule
