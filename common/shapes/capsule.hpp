// Shape "capsule": a cylinder of length `length` along z, closed by two half spheres of the same radius; or a smooth
// surface close to it.
#pragma once

#include <array>
#include <cmath>
#include <type_traits>

#include "common/geometry/profile_point.hpp"
#include "common/geometry/surface_point.hpp"
#include "common/shapes/base_surface.hpp"
#include "common/shapes/curve.hpp"

namespace tubule {

struct Capsule {
    static constexpr const char* kind = "capsule";
    double radius = 0.5, length = 2;
    // > 0: the length over which the curvature changes from that of the cylinder to that of the caps, at most radius/2.
    double smooth = 0;
};

// Smooth capsules: x^2 + y^2 + over(z)^2 = radius^2, where over(z), for smooth = 0 the part of |z| beyond length/2, is
// u(z - length/2) + u(-z - length/2) with u(x) = (x + sqrt(x^2 + smooth^2))/2. Returns the two terms at z.
template <class S>
std::array<S, 2> over(const Capsule& c, const S& z) {
    using std::sqrt;
    const auto u = [&](const S& x) { return 0.5 * (x + sqrt(x * x + c.smooth * c.smooth)); };
    return {u(z - c.length / 2), u(-z - c.length / 2)};
}

// The point of a smooth capsule on the ray to p from the point of the axis at z - over(z) of p, with the sign of z.
template <class S>
Vector3<S> smooth_position(const Capsule& c, const Vector3<S>& p) {
    constexpr int iterations = 12;  // of Newton's method, from the sharp capsule; the last ones for the derivatives
    const auto [up, down] = over(c, p[2]);
    const S centre = p[2] - up + down, dz = p[2] - centre, d2 = p[0] * p[0] + p[1] * p[1];
    S scale = S(c.radius) * inverse_sqrt(S(d2 + dz * dz));
    for (int i = 0; i < iterations; ++i) {
        const S z = centre + scale * dz;
        const auto [above, below] = over(c, z);
        const double quarter = c.smooth * c.smooth / 4;  // du/dx = u^2/(u^2 + smooth^2/4)
        const S both = above + below, slope = above * above * inverse(S(above * above + quarter)) -
                                              below * below * inverse(S(below * below + quarter));
        scale = scale - (scale * scale * d2 + both * both - c.radius * c.radius) *
                            inverse(S(2.0 * (scale * d2 + both * slope * dz)));
    }
    return {scale * p[0], scale * p[1], centre + scale * dz};
}

// The point of the capsule nearest to p, which may be anything off the segment |z| <= length/2 of the axis. The
// derivatives at the seams |z| = length/2 are those of the cylinder; H and K jump there.
template <class S>
Vector3<S> position(const Capsule& capsule, const Vector3<S>& p) {
    if (capsule.smooth > 0) return smooth_position(capsule, p);
    const double z = scalar_part(p[2]), half = capsule.length / 2;
    Vector3<S> centre(S(0.0), S(0.0), p[2]);
    if (std::abs(z) > half) centre[2] = S(std::copysign(half, z));
    const Vector3<S> d = p - centre;
    return centre + d * S(capsule.radius * inverse_sqrt(S(d.dot(d))));
}

inline Curve meridian(const Capsule& c) {
    if (c.smooth > 0)
        return curve_of(Topology::cell, 0, [c](const auto& t) {  // the image of a spheroid
            using J = std::decay_t<decltype(t)>;
            const J angle = pi * t;
            const Vector3<J> X =
                position(c, Vector3<J>(c.radius * sin(angle), J(0.0), -(c.length / 2 + c.radius) * cos(angle)));
            return std::array{X[0], X[2]};
        });
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

// Exact values, without smooth.
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
    k.number("smooth", capsule.smooth, {.from = 0});
    k.check("smooth",
            [&] { return 2 * capsule.smooth > capsule.radius ? "must be at most half of shape.radius" : ""; });
}

}  // namespace tubule
