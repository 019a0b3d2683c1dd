// Shape "capsule": a cylinder of length `length` along z, closed by two half spheres of the same radius.
#pragma once

#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "common/geometry/surface_point.hpp"
#include "common/shapes/base_surface.hpp"
#include "common/shapes/curve.hpp"

namespace tubule {

struct Capsule {
    static constexpr const char* kind = "capsule";
    double radius = 0.5, length = 2;
};

// The point of the capsule nearest to p, which may be anything off the segment |z| <= length/2 of the axis. The
// derivatives at the seams |z| = length/2 are those of the cylinder; H and K jump there.
template <class S>
Vector3<S> position(const Capsule& capsule, const Vector3<S>& p) {
    const double z = scalar_part(p[2]), half = capsule.length / 2;
    Vector3<S> centre(S(0.0), S(0.0), p[2]);
    if (std::abs(z) > half) centre[2] = S(std::copysign(half, z));
    const Vector3<S> d = p - centre;
    return centre + d * S(capsule.radius * inverse_sqrt(S(d.dot(d))));
}

inline Curve meridian(const Capsule& c) {
    const double total = pi * c.radius + c.length, cap = pi / 2 * c.radius / total;
    Curve m;
    m.seams = {cap, 1 - cap};
    m.at = [c, total, cap](double t) {
        if (t > cap && t < 1 - cap) return std::array{c.radius, 0.0, (t - 0.5) * total, total};
        const double angle = (t <= cap ? t : t - 1) * total / c.radius;  // from the pole of this side
        const double side = t <= cap ? 1 : -1;
        return std::array{c.radius * std::sin(side * angle), side * total * std::cos(angle),
                          -side * (c.length / 2 + c.radius * std::cos(angle)), side * total * std::sin(angle)};
    };
    return m;
}
inline Curve base(const Capsule& c) {
    return meridian(c);
}

inline double area(const Capsule& c) {
    return 2 * pi * c.radius * c.length + 4 * pi * c.radius * c.radius;
}
inline double volume(const Capsule& c) {
    return pi * c.radius * c.radius * (c.length + 4.0 / 3 * c.radius);
}
// INT (H - H0)^2 dS: cylinder and sphere.
inline double integral_H2(const Capsule& c, double H0 = 0) {
    const double tube = 1 / c.radius + H0, cap = 2 / c.radius + H0;
    return 2 * pi * c.radius * (c.length * tube * tube + 2 * c.radius * cap * cap);
}
inline double integral_K2(const Capsule& c) {
    return 4 * pi / (c.radius * c.radius);
}

template <class Keys>
void keys(Keys& k, Capsule& capsule) {
    k.number("radius", capsule.radius, {.above = 0}, k.required);
    k.number("length", capsule.length, {.above = 0}, k.required);
}

}  // namespace tubule
