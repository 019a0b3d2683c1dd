// Shape "tube": r0(z, theta) = radius + SUM amplitude cos(2 pi n z/length + m theta + phase), periodic in z.
#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "common/geometry/surface_point.hpp"
#include "common/shapes/base_surface.hpp"
#include "common/shapes/curve.hpp"
#include "common/shapes/noise.hpp"

namespace tubule {

struct TubeMode {
    double amplitude = 0;
    int n = 1;         // waves per length
    int m = 0;         // azimuthal mode number; tier axisym takes m = 0 only
    double phase = 0;  // radians
};

struct Tube {
    static constexpr const char* kind = "tube";
    double radius = 1;
    double length = 2;
    std::vector<TubeMode> modes;
    std::vector<ShapeNoise> noise = {};  // becomes modes once the case is read
};

// r0 at z on the meridian theta = 0 (any meridian, as long as all modes have m = 0). T is double or any
// differentiable scalar that is constructible from double and has +, * and cos.
template <class T>
T radius_at(const Tube& tube, const T& z) {
    using std::cos;
    T r(tube.radius);
    for (const TubeMode& mode : tube.modes) {
        const double wave_number = 2 * std::numbers::pi * mode.n / tube.length;
        r = r + mode.amplitude * cos(wave_number * z + mode.phase);
    }
    return r;
}

// r0 at z on the meridian theta.
inline double radius_at(const Tube& tube, double z, double theta) {
    double r = tube.radius;
    for (const TubeMode& mode : tube.modes)
        r += mode.amplitude * std::cos(2 * std::numbers::pi * mode.n / tube.length * z + mode.m * theta + mode.phase);
    return r;
}

// The point at the height and on the meridian of p, which may be anything off the axis. S is double or a Jet.
template <class S>
Vector3<S> position(const Tube& tube, const Vector3<S>& p) {
    using std::cos, std::sin;
    const S inverse_rho = inverse_sqrt(S(p[0] * p[0] + p[1] * p[1]));
    const S cosine = p[0] * inverse_rho, sine = p[1] * inverse_rho;
    S r(tube.radius);
    for (const TubeMode& mode : tube.modes) {
        const double wave_number = 2 * std::numbers::pi * mode.n / tube.length;
        S re = cos(wave_number * p[2] + mode.phase), im = sin(wave_number * p[2] + mode.phase);
        for (int i = 0; i < std::abs(mode.m); ++i) {  // times e^{i theta} or e^{-i theta}
            const S turn = mode.m > 0 ? sine : -sine;
            const S next = re * cosine - im * turn;
            im = re * turn + im * cosine;
            re = next;
        }
        r = r + mode.amplitude * re;
    }
    return {r * cosine, r * sine, p[2]};
}
inline Cylinder base(const Tube& tube) {
    return {tube.radius, tube.length};
}
inline Asymmetry asymmetry(const Tube& tube) {
    const Asymmetry noise = noise_around(tube.noise);
    return noise.first.empty() ? mode_around(tube.modes) : noise;
}
inline Curve meridian(const Tube& tube) {
    require_axisymmetric(tube);
    return curve_of(Topology::tube, tube.length, [tube](const auto& t) {
        const auto z = tube.length * t;
        return std::array{radius_at(tube, z), z};
    });
}

// How often waves along the axis alone repeat within the length; 0 without waves, 1 with other ones.
int common_waves(const Tube& tube);

// The smallest r0 over the meridian theta = 0 and where it is, 0 <= z < length.
struct Neck {
    double z = 0, radius = 0;
};
Neck narrowest(const Tube& tube);

// Why this is no surface, worded to follow "shape"; empty when r0 > 0 everywhere.
std::string complaint(const Tube& tube);

// Volume over one period, exact for modes with m = 0: pi INT r0^2 dz. (The area has no closed form.)
double volume(const Tube& tube);

// The keys of [shape]; see common/case/keys.hpp.
template <class Keys>
void keys(Keys& k, Tube& tube) {
    k.number("radius", tube.radius, {.above = 0}, k.required);
    k.number("length", tube.length, {.above = 0}, k.required);
    k.tables("mode", tube.modes, [](auto& k, TubeMode& mode) {
        k.number("amplitude", mode.amplitude, {}, k.required);
        k.integer("n", mode.n, {.from = 0, .to = 10000}, k.required);
        k.integer("m", mode.m, {.from = -10000, .to = 10000});
        k.number("phase", mode.phase);
    });
    k.tables("noise", tube.noise, [](auto& k, ShapeNoise& noise) { keys(k, noise, "n", 1); });
    k.check("", [&] { return complaint(tube); });
}

}  // namespace tubule
