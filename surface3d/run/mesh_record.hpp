// Curved meshes as records of the result file.
#pragma once

#include "common/result/record.hpp"
#include "surface3d/mesh/curved_mesh.hpp"

namespace tubule::surface3d {

SurfaceCells cells_of(const CurvedMesh& mesh);

// The surface of a frame. Throws std::invalid_argument if it has no points on these cells.
CurvedMesh frame_surface(const Record& frame, const SurfaceCells& cells);

}  // namespace tubule::surface3d
