// How the nodes move: with the surface in the direction of its normal, along it so that the triangles stay good.
#pragma once

#include "common/solve/bordered.hpp"
#include "surface3d/field_unknowns.hpp"

namespace tubule::surface3d {

// Finds the velocity w with (w.nu, phi) = (u.nu, phi) that deforms the mesh least, while it relaxes to one of equal
// triangles: (grad w, grad Z) + (m nu, Z) = -(grad X, grad Z)/(relaxation + te), with a multiplier m. In the limit of
// no relaxation time this is the motion of Barrett, Garcke and Nuernberg, whose positions do not converge with the
// step.
class MeshMotion {
public:
    explicit MeshMotion(const CurvedMesh& mesh);

    // `mesh`: where the matrices are taken; `from`: X of the right-hand side; `normal`: nodal; `flux`: (u.nu, phi)
    // of every node. SolveError.
    VectorField velocity(const SurfaceSpace& space, const CurvedMesh& mesh, const CurvedMesh& from,
                         const VectorField& normal, const Eigen::VectorXd& flux, double relaxation, double te);

private:
    FieldUnknowns unknowns_;
    Eigen::SparseMatrix<double> A_;
    BorderedSolver solver_;
};

}  // namespace tubule::surface3d
