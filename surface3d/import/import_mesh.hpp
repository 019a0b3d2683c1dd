// Closed surfaces from files: OBJ, OFF, PLY (ascii, binary of both byte orders) and STL (ascii, binary).
// In this order: read_mesh -> close_mesh (import_check.hpp) -> fit_surface (import_fit.hpp).
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "surface3d/mesh/triangle_mesh.hpp"

namespace tubule::surface3d {

// A mesh that cannot be used; what() begins with the file and, where the file has them, line and column
// ("scan.obj:12:5: ..."), or the byte ("scan.stl: byte 134: ...").
struct MeshError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// A position in a file: line and column from 1 in text, line = 0 and a byte from 0 in binary.
struct Place {
    std::size_t line = 0, column = 0, byte = 0;
};

// Messages name triangles by number and place, vertices by number and coordinates, both counted as the file does (OBJ
// from 1, the others from 0).
struct TriangleSource {
    std::int64_t number = 0;
    Place place = {};  // byte 0 of line 0: none
};
struct ImportedMesh {
    TriangleMesh mesh;
    std::string file = "mesh";
    std::vector<std::int64_t> vertex_number;
    std::vector<TriangleSource> source;  // of each triangle
    bool is_new = false;                 // the triangles are not the file's: messages name them by coordinates
    std::vector<std::string> notes;      // what was changed, in full sentences
};
// A mesh in memory, numbered from `first`.
ImportedMesh imported(TriangleMesh mesh, const std::string& file = "mesh", std::int64_t first = 0);

std::string triangle_name(const ImportedMesh& in, std::size_t triangle);
std::string vertex_name(const ImportedMesh& in, int vertex);
[[noreturn]] void refuse(const ImportedMesh& in, const std::string& message);  // a MeshError that names the file

// Drop the triangles, or the vertices (of which no triangle has any), that are not to be kept. Return how many.
std::size_t keep_triangles(ImportedMesh& in, const std::vector<bool>& keep);
std::size_t keep_vertices(ImportedMesh& in, const std::vector<bool>& keep);

// Whether a triangle has a vertex twice.
inline bool has_vertex_twice(const std::array<int, 3>& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

// The triangles of a file; the extension gives the format (.obj .off .ply .stl, in either case). Polygons become
// triangles. Vertices at the same place become one; so do those nearer than `weld` (in the units of the file), and
// triangles that collapse are dropped, with a note. Faces with a vertex twice are errors unless `drop_degenerate`.
// `bytes`: of the file, if they have been read. Throws MeshError; never returns part of a file.
ImportedMesh read_mesh(const std::filesystem::path& path, double weld = 0, bool drop_degenerate = false,
                       const std::string* bytes = nullptr);

}  // namespace tubule::surface3d
