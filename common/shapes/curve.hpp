// Profile curves of surfaces of revolution, exact: meridian(shape) gives that of a shape.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/geometry/profile_point.hpp"
#include "common/geometry/surface_point.hpp"

namespace tubule {

// What a curve is a part of, and what its ends are.
enum class Topology {
    cell,       // closed, from the south pole (s = 0) to the north pole: r odd, z even at both
    half_cell,  // from the south pole to the equator z = 0, a plane of symmetry
    tube,       // one period of a tube: r(s + 1) = r(s), z(s + 1) = z(s) + length; a torus if the length is 0
    half_tube,  // half a period, between the planes of symmetry z = 0 and z = length/2
    cap,        // a patch from its ring (s = 0) to the north pole
    strip       // a patch between two rings
};
constexpr bool is_patch(Topology t) {
    return t == Topology::cap || t == Topology::strip;
}
constexpr bool is_closed(Topology t) {
    return t == Topology::cell || t == Topology::half_cell;
}

// A point of a curve with derivatives in its parameter.
struct CurveSample {
    double r, r1, r2, z, z1, z2;
    Eigen::Vector2d x() const { return {r, z}; }
    Eigen::Vector2d d() const { return {r1, z1}; }
    Eigen::Vector2d dd() const { return {r2, z2}; }
};

// A profile curve by any regular parameter t in [0, 1], such that the outward normal is (z', -r')/|X'|: upwards on the
// outside.
struct Curve {
    Topology topology = Topology::cell;
    double length = 0;                                  // period of a tube
    std::function<std::array<double, 4>(double t)> at;  // r, dr/dt, z, dz/dt
    std::vector<double> seams = {};                     // where in (0, 1) it is less than smooth, ascending

    // Copies of the curve in the whole cell or period.
    int images() const { return topology == Topology::half_cell || topology == Topology::half_tube ? 2 : 1; }
};

// The curve t -> {r, z} of a function of jets.
template <class F>
Curve curve_of(Topology topology, double length, const F& f) {
    using J = Jet<double, 1, 1>;
    const auto at = [f](double t) {
        const std::array<J, 2> p = f(J::variable(t, 0));
        return std::array{p[0].v, p[0].d[0], p[1].v, p[1].d[0]};
    };
    return {topology, length, at};
}

// The image of the meridian of the unit sphere from the south pole, for shapes that map the sphere.
template <class Shape>
Curve sphere_image(const Shape& shape) {
    using J = Jet<double, 1, 1>;
    return curve_of(Topology::cell, 0, [shape](const J& t) {
        const J angle = pi * t;
        const Vector3<J> X = position(shape, Vector3<J>(sin(angle), J(0.0), -cos(angle)));
        return std::array{X[0], X[2]};
    });
}

// Why a shape that is not axisymmetric about z has no meridian: the key to blame, and the message that follows it.
// Empty if it is axisymmetric. asymmetry(shape) gives it, where a shape may not be.
using Asymmetry = std::pair<std::string, std::string>;

template <class Mode>
Asymmetry mode_around(const std::vector<Mode>& modes) {
    for (std::size_t i = 0; i < modes.size(); ++i)
        if (modes[i].m != 0)
            return {
                fmt::format("shape.mode.{}.m", i),
                fmt::format("must be 0, not {}: tier \"axisym\" is axisymmetric and has no modes m > 0", modes[i].m)};
    return {};
}

template <class Noise>
Asymmetry noise_around(const std::vector<Noise>& noise) {
    for (std::size_t i = 0; i < noise.size(); ++i)
        if (noise[i].around != 0)
            return {fmt::format("shape.noise.{}.m", i),
                    fmt::format("must be 0, not {}: tier \"axisym\" is axisymmetric and has no modes m > 0",
                                noise[i].around)};
    return {};
}

// Throws std::invalid_argument where the shape has no meridian.
template <class Shape>
void require_axisymmetric(const Shape& shape) {
    if (const auto [key, complaint] = asymmetry(shape); !key.empty())
        throw std::invalid_argument(fmt::format("{} {}", key, complaint));
}

}  // namespace tubule
