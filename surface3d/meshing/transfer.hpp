// From a mesh to another one of the same surface: where the nodes of the other one lie, and nodal values there.
#pragma once

#include <vector>

#include "surface3d/mesh/closest_point.hpp"

namespace tubule::surface3d {

// For each node of `nodes`, the point of the mesh `on` that is nearest: of two meshes of one surface, the same point of
// it, as accurately as both meshes are. It lies in the period of the node. SolveError if there is none near it that
// faces the same way.
std::vector<MeshPoint> places_of_nodes(const CurvedMesh& nodes, const CurvedMesh& on);

// What is there when the mesh `on` has moved to `mesh`: nodal values (one column a node, any number of rows), and `to`
// with its nodes there. Interpolation by P_k: errors of order k + 1.
Eigen::MatrixXd values_at(const std::vector<MeshPoint>& places, const CurvedMesh& mesh, const Eigen::MatrixXd& nodal);
CurvedMesh moved_to(const std::vector<MeshPoint>& places, const CurvedMesh& mesh, CurvedMesh to);

}  // namespace tubule::surface3d
