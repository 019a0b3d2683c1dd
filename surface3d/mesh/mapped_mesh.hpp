// Curved meshes of surfaces that are known exactly: a base triangulation near the surface, moved onto it by a map.
#pragma once

#include "common/geometry/surface_point.hpp"
#include "surface3d/mesh/curved_mesh.hpp"
#include "surface3d/mesh/reference_triangle.hpp"
#include "surface3d/mesh/triangle_mesh.hpp"

namespace tubule::surface3d {

// The flat triangles of `base` with the nodes of P_k on them. Throws std::invalid_argument for another order than
// 1 ... 4.
CurvedMesh flat_mesh(const TriangleMesh& base, int order);

// The flat triangles between the vertices, cell by cell; vertices are numbered as the cells come to them.
TriangleMesh corner_triangles(const CurvedMesh& mesh);

// The flat triangles between the nodes, order^2 in each cell, those of a cell together; of a tube, which is cut open,
// `images` periods.
TriangleMesh node_triangles(const CurvedMesh& mesh, int images = 1);

// The functions of P_order at the nodes of P_of_order.
Tabulation at_nodes(int order, int of_order);

// The interpolant of another order of the same triangles.
CurvedMesh with_order(const CurvedMesh& mesh, int order);

// The isoparametric interpolant of the surface map(base). `map` takes and returns an Eigen::Vector3d, is smooth on each
// triangle, and on a tube commutes with the shift by a period, e.g. [&](const auto& p) { return position(shape, p); }
template <class Map>
CurvedMesh mapped_mesh(const TriangleMesh& base, int order, const Map& map) {
    CurvedMesh mesh = flat_mesh(base, order);
    for (Eigen::Vector3d& x : mesh.nodes) x = map(x);
    return mesh;
}

}  // namespace tubule::surface3d
