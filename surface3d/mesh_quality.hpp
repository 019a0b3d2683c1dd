// How good the triangles of a curved mesh are, and whether they resolve the surface: cheap enough for every step.
#pragma once

#include "surface3d/curved_mesh.hpp"

namespace tubule::surface3d {

// Of each cell the least determinant J of the map from the equilateral triangle, over the mean of half the square of
// that map's derivative: 1 for an equilateral triangle, less where it is stretched or its parts are of unequal size;
// zero or negative where it folds (J counts with the cosine of the angle to the normal in its middle). Taken at the
// nodes and the centre.
struct MeshQuality {
    Eigen::VectorXd cell;
    double worst = 1, mean = 1;
    int worst_cell = -1;
    Eigen::Vector3d where = Eigen::Vector3d::Zero();  // the middle of the worst cell
};
MeshQuality mesh_quality(const CurvedMesh& mesh);

// The larger of the principal curvatures, by magnitude, where these are H and K.
double largest_curvature(double H, double K);

// The largest product of a curvature at a node and the longest edge (between its vertices) of a cell there: about the
// angle by which the surface turns within a cell, for nodal H and K.
struct MeshResolution {
    double angle = 0;
    double curvature = 0, width = 0;  // its factors
    Eigen::Vector3d where = Eigen::Vector3d::Zero();
};
MeshResolution mesh_resolution(const CurvedMesh& mesh, const Eigen::VectorXd& H, const Eigen::VectorXd& K);

}  // namespace tubule::surface3d
