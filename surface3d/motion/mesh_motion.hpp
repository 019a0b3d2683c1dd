// Motion of the nodes: with the surface in the normal direction; along it such that the triangles keep their quality.
#pragma once

#include "common/solve/sparse.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/fem/surface_space.hpp"
#include "surface3d/motion/motion_fields.hpp"

namespace tubule::surface3d {

// Finds the velocity w with (w.nu, phi) = (u.nu, phi) that deforms the mesh least, while it relaxes to a good one:
// (grad w, grad Z) + (varphi nu, Z) = -(beta grad X, grad Z)/relaxation, with a multiplier varphi: theory.md (10.14).
// With beta = 1 and Euler steps, in the limit of zero relaxation time, this is the motion of Barrett, Garcke and
// Nuernberg, whose positions do not converge with the step. The right-hand side is evaluated at X, like the matrices,
// so that it does not depend on earlier motion of the nodes: evaluated at extrapolated positions with a short
// relaxation time, it would sustain tangential motion indefinitely. To follow the curvature, beta is INT |B|^2 of a
// triangle, bounded, relative to the mean over all triangles: those above the mean contract.
class MeshMotion {
public:
    explicit MeshMotion(bool follows_curvature) : follows_curvature_(follows_curvature) {}

    // `mesh`: X, which `fields` and `project` belong to; `flux`: (u.nu, phi) of every node. SolveError.
    VectorField velocity(const SurfaceSpace& space, const CurvedMesh& mesh, const MotionFields& fields,
                         const Projection& project, const Eigen::VectorXd& flux, double relaxation);

private:
    bool follows_curvature_;
    SparseCholesky laplacian_;
};

}  // namespace tubule::surface3d
