// Pointwise geometry of a surface of revolution, from its profile curve (r(s), z(s)): theory.md (4.5), (4.6).
#pragma once

#include "common/geometry/jet.hpp"

namespace tubule {

inline constexpr double pi = 3.14159265358979323846;

// S is a number, a SIMD pack of numbers, or a Jet of either. Everything dimensionless, with outward
// normal nu = (z', -r')/g in the (r, z) plane, so that a tube has H = -1/r and a sphere H = -2/R.
template <class S>
struct ProfilePoint {
    S inverse_speed;  // 1/g, g = sqrt(r'^2 + z'^2)
    S kappa_s;        // curvature along the profile, -t . d nu/ds
    S kappa_theta;    // curvature around the axis, -nu_r / r
    S H;              // kappa_s + kappa_theta
    S K;              // kappa_s * kappa_theta
    S area;           // surface area per ds: 2 pi r g
};

// First and second parameter derivatives r1, r2, z1, z2; r > 0.
template <class S, class Z1, class Z2>
ProfilePoint<S> profile_point(const S& r, const S& r1, const S& r2, const Z1& z1, const Z2& z2) {
    const S g2 = r1 * r1 + z1 * z1;
    const S ig = inverse_sqrt(g2);
    ProfilePoint<S> p;
    p.inverse_speed = ig;
    p.kappa_s = (r2 * z1 - r1 * z2) * (ig * ig * ig);
    p.kappa_theta = (-1.0) * (ig * z1) * inverse(r);
    p.H = p.kappa_s + p.kappa_theta;
    p.K = p.kappa_s * p.kappa_theta;
    p.area = (2 * pi) * r * (g2 * ig);
    return p;
}

// A derivative that is known to vanish, so that the graph pays nothing for being a special case.
struct Zero {};
template <class S>
Zero operator*(const S&, Zero) {
    return {};
}
template <class S>
const S& operator-(const S& a, Zero) {
    return a;
}

// The graph r(z), the special case z = s.
template <class S>
ProfilePoint<S> graph_point(const S& r, const S& r1, const S& r2) {
    return profile_point(r, r1, r2, 1.0, Zero{});
}

}  // namespace tubule
