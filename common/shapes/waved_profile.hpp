// A surface of revolution with non-axisymmetric modes, and its velocity: from it a run of tier "auto" continues in
// three dimensions.
#pragma once

#include <optional>
#include <vector>

#include "common/shapes/disturbed_shape.hpp"
#include "common/shapes/profile_curve.hpp"

namespace tubule {

// The displacement (radial(s) e_r + axial(s) e_z) cos(m phi). The functions are sums over `terms`: of a cell those of
// Chebyshev in c = -cos(pi s), times sin(pi s)^m (the radial ones once more), which is smooth at the poles; else
// 1, cos(2 pi s), sin(2 pi s), cos(4 pi s), ...
struct ProfileWave {
    static constexpr int terms = 33;
    int m = 1;
    std::array<double, terms> radial{}, axial{};
};

// Velocities of the points of a profile: along e_r and e_z, and around the axis; of a cell, e_r and e_phi over
// sin(pi s).
struct ProfileVelocity {
    BlendedCurve meridional, around;  // (e_r, e_z), (e_phi, nothing)
};

// Waves along the normal, which is a function of the profile as `functions` of ProfileCurve.
struct NormalModes {
    DisturbedShape shape;
    BlendedCurve normal;
};

struct WavedProfile {
    ProfileCurve curve;
    std::vector<ProfileWave> waves;
    std::optional<ProfileVelocity> velocity;
    std::optional<NormalModes> modes = {};
};

// With the modes of a frame. Of a cell their direction is that on the base sphere, where the polar angle is in
// proportion to the arc length, and their radius that of the sphere of its area; along a tube n counts waves in z,
// along a ring waves of the arc length. Throws std::invalid_argument for modes of another kind of surface, and where
// the surface would meet the axis.
WavedProfile disturbed(WavedProfile surface, const ResultFrame& frame);

// The normal displacement w(s) cos(m phi) of the curve; w at equally spaced s, both ends included. Throws
// std::invalid_argument for m < 1 or fewer values than terms.
ProfileWave normal_wave(const ProfileCurve& curve, int m, const std::vector<double>& w);

// Outward, along the curve in its direction, and around the axis; of each point that the curve was made from.
struct VelocityAtPoints {
    std::vector<double> normal, along, around;
};
ProfileVelocity profile_velocity(const ProfileCurve& curve, const VelocityAtPoints& points);

// Where a point of the base surface (see ProfileCurve) lies: its argument of the functions above, and (cos phi,
// sin phi), of a cell times sin(pi s).
template <class S>
struct ProfilePlace {
    S along, x, y;
};
template <class S>
ProfilePlace<S> place_of(const ProfileCurve& curve, const Torus& base, const Vector3<S>& p) {
    if (curve.kind == ProfileCurve::Kind::cell) {
        const Vector3<S> n = p * inverse_sqrt(S(p.dot(p)));
        return {n[2], n[0], n[1]};
    }
    const S inverse_rho = inverse_sqrt(S(p[0] * p[0] + p[1] * p[1]));
    const S x = p[0] * inverse_rho, y = p[1] * inverse_rho;
    using std::atan2;
    const S s = curve.kind == ProfileCurve::Kind::tube
                    ? S(p[2] * (1 / curve.length))
                    : S(atan2(p[2], S(p[0] * x + p[1] * y - base.radius)) * (1 / (2 * pi)));
    return {s - std::floor(scalar_part(s)), x, y};
}

// The functions that `terms` counts, at `along`.
template <class S>
std::array<S, ProfileWave::terms> wave_functions(ProfileCurve::Kind kind, const S& along) {
    using std::cos, std::sin;
    std::array<S, ProfileWave::terms> f;
    f[0] = S(1.0);
    if (kind == ProfileCurve::Kind::cell) {
        f[1] = along;
        for (int k = 2; k < ProfileWave::terms; ++k) f[k] = 2.0 * (along * f[k - 1]) - f[k - 2];
        return f;
    }
    const S angle = 2 * pi * along, c = cos(angle), s = sin(angle);
    f[1] = c, f[2] = s;
    for (int k = 3; k + 1 < ProfileWave::terms; k += 2) {
        f[k] = c * f[k - 2] - s * f[k - 1];
        f[k + 1] = s * f[k - 2] + c * f[k - 1];
    }
    return f;
}

// The point of the surface that belongs to p on the base surface.
template <class S>
Vector3<S> position(const WavedProfile& surface, const Torus& base, const Vector3<S>& p) {
    Vector3<S> out = position(surface.curve, base, p);
    if (surface.waves.empty() && !surface.modes) return out;
    const ProfilePlace<S> at = place_of(surface.curve, base, p);
    if (surface.modes) {
        const Vector3<S> on_base(at.x, at.y, at.along);
        const S height =
            height_at(surface.modes->shape, surface.curve.kind == ProfileCurve::Kind::tube ? out : on_base);
        const auto [radial, axial] = value_at(surface.modes->normal, at.along);
        out += Vector3<S>(height * radial * at.x, height * radial * at.y, height * axial);
    }
    if (surface.waves.empty()) return out;
    const auto functions = wave_functions(surface.curve.kind, at.along);
    for (const ProfileWave& wave : surface.waves) {
        S cosine = at.x, sine = at.y;  // of m phi
        for (int k = 1; k < wave.m; ++k) {
            const S next = cosine * at.x - sine * at.y;
            sine = sine * at.x + cosine * at.y;
            cosine = next;
        }
        S radial(0.0), axial(0.0);
        for (int k = 0; k < ProfileWave::terms; ++k) {
            radial = radial + wave.radial[k] * functions[k];
            axial = axial + wave.axial[k] * functions[k];
        }
        const S outward = radial * cosine;
        out[0] = out[0] + outward * at.x;
        out[1] = out[1] + outward * at.y;
        out[2] = out[2] + axial * cosine;
    }
    return out;
}

// The point of the base surface at the fraction s of the profile and the angle phi; of a ring on Torus{2, 1}.
Vector3<double> base_point(const ProfileCurve& curve, double s, double phi);

// The velocity there; the surface must have one. Waves do not change it.
Vector3<double> velocity(const WavedProfile& surface, const Torus& base, const Vector3<double>& p);

}  // namespace tubule
