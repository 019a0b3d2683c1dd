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

// Names of the elements of a mesh in messages. Triangles are named by number and place, vertices by number
// and coordinates, both counted as the file does (OBJ from 1, the others from 0).
struct MeshNames {
    std::string file = "mesh";
    std::int64_t first = 0;                                    // number of the first vertex and triangle
    std::vector<std::int64_t> vertex_number, triangle_number;  // empty: as in memory
    std::vector<Place> triangle_place;                         // empty: without
    std::vector<Eigen::Vector3d> triangle_centre;  // of triangles that are not the file's: they are named by these

    // Writes the numbers of this many elements down if they are those in memory.
    void number_vertices(std::size_t count);
    void number_triangles(std::size_t count);
};
struct ImportedMesh {
    TriangleMesh mesh;
    MeshNames names;
    std::vector<std::string> notes;  // what was changed, in full sentences
};
std::string triangle_name(const ImportedMesh& mesh, std::size_t triangle);
std::string vertex_name(const ImportedMesh& mesh, int vertex);
[[noreturn]] void refuse(const ImportedMesh& mesh, const std::string& message);  // a MeshError that names the file

// The triangles of a file; the extension gives the format (.obj .off .ply .stl, in either case). Polygons become
// triangles. Vertices at the same place become one; so do those nearer than `weld` (in the units of the file), and
// triangles that collapse are dropped, with a note. Faces with a vertex twice are errors unless `drop_degenerate`.
// `bytes`: of the file, if they have been read. Throws MeshError; never returns part of a file.
ImportedMesh read_mesh(const std::filesystem::path& path, double weld = 0, bool drop_degenerate = false,
                       const std::string* bytes = nullptr);

}  // namespace tubule::surface3d
