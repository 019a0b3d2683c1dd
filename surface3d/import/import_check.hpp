// Checks that a triangle mesh is the boundary of one body, as everything built on it assumes.
#pragma once

#include "surface3d/import/import_mesh.hpp"

namespace tubule::surface3d {

struct MeshReport {
    std::size_t vertices = 0, edges = 0, triangles = 0;
    int euler = 0, genus = 0;  // vertices - edges + triangles = 2 - 2 genus
    double area = 0, volume = 0;
    double edge_min = 0, edge_max = 0;
    double angle_min = 0;                         // of a triangle, degrees
    double kink_max = 0;                          // between the normals of neighbours, degrees
    std::size_t kink_first = 0, kink_second = 0;  // these neighbours
};

// Checks that the triangles form one closed, oriented surface without self-contact, and that each has an area.
// Throws MeshError that names the first triangle, edge or vertex where that fails: a vertex out of range or twice in a
// triangle, no area, the same triangle twice, an open edge, an edge of three or more triangles, an edge along which
// two triangles run the same way, a vertex where two sheets touch, a second component, two triangles that meet where
// they should not.
// Drops vertices that no triangle uses and reverses a surface that faces inward; `notes` reports both, and also a
// kink of more than 60 degrees, which a smooth surface resolved by the mesh cannot have.
MeshReport close_mesh(ImportedMesh& imported);

}  // namespace tubule::surface3d
