// How the nodes move: with the surface in the direction of its normal, along it so that the triangles stay good.
#pragma once

#include "common/solve/sparse.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/fem/surface_space.hpp"
#include "surface3d/motion/motion_fields.hpp"

namespace tubule::surface3d {

// Finds the velocity w with (w.nu, phi) = (u.nu, phi) that deforms the mesh least, while it relaxes to a good one:
// (grad w, grad Z) + (m nu, Z) = -(a grad X, grad Z)/(relaxation + te), with a multiplier m: theory.md (10.14). With a
// = 1 and Euler steps, in the limit of no relaxation time, this is the motion of Barrett, Garcke and Nuernberg, whose
// positions do not converge with the step. What pulls is taken where the matrices are, so that it knows nothing of how
// nodes moved before: the pull of other positions would draw nodes, if relaxation is short, to where X is extrapolated
// to, and motions along the surface would go on for ever. To follow the curvature, a is what a triangle has of INT
// |B|^2, bounded, over the mean of all: triangles with more than their share contract.
class MeshMotion {
public:
    explicit MeshMotion(bool follows_curvature) : follows_curvature_(follows_curvature) {}

    // `mesh`: X, which `fields` and `project` belong to; `flux`: (u.nu, phi) of every node. SolveError.
    VectorField velocity(const SurfaceSpace& space, const CurvedMesh& mesh, const MotionFields& fields,
                         const Projection& project, const Eigen::VectorXd& flux, double relaxation, double te);

private:
    bool follows_curvature_;
    SparseCholesky laplacian_;
};

}  // namespace tubule::surface3d
