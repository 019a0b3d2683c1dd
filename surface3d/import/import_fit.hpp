// A smooth curved surface through the vertices of a triangle mesh.
#pragma once

#include "surface3d/import/import_check.hpp"
#include "surface3d/mesh/curved_mesh.hpp"

namespace tubule::surface3d {

struct FitOptions {
    int order = 3;      // of the elements: 2, 3 or 4
    int smoothing = 0;  // how many times vertices are moved to the least-squares surface first; 0: passes through them
};

struct FitReport {
    double roughness = 0;     // of the vertices as given: how far one smoothing moves them, rms, over the mean edge
    std::size_t reduced = 0;  // vertices whose neighbourhood does not determine a polynomial of the full degree
    std::vector<std::string> notes;
};

struct Fit {
    CurvedMesh surface;
    FitReport report;
};

// One curved triangle for each flat one, continuous, with the vertices of `imported` (a mesh that close_mesh has
// passed) as its first nodes, in their order.
//
// Method: about each vertex a polynomial z = p(x, y) of degree order + 1 in a frame along the vertex normal, passing
// through the vertex, nearest to its neighbours of two to four rings in the weighted least-squares sense. A node at
// barycentric coordinates L of its triangle moves from the flat triangle along the blend SUM L_i n_i of the vertices'
// normals by SUM L_i t_i, where t_i is the distance to the polynomial of vertex i. Nodes on an edge depend on its two
// vertices alone. Where the vertices lie on a smooth surface the nodes lie on it up to O(h^(order+2)), and the
// elements' own error O(h^(order+1)) remains. (Blends flat at the vertices, L_i^2 and L_i^3, were worse in H.)
//
// Smoothing, for noisy scans, first moves each vertex to the least-squares cubic of its three rings, `smoothing` times.
// One pass changes a smooth surface by O(h^4).
//
// Throws MeshError naming the triangle where no such surface exists: no intersection in reach, an element that folds,
// or elements that intersect where their flat triangles do not. std::invalid_argument for a bad order.
Fit fit_surface(const ImportedMesh& imported, const FitOptions& options);

}  // namespace tubule::surface3d
