// Area, volume and period of a surface, and their change as its nodes move.
#pragma once

#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {

// Area and volume (of one period), and the period, 0 of a closed surface; or changes of them.
struct Extent {
    double area = 0, volume = 0, length = 0;
};

Extent extent(const SurfaceSpace& space, const CurvedMesh& mesh);
// Its change with displacements d of the nodes: (div_P d, 1) and (d.nu, 1).
Extent extent_rate(const SurfaceSpace& space, const CurvedMesh& mesh, const VectorField& d);
// And with z e_z, by which the period grows, too: theory.md (10.18).
Extent stretch_rate(const SurfaceSpace& space, const CurvedMesh& mesh);
// The integral of a function with these values at the nodes.
double integral(const SurfaceSpace& space, const CurvedMesh& mesh, const Eigen::VectorXd& values);

}  // namespace tubule::surface3d
