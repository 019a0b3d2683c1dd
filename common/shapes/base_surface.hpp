// The surfaces that shapes are mapped from when triangles are made of them: base(shape) says which one. A torus is one,
// too.
#pragma once

#include "common/shapes/curve.hpp"

namespace tubule {

struct UnitSphere {};

// One period of a tube around the z axis.
struct Cylinder {
    double radius = 1, length = 1;
};

// A Curve is a base, too: triangles in rings whose sizes follow the shape, with a ring at each of its seams.
inline Curve meridian(const UnitSphere&) {
    return curve_of(Topology::cell, 0, [](const auto& t) { return std::array{sin(pi * t), -cos(pi * t)}; });
}
inline Curve meridian(const Cylinder& c) {
    using J = Jet<double, 1, 1>;
    return curve_of(Topology::tube, c.length, [c](const J& t) { return std::array{J(c.radius), c.length * t}; });
}
inline const Curve& meridian(const Curve& curve) {
    return curve;
}

}  // namespace tubule
