// A smooth surface of new triangles from a mesh as scans and segmentations give it: docs/meshes.md.
#pragma once

#include <string>
#include <vector>

#include "common/shapes/mesh_file.hpp"
#include "surface3d/import/import_mesh.hpp"
#include "surface3d/mesh/curved_mesh.hpp"

namespace tubule::surface3d {

struct RemeshedStart {
    CurvedMesh surface;
    double volume = 0;               // that it bounds
    std::vector<std::string> notes;  // what each step did, and how far the surface is from the file

    // The same triangles of another order, with the same volume.
    CurvedMesh of_order(int order) const;
};

// Repairs the mesh, gives it even, small triangles, smooths it over shape.smoothing_length, restores the volume, fits
// curved triangles through it, and makes shape.remesh triangles of them, smaller where the surface is more curved,
// which elements of this order resolve. Without a smoothing_length, over 2.5 of their edges, or over as much more as it
// takes to resolve the surface by them. Needs CGAL. Throws MeshError where the mesh bounds no body or these triangles
// cannot resolve it.
RemeshedStart remeshed_start(ImportedMesh file, const MeshFile& shape, int order);

}  // namespace tubule::surface3d
