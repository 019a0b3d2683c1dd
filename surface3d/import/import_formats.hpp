// Internal to read_mesh: what the reader of each format returns, before vertices are merged and polygons triangulated.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "surface3d/import/import_mesh.hpp"

namespace tubule::surface3d {

struct FileCorner {
    std::int64_t vertex = 0;  // counted from 0, whatever the file counts from; not yet checked
    Place place;
};

struct FileMesh {
    std::vector<Eigen::Vector3d> points;
    std::vector<std::vector<FileCorner>> faces;
    std::int64_t first = 0;  // number of the first vertex in the file
};

// Each takes the file's name (for messages) and its whole contents. Throw MeshError.
FileMesh read_obj(const std::string& name, std::string_view text);
FileMesh read_off(const std::string& name, std::string_view text);
FileMesh read_ply(const std::string& name, std::string_view data);
FileMesh read_stl(const std::string& name, std::string_view data);

// Triangulates a simple, nearly planar polygon in space (indices into `corners`) by clipping the best-shaped ear
// repeatedly. Empty when it crosses itself or has no area.
std::vector<std::array<int, 3>> cut_polygon(const std::vector<Eigen::Vector3d>& corners);

}  // namespace tubule::surface3d
