// Target widths of the triangles of a new mesh.
#pragma once

#include <optional>

#include "common/solve/stop.hpp"
#include "surface3d/mesh/closest_point.hpp"
#include "surface3d/meshing/remesh.hpp"

namespace tubule::surface3d {

// Lengths of edges at the nodes of the old mesh.
struct MeshSizes {
    Eigen::VectorXd width;
    double triangles = 0;            // how many equilateral ones have these widths
    std::optional<StopReport> lost;  // curvature requires too many triangles

    // In between, linear or more but within those of the cell.
    double at(const CurvedMesh& mesh, const MeshPoint& p) const;
};
MeshSizes mesh_sizes(const CurvedMesh& mesh, const Eigen::VectorXd& H, const Eigen::VectorXd& K,
                     const RemeshOptions& options);

// The functions of P_k at one point.
Eigen::VectorXd functions_at(int order, const Eigen::Vector2d& at);

}  // namespace tubule::surface3d
