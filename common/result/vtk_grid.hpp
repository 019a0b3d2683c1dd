// Curved cells and the frames on them as VTKHDF unstructured grids: what frames share (/meshes/000000), what each frame
// adds, and all of them in the order of time (/VTKHDF). Layout: docs/results.md.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/result/hdf5_file.hpp"

namespace tubule {

// The points by which VTK knows the nodes of a mesh: first the nodes, then the nodes again that cells see moved by
// periods, since a cell of VTK has no notion of a period.
struct VtkPoints {
    std::vector<std::int64_t> node, shift;   // of each point
    std::vector<std::int64_t> connectivity;  // the point of each entry of SurfaceCells::cells
};
VtkPoints vtk_points(const SurfaceCells& mesh);

struct WrittenMesh {
    const SurfaceCells& mesh;
    VtkPoints points;
    std::string path;  // "/meshes/000000"
};

// Names that VTKHDF and this layout give to attributes and members of a frame on a mesh: no number and no array that is
// no point data can have them.
inline constexpr const char* grid_attributes[] = {"Version", "Type", "mesh", "arrays"};
inline constexpr const char* grid_members[] = {"NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds",
                                               "Connectivity",   "Offsets",       "Types",
                                               "Points",         "PointData",     "CellData",
                                               "FieldData",      "Steps"};

// Makes /meshes, if there are any, with those that are needed.
std::vector<WrittenMesh> put_meshes(
    hid_t file, const std::vector<SurfaceCells>& meshes,
    const std::function<bool(std::size_t)>& needed = [](std::size_t) { return true; });
SurfaceCells get_mesh(hid_t meshes, const std::string& name);

// Makes the group of a frame an unstructured grid. Arrays that are not point data become plain datasets.
void put_grid(hid_t group, const Record& record, const WrittenMesh& written);
// The arrays of such a frame, as they were written.
std::vector<Array> get_grid_arrays(hid_t group, const SurfaceCells& mesh);

// Makes /VTKHDF, a temporal view of the frames that have a mesh, if there are any: no numbers are stored twice.
void put_steps(hid_t file, const Contents& contents, const std::vector<WrittenMesh>& meshes);

}  // namespace tubule
