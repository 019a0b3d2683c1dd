// Profiles of surfaces of revolution, exact: meridian(shape) gives that of a shape.
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
    half_tube   // half a period, between the planes of symmetry z = 0 and z = length/2
};

// A profile curve by any regular parameter t in [0, 1], such that the outward normal is (z', -r')/|X'|: upwards on the
// outside.
struct Meridian {
    Topology topology = Topology::cell;
    double length = 0;                                  // period of a tube
    std::function<std::array<double, 4>(double t)> at;  // r, dr/dt, z, dz/dt
    std::vector<double> seams;                          // where in (0, 1) it is less than smooth, ascending
};

// The image of the meridian of the unit sphere from the south pole, for shapes that map the sphere.
template <class Shape>
Meridian sphere_image(const Shape& shape) {
    using J = Jet<double, 1, 1>;
    Meridian m;
    m.at = [shape](double t) {
        const J angle = pi * J::variable(t, 0);
        const Vector3<J> X = position(shape, Vector3<J>(sin(angle), J(0.0), -cos(angle)));
        return std::array{X[0].v, X[0].d[0], X[2].v, X[2].d[0]};
    };
    return m;
}

// One period of radius_at(shape, z).
template <class Shape>
Meridian graph_meridian(const Shape& shape) {
    using J = Jet<double, 1, 1>;
    Meridian m;
    m.topology = Topology::tube;
    m.length = shape.length;
    m.at = [shape](double t) {
        const J r = radius_at(shape, J(shape.length) * J::variable(t, 0));
        return std::array{r.v, r.d[0], shape.length * t, shape.length};
    };
    return m;
}

// Why a shape that is not axisymmetric about z has no meridian: the key to blame, and the message that follows it.
// Empty if it is axisymmetric. asymmetry(shape) gives it, where a shape may not be.
using Asymmetry = std::pair<std::string, std::string>;

template <class Mode>
Asymmetry wave_around(const std::vector<Mode>& modes) {
    for (std::size_t i = 0; i < modes.size(); ++i)
        if (modes[i].m != 0)
            return {fmt::format("shape.mode.{}.m", i),
                    fmt::format("must be 0, not {}: tier \"axisym\" is axisymmetric and has no modes m > 0",
                                modes[i].m)};
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
