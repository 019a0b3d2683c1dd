// Curvatures of a surface that is known exactly, at the nodes of a mesh of it: no recovery is needed.
#pragma once

#include "surface3d/curvature/curvature.hpp"
#include "surface3d/mesh/reference_triangle.hpp"
#include "surface3d/mesh/triangle_mesh.hpp"

namespace tubule::surface3d {

// `at(cell, a)` is the exact surface at node a of a cell, a SurfacePoint<double>. Where curvature jumps, a node has
// that of the last of its cells.
template <class ExactAt>
CurvatureField exact_curvature(const CurvedMesh& mesh, ExactAt&& at) {
    CurvatureField field{VectorField(3, mesh.size()), TensorField(6, mesh.size()), Eigen::VectorXd(mesh.size()),
                         Eigen::VectorXd(mesh.size())};
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int a = 0; a < mesh.nodes_per_cell(); ++a) {
            const SurfacePoint<double> p = at(cell, a);
            const int node = mesh.node(cell, a);
            field.normal.col(node) = p.normal;
            field.B.col(node) = packed_tensor(p.B);
            field.H[node] = p.H, field.K[node] = p.K;
        }
    return field;
}

// Such a function for mapped_mesh(base, order, map). Both are kept by reference.
template <class Map>
auto exact_nodes(const TriangleMesh& base, int order, const Map& map) {
    return [&base, &map, order, nodes = lattice(order)](int cell, int a) {
        const Eigen::Vector3d p0 = base.corner(cell, 0);
        const Eigen::Vector3d e1 = base.corner(cell, 1) - p0, e2 = base.corner(cell, 2) - p0;
        return point_of_map<double>(map, p0 + (nodes[a][1] * e1 + nodes[a][2] * e2) / order, e1, e2);
    };
}

}  // namespace tubule::surface3d
