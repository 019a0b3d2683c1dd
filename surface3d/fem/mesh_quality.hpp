// Quality of the triangles of a curved mesh, and whether they resolve the surface: the one definition behind the
// series `quality` and `turn`, folds, new meshes and what ends a run. Cheap enough for every step.
#pragma once

#include "surface3d/mesh/curved_mesh.hpp"

namespace tubule::surface3d {

// The shape that the map of a cell gives to a small equilateral triangle: 4 area/sqrt(3)/(mean of its squared sides),
// 1 if it stays equilateral, 0 if it has no area; negative where the cell folds, its normal being turned by 90 degrees
// or more from that in its middle. At the worst of the points where integrals are taken.
struct MeshQuality {
    double worst = 1, mean = 1;  // of the cells
    int worst_cell = -1;
    Eigen::Vector3d where = Eigen::Vector3d::Zero();  // the worst point
    Eigen::VectorXd width;                            // of each cell: largest root mean square of those sides
};
MeshQuality mesh_quality(const CurvedMesh& mesh);

// The larger of the principal curvatures, by magnitude, where these are H and K.
double largest_curvature(double H, double K);

// The largest angle by which the normal turns between neighbouring nodes, for nodal H and K: of a node the larger
// curvature times the width of a cell there over its order.
struct MeshTurn {
    double angle = 0;
    Eigen::Vector3d where = Eigen::Vector3d::Zero();
    bool saddle = false;  // whether K < 0 there, as at a neck
};
MeshTurn mesh_turn(const CurvedMesh& mesh, const MeshQuality& quality, const Eigen::VectorXd& H,
                   const Eigen::VectorXd& K);

}  // namespace tubule::surface3d
