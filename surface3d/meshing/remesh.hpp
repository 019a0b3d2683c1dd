// A new curved mesh of the same surface, of good triangles with the sizes that curvature requires.
#pragma once

#include <variant>

#include "common/solve/stop.hpp"
#include "surface3d/fem/mesh_quality.hpp"

namespace tubule::surface3d {

struct RemeshOptions {
    int triangles = 0;             // about this many, or more where `angle` requires them; 0: as many as there are
    double angle = 0.5;            // edges are about this over the largest principal curvature, or shorter
    double growth = 0.33;          // an edge is longer than another by at most this times their distance
    double quality = 0.3;          // that every cell must have (mesh_quality)
    Eigen::VectorXd largest = {};  // edges at the nodes of the old mesh, where it is not empty
};

struct Remeshed {
    CurvedMesh mesh;
    Eigen::MatrixXd fields;  // nodal, one column a node, one row a field
    MeshQuality quality;
    double moved = 0;  // the farthest that a node is from the old mesh, over the width wanted there
};

// Edges are split, collapsed and flipped, vertices moved along the surface, until the triangles have their sizes:
// equal, at most twice those of `triangles` equal ones, but smaller where curvature requires it, neighbours differing
// little. The nodes of the new cells are put where those nearest to their flat triangles are, on the graphs through the
// old nodes of PatchRecovery: smoother than the old cells, whose kinks would be waves of the new ones. `fields` (as
// many columns as nodes, any number of rows) are interpolated by P_k: an error of order k + 1.
//
// If there is no good mesh, a report that says why: mesh-lost if the old mesh folds, if the new one
// misses the required quality, or is not near the old one, or a tube has fewer than three rings; resolution-lost if
// curvature would need more than four times the triangles, or if the graphs do not belong to the surface. Throws
// std::invalid_argument for options out of range and fields of another size.
std::variant<Remeshed, StopReport> remesh(const CurvedMesh& mesh, const Eigen::MatrixXd& fields,
                                          const RemeshOptions& options);

}  // namespace tubule::surface3d
