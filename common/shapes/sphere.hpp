// Shape "sphere": radius (1 + SUM amplitude Re Y_l^m), with orthonormal spherical harmonics.
#pragma once

#include <string>
#include <vector>

#include "common/geometry/surface_point.hpp"
#include "common/shapes/base_surface.hpp"
#include "common/shapes/curve.hpp"
#include "common/shapes/noise.hpp"

namespace tubule {

struct SphereMode {
    double amplitude = 0;
    int l = 2, m = 0;  // 0 <= m <= l
};

struct Sphere {
    static constexpr const char* kind = "sphere";
    double radius = 1;
    std::vector<SphereMode> modes;
    std::vector<ShapeNoise> noise = {};  // becomes modes once the case is read
};

// sqrt((2l+1)/(4 pi) (l-m)!/(l+m)!), negative for odd m (Condon and Shortley), times 1 3 5 ... (2m-1).
double harmonic_scale(int l, int m);

// Re Y_l^m, 0 <= m <= l, in the direction of a unit vector: Re (x+iy)^m times a polynomial in z. S is double or a Jet.
template <class S>
S real_harmonic(int l, int m, const Vector3<S>& n) {
    S re(harmonic_scale(l, m)), im(0.0);
    for (int i = 0; i < m; ++i) {
        const S next = re * n[0] - im * n[1];
        im = re * n[1] + im * n[0];
        re = next;
    }
    S before(0.0);
    for (int j = m + 1; j <= l; ++j) {  // upward recurrence of Legendre functions, stable
        const S next = ((2 * j - 1.0) / (j - m)) * (n[2] * re) - ((j + m - 1.0) / (j - m)) * before;
        before = re;
        re = next;
    }
    return re;
}

// The point of the surface in the direction of p.
template <class S>
Vector3<S> position(const Sphere& sphere, const Vector3<S>& p) {
    const Vector3<S> n = p * inverse_sqrt(S(p.dot(p)));
    S r(sphere.radius);
    for (const SphereMode& mode : sphere.modes)
        r = r + (sphere.radius * mode.amplitude) * real_harmonic(mode.l, mode.m, n);
    return n * r;
}
inline UnitSphere base(const Sphere&) {
    return {};
}
inline Asymmetry asymmetry(const Sphere& sphere) {
    const Asymmetry noise = noise_around(sphere.noise);
    return noise.first.empty() ? mode_around(sphere.modes) : noise;
}
inline Curve meridian(const Sphere& sphere) {
    require_axisymmetric(sphere);
    return sphere_image(sphere);
}

// Why this is no surface, worded to follow "shape"; empty when it is one.
std::string complaint(const Sphere& sphere);

// The keys of spherical harmonics, of any shape that has them.
template <class Keys, class Shape>
void harmonic_keys(Keys& k, Shape& shape) {
    k.tables("mode", shape.modes, [](auto& k, SphereMode& mode) {
        k.number("amplitude", mode.amplitude, {}, k.required);
        k.integer("l", mode.l, {.from = 0, .to = 1000}, k.required);
        k.integer("m", mode.m, {.from = 0, .to = static_cast<double>(mode.l), .note = "l"});
    });
    k.tables("noise", shape.noise, [](auto& k, ShapeNoise& noise) { keys(k, noise, "l", 2); });
}

template <class Keys>
void keys(Keys& k, Sphere& sphere) {
    k.number("radius", sphere.radius, {.above = 0}, k.required);
    harmonic_keys(k, sphere);
    k.check("", [&] { return complaint(sphere); });
}

}  // namespace tubule
