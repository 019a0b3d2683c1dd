// Normal and curvatures that determine the force on a moving surface.
#pragma once

#include "common/energy/bending.hpp"
#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {

class Projection;

// Nodal values, theory.md (10.1), (10.2). H nu is the weak Laplacian of the position: unlike recoveries
// from the normal or from patches alone, it sees every wave that the mesh can represent, so that the bending force
// acts on it. K is that of the gradient of the continuous normal.
struct MotionFields {
    VectorField normal;
    Eigen::VectorXd H, K;
    Eigen::VectorXd H0 = {};  // where it varies; else empty
    Eigen::VectorXd mu = {};  // -2 kg Lap H, of theory.md (2.26); empty where kg = 0

    double H0_at(const Bending& bending, Eigen::Index node) const { return H0.size() > 0 ? H0[node] : bending.H0; }
};

// H0 at a point of a cell where its nodes have these values, the rate of f with it, and its slope along the surface,
// all zero without them.
struct PointH0 {
    double value = 0;
    SlopeInH0<double> f0;
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();

    PointH0(const Bending& bending, const CellColumns<1>& nodal, const CellColumns<3>& gradient,
            const Eigen::Ref<const Eigen::VectorXd>& phi, double H, double K)
        : value(bending.H0) {
        if (nodal.cols() == 0) return;
        value = nodal.dot(phi.transpose());
        f0 = slope_in_H0(bending, value, H, K);
        slope = gradient * nodal.transpose();
    }
    // Force along the surface: theory.md (2.18).
    Eigen::Vector3d push() const { return f0.f * slope; }
};
// The values of a cell's nodes, none where there are none.
inline CellColumns<1> gather_H0(const SurfaceSpace& space, const Eigen::VectorXd& H0, int cell) {
    if (H0.size() == 0) return CellColumns<1>(1, 0);
    CellColumns<1> out(1, space.width());
    for (int a = 0; a < space.width(); ++a) out[a] = H0[space.node(cell, a)];
    return out;
}

// SolveError if the mesh is degenerate.
MotionFields motion_fields(const SurfaceSpace& space, const CurvedMesh& mesh, const Projection& project, double kg = 0);

// -(grad nu)^sym of the normal `nodal` of a cell, in the tangent plane of the point; see gradients().
inline Eigen::Matrix3d shape_operator(const SurfacePoint<double>& p, const CellColumns<3>& gradient,
                                      const CellColumns<3>& normals) {
    const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - p.normal * p.normal.transpose();
    const Eigen::Matrix3d grad = gradient * normals.transpose() * P;
    return -(grad + grad.transpose()) / 2;
}

}  // namespace tubule::surface3d
