// Self-intersection of curved meshes.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/mesh/self_intersection.hpp"

namespace tubule::surface3d {

// Near where the flat triangles between the nodes meet each other, or those of the next periods of a tube.
inline std::optional<Eigen::Vector3d> first_intersection(const CurvedMesh& mesh) {
    int images = 1;  // periods among which are all triangles that may meet
    if (mesh.period > 0) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (int cell = 0; cell < mesh.triangles(); ++cell)
            for (int a = 0; a < mesh.nodes_per_cell(); ++a) {
                const double z = mesh.position(cell, a).z();
                low = std::min(low, z), high = std::max(high, z);
            }
        images += static_cast<int>((high - low) / mesh.period);
    }
    const TriangleMesh flat = node_triangles(mesh, images);
    const auto pair = first_intersection(flat);
    if (!pair) return {};
    return flat.corner(static_cast<int>(pair->first), 0);
}

}  // namespace tubule::surface3d
