// A surface of revolution, periodic in z, from a spline profile r(z): what a frame of tier axisym holds.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "common/geometry/surface_point.hpp"
#include "common/shapes/meridian.hpp"

namespace tubule {

// The spline over [0, length] in the usual convention: degree + 1 knots more than coefficients.
struct Revolution {
    int degree = 5;
    double length = 1;
    std::vector<double> knots, coefficients;
};

// r at z, for any z (r is periodic). S is double or a Jet.
template <class S>
S radius_at(const Revolution& surface, const S& z) {
    const int p = surface.degree, n = static_cast<int>(surface.coefficients.size());
    const double turns = std::floor(scalar_part(z) / surface.length);
    const S at = z - turns * surface.length;
    const auto& t = surface.knots;
    const auto above = std::upper_bound(t.begin() + p, t.begin() + n, scalar_part(at));
    const int span = std::max(static_cast<int>(above - t.begin()) - 1, p);
    std::array<S, 8> d;  // de Boor, degree 7 at most
    for (int j = 0; j <= p; ++j) d[j] = S(surface.coefficients[span - p + j]);
    for (int level = 1; level <= p; ++level)
        for (int j = p; j >= level; --j) {
            const double low = t[span - p + j], high = t[span + 1 + j - level];
            const S alpha = (at - low) * (1 / (high - low));
            d[j] = d[j - 1] + alpha * (d[j] - d[j - 1]);
        }
    return d[p];
}

// The point at the height and on the meridian of p, which may be anything off the axis.
template <class S>
Vector3<S> position(const Revolution& surface, const Vector3<S>& p) {
    const S scale = radius_at(surface, p[2]) * inverse_sqrt(S(p[0] * p[0] + p[1] * p[1]));
    return {p[0] * scale, p[1] * scale, p[2]};
}
inline Meridian meridian(const Revolution& surface) {
    return graph_meridian(surface);
}

}  // namespace tubule
