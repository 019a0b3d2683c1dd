// A vector field that no symmetry helps.
#pragma once

#include <cmath>

#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {

// A smooth vector field of space without symmetries, along no normal.
inline Eigen::Vector3d smooth(const Eigen::Vector3d& x) {
    return {std::exp(0.4 * x.x()) + std::sin(x.y() + 0.3), x.y() * (1 + 0.5 * x.y() + 0.3 * x.z() * x.x()),
            std::cos(x.z() + x.x()) + 0.7 * x.z()};
}

inline VectorField smooth_at(const CurvedMesh& mesh) {
    VectorField v(3, mesh.size());
    for (int i = 0; i < mesh.size(); ++i) v.col(i) = smooth(mesh.nodes[i]);
    return v;
}

}  // namespace tubule::surface3d
