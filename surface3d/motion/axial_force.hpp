// The axial force of a periodic tube: what a stretch of the whole, v = z e_z, meets.
#pragma once

#include "surface3d/motion/moving_surface.hpp"

namespace tubule::surface3d {

// What v = z e_z does to a point of the surface, theory.md (10.18): relative rates, the area's along `along` = P e_z.
struct AxialStretch {
    Eigen::Vector3d along;
    double area, H, K;  // div_P v; d_t H and d_t K of the material point
};

inline AxialStretch axial_stretch(const Eigen::Vector3d& normal, const Eigen::Matrix3d& B, double H, double K) {
    const double n2 = normal.z() * normal.z();
    const Eigen::Vector3d along = Eigen::Vector3d::UnitZ() - normal.z() * normal;
    return {along, 1 - n2, n2 * H - 2 * along.dot(B * along), 2 * (2 * n2 - 1) * K};
}

// The force that holds the period, theory.md (3.19): dE/dL with tension or p, pressure and viscosity.
// 0 on a closed surface. `u`: velocities at the nodes; `tension`, `pressure`: of the area and volume as a whole.
double axial_force(const MovingSurface& surface, const MotionState& state, const MotionFields& fields,
                   const VectorField& u, double tension, double pressure);

}  // namespace tubule::surface3d
