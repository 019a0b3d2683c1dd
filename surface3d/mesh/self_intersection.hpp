// Finds self-intersections of a triangle mesh.
#pragma once

#include <optional>
#include <utility>

#include "surface3d/mesh/triangle_mesh.hpp"

namespace tubule::surface3d {

// The first pair of triangles (a < b, the smallest a, then b) that share a point other than their common vertices or
// edge. Touching counts; neighbours that fold onto each other (angle below 1e-6) count. Decided by signs of
// determinants with a bound on their rounding, so that flat neighbours are not mistaken for crossing ones. The mesh is
// manifold and its triangles have area. Cost ~ n log n.
std::optional<std::pair<std::size_t, std::size_t>> first_intersection(const TriangleMesh& mesh);

}  // namespace tubule::surface3d
