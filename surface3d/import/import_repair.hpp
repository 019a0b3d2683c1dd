// Repairs meshes as scans and segmentations give them, as far as there is one way to do it.
#pragma once

#include "surface3d/import/import_mesh.hpp"

namespace tubule::surface3d {

// In this order: drops triangles with a vertex twice and repeated triangles; turns triangles that face the other way
// than their neighbours; drops specks, pieces of less than a hundredth of the largest one's area; with `may_be_open`,
// separates sheets that touch in a vertex of their borders; drops vertices that no triangle uses; turns a closed
// surface that faces inward. `notes` reports each. Throws MeshError that names the place: an edge of three or more
// triangles, a surface of one side, an open edge (unless it may be open), a vertex where two closed sheets touch, a
// second piece.
void repair_mesh(ImportedMesh& mesh, bool may_be_open);

}  // namespace tubule::surface3d
