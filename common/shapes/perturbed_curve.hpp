// A profile curve that is made of points or of a spline, as a smooth map from a base surface: with non-axisymmetric
// modes and a velocity, so that a motion may continue from it in three dimensions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <type_traits>
#include <vector>

#include "common/shapes/curve.hpp"
#include "common/shapes/disturbed_shape.hpp"
#include "common/shapes/torus.hpp"

namespace tubule {

// Two functions of x in [x.front(), x.back()], twice differentiable: polynomials between breaks.
struct CurveFunctions {
    static constexpr int terms = 10;
    std::vector<double> x;                                             // the breaks
    std::vector<std::array<std::array<double, terms>, 2>> polynomial;  // of each interval, in w from 0 to 1
};

template <class S>
std::array<S, 2> value_at(const CurveFunctions& functions, const S& x) {
    const std::vector<double>& breaks = functions.x;
    const auto above = std::upper_bound(breaks.begin() + 1, breaks.end() - 1, scalar_part(x));
    const std::size_t i = above - breaks.begin() - 1;
    const double turn = 1 / (breaks[i + 1] - breaks[i]), w = (scalar_part(x) - breaks[i]) * turn;
    std::array<S, 2> out;
    for (int f = 0; f < 2; ++f) {  // by Horner's rule for the value and two derivatives, and not in jets
        double p = 0, p1 = 0, half_p2 = 0;
        for (int k = CurveFunctions::terms - 1; k >= 0; --k) {
            half_p2 = half_p2 * w + p1;
            p1 = p1 * w + p;
            p = p * w + functions.polynomial[i][f][k];
        }
        if constexpr (std::is_same_v<S, double>)
            out[f] = p;
        else
            out[f] = chain(x, p, p1 * turn, 2 * half_p2 * turn * turn);
    }
    return out;
}

// The displacement (radial(s) e_r + axial(s) e_z) cos(m phi). The functions are sums over `terms`: of a cell those of
// Chebyshev in c = -cos(pi s), times sin(pi s)^m (the radial ones once more), which is smooth at the poles; else
// 1, cos(2 pi s), sin(2 pi s), cos(4 pi s), ...
struct CurveMode {
    static constexpr int terms = 33;
    int m = 1;
    std::array<double, terms> radial{}, axial{};
};

// Velocities of the points of a curve: along e_r and e_z, and around the axis; of a cell, e_r and e_phi over
// sin(pi s).
struct CurveVelocity {
    CurveFunctions meridional, around;  // (e_r, e_z), (e_phi, nothing)
    bool swirls = false;
};

// A displacement along the normal, which is a function of the curve as `functions` of PerturbedCurve.
struct NormalModes {
    DisturbedShape shape;
    CurveFunctions normal;
};

// The parameter s is the fraction of the arc length, or of the length along the axis. `functions` are, of a tube and of
// a ring (a profile that closes around itself off the axis: a tube of length 0), r(s) and z(s) - length s. Of a cell
// they are r / sin(pi s) and z, as functions of c = -cos(pi s): smooth at the poles c = -1 and 1, where r is odd and z
// even in s.
struct PerturbedCurve {
    Topology topology = Topology::cell;  // or tube, or that of a patch
    double length = 0;                   // tube: of a period
    double arc_length = 0;               // of the profile
    double mean_radius = 0;              // by arc length
    CurveFunctions functions;
    std::vector<CurveMode> modes = {};
    std::optional<NormalModes> along_normal = {};
    std::optional<CurveVelocity> velocity = {};

