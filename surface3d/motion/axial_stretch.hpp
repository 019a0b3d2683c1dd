// What a stretch of the whole, v = z e_z, does to a point of a surface.
#pragma once

#include <Eigen/Core>

namespace tubule::surface3d {

// Relative rates, theory.md (10.18).
struct AxialStretch {
    Eigen::Vector2d along;  // P e_z in a frame of the tangent plane
    double area, H, K;      // div_P v; d_t H and d_t K of the point as it moves
};

// `along` and B in that frame.
inline AxialStretch axial_stretch(const Eigen::Vector2d& along, const Eigen::Matrix2d& B, double H, double K) {
    const double t2 = along.squaredNorm();
    return {along, t2, (1 - t2) * H - 2 * along.dot(B * along), 2 * (1 - 2 * t2) * K};
}

}  // namespace tubule::surface3d
