// Normal and curvatures that determine the force on a moving surface.
#pragma once

#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {

class Projection;

// Nodal values, theory.md (10.1), (10.2). H nu is the weak Laplacian of the position: unlike recoveries
// from the normal or from patches alone, it sees every wave that the mesh can represent, so that the bending force
// acts on it. K is that of the gradient of the continuous normal.
struct MotionFields {
    VectorField normal;
    Eigen::VectorXd H, K;
};

// SolveError if the mesh is degenerate.
MotionFields motion_fields(const SurfaceSpace& space, const CurvedMesh& mesh, const Projection& project);

// -(grad nu)^sym of the normal `nodal` of a cell, in the tangent plane of the point; see gradients().
inline Eigen::Matrix3d shape_operator(const SurfacePoint<double>& p, const CellColumns<3>& gradient,
                                      const CellColumns<3>& normals) {
    const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - p.normal * p.normal.transpose();
    const Eigen::Matrix3d grad = gradient * normals.transpose() * P;
    return -(grad + grad.transpose()) / 2;
}

}  // namespace tubule::surface3d