    bool is_cell() const { return topology == Topology::cell; }
    bool is_ring() const { return topology == Topology::tube && length == 0; }
};

// Through points from the south pole to the north pole (r = 0 at both, length = 0), from end to end of a period (length
// > 0, the last point is the first one moved up), once around a ring (the last is the first), or from the ring of a
// patch to the north pole or to another ring. Outward is to the right of their direction. s is by arc length; about
// each point the curve is the polynomial of degree 6 through the seven nearest points, between two points their blend.
// Throws std::invalid_argument for fewer than 9 points, r <= 0 between the poles, equal neighbours, ends that do not
// fit, and a surface inside out.
PerturbedCurve curve_through(const std::vector<double>& r, const std::vector<double>& z, double length);

// The tube r(z) of a spline over [0, length] in the usual convention: degree + 1 knots more than coefficients, degree
// 1 ... 7. Throws std::invalid_argument, worded to follow the name of the frame that holds it.
PerturbedCurve spline_curve(int degree, double length, const std::vector<double>& knots,
                            const std::vector<double>& coefficients);

// Two more functions on the curve, from their values at the breaks of `functions`, as that has r and z (on a cell the
// first one over sin(pi s)). For value_at(), at s or c. Throws std::invalid_argument unless there is one value a point.
CurveFunctions functions_along(const PerturbedCurve& curve, const std::vector<double>& first,
                               const std::vector<double>& second);

// With the modes of a frame. Of a cell their direction is that on the base sphere, where the polar angle is in
// proportion to the arc length, and their radius that of the sphere of its area; along a tube n counts waves in z,
// along a ring waves of the arc length. Throws std::invalid_argument for modes of another kind of surface, and where
// the surface would meet the axis.
PerturbedCurve disturbed(PerturbedCurve curve, const ResultFrame& frame);

// The normal displacement w(s) cos(m phi) of the curve; w at equally spaced s, both ends included. Throws
// std::invalid_argument for m < 1, fewer values than terms, and a mode that the terms cannot follow.
CurveMode normal_mode(const PerturbedCurve& curve, int m, const std::vector<double>& w);

// Outward, along the curve in its direction, and around the axis (or empty); at each break of `functions`.
struct VelocityAtPoints {
    std::vector<double> normal, along, around;
};
CurveVelocity curve_velocity(const PerturbedCurve& curve, const VelocityAtPoints& points);

// (r, z) at 0 <= s <= 1, of the curve without its modes.
template <class S>
std::array<S, 2> profile_at(const PerturbedCurve& curve, const S& s) {
    using std::cos, std::sin;
    if (curve.is_cell()) {
        const auto [scale, z] = value_at(curve.functions, S(-1.0 * cos(pi * s)));
        return {scale * sin(pi * s), z};
    }
    const auto [r, z] = value_at(curve.functions, s);
    return {r, z + curve.length * s};
}

// Where a point of the base surface lies: its argument of the functions above, of a tube the whole periods below, and
// (cos phi, sin phi), of a cell times sin(pi s). The base surface is a sphere about the origin (cell), a tube around
// the z axis of the same period, or the torus `base` (ring); on it, s is proportional to the polar angle from the
// south, to the height, to the angle around the circle.
template <class S>
struct BasePlace {
    S along, x, y;
    double turns = 0;
};
template <class S>
BasePlace<S> place_of(const PerturbedCurve& curve, const Torus& base, const Vector3<S>& p) {
    if (curve.is_cell()) {
        const Vector3<S> n = p * inverse_sqrt(S(p.dot(p)));
        return {n[2], n[0], n[1]};
    }
    const S inverse_rho = inverse_sqrt(S(p[0] * p[0] + p[1] * p[1]));
    const S x = p[0] * inverse_rho, y = p[1] * inverse_rho;
    using std::atan2;
    const S s = curve.is_ring() ? S(atan2(p[2], S(p[0] * x + p[1] * y - base.radius)) * (1 / (2 * pi)))
                                : S(p[2] * (1 / curve.length));
    const double turns = std::floor(scalar_part(s));
    return {s - turns, x, y, turns};
}

// The point of the base surface at the fraction s of the profile and the angle phi; of a ring on Torus{2, 1}.
template <class S>
Vector3<S> base_point(const PerturbedCurve& curve, const S& s, double phi) {
    using std::cos, std::sin;
    const double x = cos(phi), y = sin(phi);
    if (curve.is_cell()) return {x * sin(pi * s), y * sin(pi * s), -1.0 * cos(pi * s)};
    if (!curve.is_ring()) return {S(x), S(y), curve.length * s};
    const S angle = 2 * pi * s, rho = 2.0 + cos(angle);
    return {x * rho, y * rho, sin(angle)};
}

// The functions that CurveMode::terms counts, at `along`.
template <class S>
std::array<S, CurveMode::terms> mode_functions(const PerturbedCurve& curve, const S& along) {
    using std::cos, std::sin;
    std::array<S, CurveMode::terms> f;
    f[0] = S(1.0);
    if (curve.is_cell()) {
        f[1] = along;
        for (int k = 2; k < CurveMode::terms; ++k) f[k] = 2.0 * (along * f[k - 1]) - f[k - 2];
        return f;
    }
    const S angle = 2 * pi * along, c = cos(angle), s = sin(angle);
    f[1] = c, f[2] = s;
    for (int k = 3; k + 1 < CurveMode::terms; k += 2) {
        f[k] = c * f[k - 2] - s * f[k - 1];
        f[k + 1] = s * f[k - 2] + c * f[k - 1];
    }
    return f;
}

// The point of the surface that belongs to p on the base surface.
template <class S>
Vector3<S> position(const PerturbedCurve& curve, const Torus& base, const Vector3<S>& p) {
    const BasePlace<S> at = place_of(curve, base, p);
    const auto [r, z] = value_at(curve.functions, at.along);
    Vector3<S> out(r * at.x, r * at.y, z);
    if (!curve.is_cell()) out[2] = z + curve.length * at.along + at.turns * curve.length;
    if (curve.along_normal) {
        const Vector3<S> on_base(at.x, at.y, at.along);
        const bool by_height = !curve.is_cell() && !curve.is_ring();
        const S height = height_at(curve.along_normal->shape, by_height ? out : on_base);
        const auto [radial, axial] = value_at(curve.along_normal->normal, at.along);
        out += Vector3<S>(height * radial * at.x, height * radial * at.y, height * axial);
    }
    if (curve.modes.empty()) return out;
    const auto functions = mode_functions(curve, at.along);
    for (const CurveMode& mode : curve.modes) {
        S cosine = at.x, sine = at.y;  // of m phi
        for (int k = 1; k < mode.m; ++k) {
            const S next = cosine * at.x - sine * at.y;
            sine = sine * at.x + cosine * at.y;
            cosine = next;
        }
        S radial(0.0), axial(0.0);
        for (int k = 0; k < CurveMode::terms; ++k) {
            radial = radial + mode.radial[k] * functions[k];
            axial = axial + mode.axial[k] * functions[k];
        }
        const S outward = radial * cosine;
        out[0] = out[0] + outward * at.x;
        out[1] = out[1] + outward * at.y;
        out[2] = out[2] + axial * cosine;
    }
    return out;
}

// The velocity there; the curve must have one. Modes do not change it.
Vector3<double> velocity(const PerturbedCurve& curve, const Torus& base, const Vector3<double>& p);

// The curve with the normal displacement at phi = 0, as profiles of tier axisym have it: for m = 0 alone.
Curve meridian(const PerturbedCurve& curve);

}  // namespace tubule
