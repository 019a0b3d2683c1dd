// A triangle mesh as the boundary of one body, which everything built on it assumes: checked, or repaired.
#pragma once

#include "surface3d/import/import_mesh.hpp"

namespace tubule::surface3d {

struct MeshReport {
    int genus = 0;  // vertices - edges + triangles = 2 - 2 genus
    double area = 0, volume = 0;
    double kink_max = 0;  // between the normals of neighbours, degrees
};

// Checks that the triangles form one closed, oriented surface without self-contact, and that each has an area.
// Throws MeshError that names the first triangle, edge or vertex where that fails: a vertex out of range or twice in a
// triangle, no area, the same triangle twice, an open edge, an edge of three or more triangles, an edge along which
// two triangles run the same way, a vertex where two sheets touch, a second component, two triangles that meet where
// they should not.
// Drops vertices that no triangle uses and reverses a surface that faces inward; `notes` reports both, and also a
// kink of more than 60 degrees, which a smooth surface resolved by the mesh cannot have.
MeshReport close_mesh(ImportedMesh& in);

// Repairs what scans and segmentations give, as far as there is one way to do it. In this order: drops triangles with a
// vertex twice and repeated triangles; turns triangles that face the other way than their neighbours; drops specks,
// pieces of less than a hundredth of the largest one's area; with `may_be_open`, separates sheets that touch in a
// vertex of their borders; turns a closed surface that faces inward. `notes` reports each. Throws MeshError that names
// the place: an edge of three or more triangles, a surface of one side, an open edge (unless it may be open), a vertex
// where two closed sheets touch, a second piece. Whether triangles meet is not looked at.
void repair_mesh(ImportedMesh& in, bool may_be_open);

}  // namespace tubule::surface3d
