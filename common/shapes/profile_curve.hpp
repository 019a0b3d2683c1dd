// A surface of revolution from points along its profile, in order, as frames of tier axisym have them: a closed cell, a
// tube that overhangs, or a torus.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "common/geometry/profile_point.hpp"
#include "common/geometry/surface_point.hpp"
#include "common/shapes/torus.hpp"

namespace tubule {

// Two functions of x in [x.front(), x.back()]: about each point a polynomial of degree 6 through the seven points
// nearest to it, and between two points their blend, twice differentiable.
struct BlendedCurve {
    static constexpr int terms = 7;
    std::vector<double> x, scale;                                      // of the points
    std::vector<std::array<std::array<double, terms>, 2>> polynomial;  // in (x - x_i) / scale_i
};

template <class S>
std::array<S, 2> value_at(const BlendedCurve& curve, const S& x) {
    const auto above = std::upper_bound(curve.x.begin() + 1, curve.x.end() - 1, scalar_part(x));
    const std::size_t i = above - curve.x.begin() - 1;
    // The polynomials agree in value at the points, and the blend is flat there: second derivatives join.
    const S w = (x - curve.x[i]) * (1 / (curve.x[i + 1] - curve.x[i])), blend = w * w * (3.0 - 2.0 * w);
    std::array<S, 2> out;
    for (int f = 0; f < 2; ++f) {
        std::array<S, 2> ends;
        for (int e = 0; e < 2; ++e) {
            const auto& c = curve.polynomial[i + e][f];
            const S t = (x - curve.x[i + e]) * (1 / curve.scale[i + e]);
            ends[e] = S(c[BlendedCurve::terms - 1]);
            for (int k = BlendedCurve::terms - 2; k >= 0; --k) ends[e] = ends[e] * t + c[k];
        }
        out[f] = ends[0] + blend * (ends[1] - ends[0]);
    }
    return out;
}

// The parameter is s, the fraction of the arc length. `functions` are, of a tube and of a ring (a profile that closes
// around itself off the axis), r(s) and z(s) - length s. Of a cell they are r / sin(pi s) and z, as functions of
// c = -cos(pi s): smooth at the poles c = -1 and 1, where r is odd and z even in s.
struct ProfileCurve {
    enum class Kind { cell, tube, ring };
    Kind kind = Kind::cell;
    double length = 0;       // tube: of a period
    double arc_length = 0;   // of the profile
    double mean_radius = 0;  // by arc length
    BlendedCurve functions;
};

// Through points from the south pole to the north pole (r = 0 at both, length = 0), from end to end of a period (length
// > 0, the last point is the first one moved up), or once around a ring (the last is the first). Outward is to the
// right of their direction. Throws std::invalid_argument for fewer than 9 points, r <= 0 between the poles, equal
// neighbours, ends that do not fit, and a surface inside out.
ProfileCurve profile_curve(const std::vector<double>& r, const std::vector<double>& z, double length);

// Two more functions on the curve, from their values at the points that it was made from, as `functions` has r and z
// (on a cell the first one over sin(pi s)). For value_at(), at s or c. Throws std::invalid_argument unless there is one
// value a point.
BlendedCurve along_curve(const ProfileCurve& curve, const std::vector<double>& first,
                         const std::vector<double>& second);

// (r, z) at 0 <= s <= 1.
template <class S>
std::array<S, 2> profile_at(const ProfileCurve& curve, const S& s) {
    using std::cos, std::sin;
    if (curve.kind == ProfileCurve::Kind::cell) {
        const auto [scale, z] = value_at(curve.functions, S(-1.0 * cos(pi * s)));
        return {scale * sin(pi * s), z};
    }
    const auto [r, z] = value_at(curve.functions, s);
    return {r, z + curve.length * s};
}

// Where p lies on the base surface: a sphere about the origin (cell), a tube around the z axis of the same period, or
// the torus `base` (ring); on it, s is proportional to the polar angle from the south, to the height, to the angle
// around the circle.
template <class S>
Vector3<S> position(const ProfileCurve& curve, const Torus& base, const Vector3<S>& p) {
    if (curve.kind == ProfileCurve::Kind::cell) {
        const Vector3<S> n = p * inverse_sqrt(S(p.dot(p)));
        const auto [scale, z] = value_at(curve.functions, n[2]);
        return {n[0] * scale, n[1] * scale, z};
    }
    const S inverse_rho = inverse_sqrt(S(p[0] * p[0] + p[1] * p[1]));
    const S cosine = p[0] * inverse_rho, sine = p[1] * inverse_rho;
    using std::atan2;
    S s;
    if (curve.kind == ProfileCurve::Kind::tube)
        s = p[2] * (1 / curve.length);
    else
        s = atan2(p[2], S(p[0] * cosine + p[1] * sine - base.radius)) * (1 / (2 * pi));
    const double turns = std::floor(scalar_part(s));
    const auto [r, z] = profile_at(curve, S(s - turns));
    return {r * cosine, r * sine, z + turns * curve.length};
}

}  // namespace tubule
