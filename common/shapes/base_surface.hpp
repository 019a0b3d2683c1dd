// The surfaces that shapes are mapped from when triangles are made of them: base(shape) says which one. A torus is one,
// too.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <vector>

#include "common/geometry/profile_point.hpp"

namespace tubule {

struct UnitSphere {};

// One period of a tube around the z axis.
struct Cylinder {
    double radius = 1, length = 1;
};

// A curve (r, z)(t), 0 <= t <= 1, that sweeps a surface around the z axis, outward to the right of its direction; with
// period 0 from pole to pole, else (r, z)(1) is (r, z)(0) moved up by the period. `fixed` are parameters that rings of
// points must have, where the surface is less smooth. As a base: triangles in rings whose sizes follow the shape.
struct Profile {
    std::function<Eigen::Vector2d(double)> at;
    double period = 0;
    std::vector<double> fixed;
};

inline Profile profile_of(const UnitSphere&) {
    return {
        .at = [](double t) { return Eigen::Vector2d(std::sin(pi * t), -std::cos(pi * t)); }, .period = 0, .fixed = {}};
}
inline Profile profile_of(const Cylinder& c) {
    return {.at = [=](double t) { return Eigen::Vector2d(c.radius, c.length * t); }, .period = c.length, .fixed = {}};
}
inline const Profile& profile_of(const Profile& profile) {
    return profile;
}

}  // namespace tubule
