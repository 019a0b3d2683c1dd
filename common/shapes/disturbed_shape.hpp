// The modes of a shape that is known by points: the same ones that spheres and tubes have, along the normal.
#pragma once

#include <cmath>
#include <variant>

#include "common/shapes/result_frame.hpp"
#include "common/shapes/sphere.hpp"
#include "common/shapes/tube.hpp"

namespace tubule {

// A sphere or a tube with these modes: by how much it is higher than without them is how far the surface moves.
using DisturbedShape = std::variant<Sphere, Tube>;

// In the direction of a vector, or at the height and on the meridian of a point. S is double or a Jet.
template <class S>
S height_at(const DisturbedShape& shape, const Vector3<S>& at) {
    using std::sqrt;
    if (const auto* sphere = std::get_if<Sphere>(&shape)) {
        const Vector3<S> x = position(*sphere, at), n = at * inverse_sqrt(S(at.dot(at)));
        return x.dot(n) - sphere->radius;
    }
    const Tube& tube = std::get<Tube>(shape);
    const Vector3<S> x = position(tube, at);
    const S inverse_rho = inverse_sqrt(S(at[0] * at[0] + at[1] * at[1]));
    return (x[0] * at[0] + x[1] * at[1]) * inverse_rho - tube.radius;
}

// `closed`: what the surface is. Throws std::invalid_argument where the modes are those of another kind.
inline DisturbedShape disturbed_shape(const ResultFrame& frame, bool closed, double radius, double length) {
    Sphere sphere{radius, {}};
    Tube tube{radius, length, {}};
    for (const FrameMode& mode : frame.modes) {
        if (mode.l.has_value() != closed)
            throw std::invalid_argument(closed ? "must have l, not n: the frame is a closed surface"
                                               : "must have n, not l: the frame is a tube or a ring");
        if (closed)
            sphere.modes.push_back({mode.amplitude, *mode.l, mode.m});
        else
            tube.modes.push_back({mode.amplitude, *mode.n, mode.m, mode.phase});
    }
    return closed ? DisturbedShape(sphere) : DisturbedShape(tube);
}

}  // namespace tubule
