// Shape "patch": a membrane that ends in a ring, a part of a sphere whose pole is `height` above the plane z = 0 of the
// ring; or, with `second_radius`, a cone between two rings, the second one `height` above the first.
#pragma once

#include <cmath>
#include <optional>
#include <string>

#include "common/geometry/profile_point.hpp"
#include "common/shapes/curve.hpp"

namespace tubule {

struct Patch {
    static constexpr const char* kind = "patch";
    double radius = 1, height = 0;
    std::optional<double> second_radius;
};

inline Curve meridian(const Patch& p) {
    Curve m;
    m.topology = p.second_radius ? Topology::strip : Topology::cap;
    if (p.second_radius) {
        m.at = [p, wider = *p.second_radius - p.radius](double t) {
            return std::array{p.radius + wider * t, wider, p.height * t, p.height};
        };
        return m;
    }
    // At the distance s from the pole, with the curvature c: r = sin(c s)/c, z = height - (1 - cos(c s))/c.
    const double c = 2 * p.height / (p.radius * p.radius + p.height * p.height);
    const auto sinc = [](double x) { return std::abs(x) < 1e-4 ? 1 - x * x / 6 : std::sin(x) / x; };
    const double angle = 2 * std::atan2(p.height, p.radius), length = p.radius / sinc(angle);
    m.at = [=, height = p.height](double t) {
        const double s = length * (1 - t), half = sinc(c * s / 2);
        return std::array{s * sinc(c * s), -length * std::cos(c * s), height - c * s * s / 2 * half * half,
                          length * std::sin(c * s)};
    };
    return m;
}

template <class Keys>
void keys(Keys& k, Patch& patch) {
    k.number("radius", patch.radius, {.above = 0}, k.required);
    k.number("second_radius", patch.second_radius, {.above = 0});
    if (patch.second_radius)
        k.number("height", patch.height, {.above = 0}, k.required);
    else
        k.number("height", patch.height);
}

}  // namespace tubule
