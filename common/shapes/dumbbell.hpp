// Shape "dumbbell": the surface on which the paper validates its curvatures, theory.md (7.9): the unit sphere with its
// parallels scaled by 1/4 + 3/4 z^2.
#pragma once

#include "common/geometry/surface_point.hpp"
#include "common/shapes/base_surface.hpp"
#include "common/shapes/curve.hpp"

namespace tubule {

struct Dumbbell {
    static constexpr const char* kind = "dumbbell";
    static constexpr double exact_area = 5.176926500756, exact_volume = 0.777918180889;
};

// The image of the point of the unit sphere in the direction of p.
template <class S>
Vector3<S> position(const Dumbbell&, const Vector3<S>& p) {
    const Vector3<S> n = p * inverse_sqrt(S(p.dot(p)));
    const S scale = 0.75 * (n[2] * n[2]) + 0.25;
    return {scale * n[0], scale * n[1], n[2]};
}
inline UnitSphere base(const Dumbbell&) {
    return {};
}
inline Curve meridian(const Dumbbell& dumbbell) {
    return sphere_image(dumbbell);
}

template <class Keys>
void keys(Keys&, Dumbbell&) {}

}  // namespace tubule
