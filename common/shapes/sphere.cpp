#include "common/shapes/sphere.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/geometry/profile_point.hpp"

namespace tubule {

double harmonic_scale(int l, int m) {
    double scale = std::sqrt((2 * l + 1) / (4 * pi));
    // Factorials overflow beyond 170: each odd number goes with two factors of (l-m)!/(l+m)!.
    for (int i = 1; i <= m; ++i) scale *= -(2 * i - 1) / std::sqrt((l - m + 2 * i - 1.0) * (l - m + 2 * i));
    return scale;
}

std::string complaint(const Sphere& given) {
    Sphere sphere = given;
    make_noise(sphere);
    int waves = 1;
    double most = 0;  // of the modes together, as |Y_l^m| <= Y_l^0(pole)
    for (const SphereMode& mode : sphere.modes) {
        waves = std::max(waves, mode.l);
        most += std::abs(mode.amplitude) * harmonic_scale(mode.l, 0);
    }
    if (most < 1) return {};
    const int rows = 8 * waves;  // 16 points a wave: a radius that reaches zero is seen unless it barely does
    for (int i = 0; i <= rows; ++i)
        for (int j = 0; j < 2 * rows; ++j) {
            const double theta = pi * i / rows, phi = pi * j / rows;
            const Eigen::Vector3d n(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
            const double r = position(sphere, n).dot(n);
            if (!(r > 0))
                return fmt::format(
                    "must have a positive radius everywhere, but it is {:.6g} in the direction ({:.3g}, "
                    "{:.3g}, {:.3g})",
                    r, n[0], n[1], n[2]);
        }
    return {};
}

}  // namespace tubule
