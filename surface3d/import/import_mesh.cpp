#include "surface3d/import/import_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/case/input_file.hpp"
#include "common/case/read.hpp"
#include "surface3d/import/import_formats.hpp"

namespace tubule::surface3d {

namespace {

constexpr std::size_t corners_max = 1000;             // of a polygon: the cost of triangulation is cubic
constexpr std::size_t largest_file = 512 * megabyte;  // several million triangles
// The size of a mesh whose areas, squared, are far from the limits of numbers.
constexpr double smallest_size = 1e-30, largest_size = 1e30;

std::string contents(const std::filesystem::path& path) {
    std::string data;
    try {
        data = read_input(path, largest_file);
    } catch (const CaseError& error) {
        throw MeshError(error.what());
    }
    if (data.empty()) throw MeshError(path.string() + ": is empty");
    return data;
}

FileMesh read_file(const std::filesystem::path& path, const std::string* bytes) {
    const std::string extension = path.extension().string(), name = path.string();
    const auto reader = is_keyword(extension, ".obj")   ? read_obj
                        : is_keyword(extension, ".off") ? read_off
                        : is_keyword(extension, ".ply") ? read_ply
                        : is_keyword(extension, ".stl") ? read_stl
                                                        : nullptr;
    if (!reader) throw MeshError(fmt::format("{}: the extension must be .obj, .off, .ply or .stl", name));
    return reader(name, bytes ? *bytes : contents(path));
}

// Checks the vertices of a face and cuts it into triangles, unless it is to be dropped for having a vertex twice:
// false.
bool add_face(const std::vector<FileCorner>& face, bool drop_degenerate, std::int64_t first, ImportedMesh& out) {
    const std::int64_t vertices = std::int64_t(out.mesh.points.size());
    if (face.size() > corners_max)
        refuse_at(out.file, face[0].place,
                  fmt::format("a face has {} vertices; polygons of at most {} can be triangulated", face.size(),
                              corners_max));
    std::vector<Eigen::Vector3d> corners;
    bool twice = false;
    for (auto corner = face.begin(); corner != face.end(); ++corner) {
        const auto [vertex, place] = *corner;
        if (vertex < 0 || vertex >= vertices)
            refuse_at(out.file, place,
                      fmt::format("the face uses vertex {}, but vertices are numbered {} to {}", vertex + first, first,
                                  vertices - 1 + first));
        const bool again = std::ranges::find(face.begin(), corner, vertex, &FileCorner::vertex) != corner;
        if (again && !drop_degenerate)
            refuse_at(out.file, place, fmt::format("degenerate face: vertex {} occurs twice", vertex + first));
        twice = twice || again;
        corners.push_back(out.mesh.points[vertex]);
    }
    if (twice) return false;
    const auto cut = face.size() == 3 ? std::vector<std::array<int, 3>>{{0, 1, 2}} : cut_polygon(corners);
    if (cut.empty())
        refuse_at(out.file, face[0].place,
                  fmt::format("a face of {} vertices crosses itself or has no area", face.size()));
    for (const auto& [a, b, c] : cut) {
        out.source.push_back({std::int64_t(out.source.size()) + first, face[0].place});
        out.mesh.triangles.push_back({int(face[a].vertex), int(face[b].vertex), int(face[c].vertex)});
    }
    return true;
}

// For each point the first one at the same place, or within `weld` of it.
std::vector<int> representatives(const std::vector<Eigen::Vector3d>& points, double weld) {
    using Cell = std::array<double, 3>;  // of a grid of that width; without one, the point itself
    std::multimap<Cell, int> cells;
    std::vector<int> first(points.size());
    const int reach = weld > 0 ? 1 : 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        Cell home;
        for (int d = 0; d < 3; ++d) home[d] = weld > 0 ? std::floor(points[i][d] / weld) : points[i][d];
        first[i] = int(i);
        for (int n = 0; n < (reach ? 27 : 1); ++n) {
            const Cell cell{home[0] + reach * (n % 3 - 1), home[1] + reach * (n / 3 % 3 - 1),
                            home[2] + reach * (n / 9 - 1)};
            const auto [begin, end] = cells.equal_range(cell);
            for (auto it = begin; it != end; ++it)
                if ((points[it->second] - points[i]).norm() <= weld) first[i] = std::min(first[i], it->second);
        }
        if (first[i] == int(i)) cells.emplace(home, int(i));
    }
    return first;
}

void merge_vertices(ImportedMesh& out, double weld) {
    const std::vector<int> first = representatives(out.mesh.points, weld);
    std::vector<bool> keep_vertex, keep_triangle;
    for (std::size_t i = 0; i < first.size(); ++i) keep_vertex.push_back(first[i] == int(i));
    for (auto& t : out.mesh.triangles) {
        for (int& v : t) v = first[v];
        // Without welding a triangle that has no area is kept, so that the checks name and reject it.
        keep_triangle.push_back(weld == 0 || !has_vertex_twice(t));
    }
    if (const std::size_t lost = keep_triangles(out, keep_triangle))
        out.notes.push_back(fmt::format("{} triangles collapsed when vertices were welded, and were dropped.", lost));
    keep_vertices(out, keep_vertex);
}

}  // namespace

ImportedMesh imported(TriangleMesh mesh, const std::string& file, std::int64_t first) {
    ImportedMesh out{.mesh = std::move(mesh), .file = file, .vertex_number = {}, .source = {}, .notes = {}};
    for (std::size_t v = 0; v < out.mesh.points.size(); ++v) out.vertex_number.push_back(std::int64_t(v) + first);
    for (std::size_t t = 0; t < out.mesh.triangles.size(); ++t) out.source.push_back({std::int64_t(t) + first});
    return out;
}

std::string triangle_name(const ImportedMesh& in, std::size_t triangle) {
    if (in.is_new) {
        const auto& [a, b, c] = in.mesh.triangles[triangle];
        const Eigen::Vector3d x = (in.mesh.points[a] + in.mesh.points[b] + in.mesh.points[c]) / 3;
        return "the new triangle at " + words_of_place(x, 6);
    }
    const auto& [number, place] = in.source[triangle];
    if (place.line > 0) return fmt::format("triangle {} (line {})", number, place.line);
    if (place.byte > 0) return fmt::format("triangle {} (byte {})", number, place.byte);
    return fmt::format("triangle {}", number);
}

std::string vertex_name(const ImportedMesh& in, int vertex) {
    return fmt::format("vertex {} {}", in.vertex_number[vertex], words_of_place(in.mesh.points[vertex], 6));
}

std::size_t keep_triangles(ImportedMesh& in, const std::vector<bool>& keep) {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < keep.size(); ++t) {
        if (!keep[t]) continue;
        in.mesh.triangles[kept] = in.mesh.triangles[t];
        in.source[kept++] = in.source[t];
    }
    in.mesh.triangles.resize(kept), in.source.resize(kept);
    return keep.size() - kept;
}

std::size_t keep_vertices(ImportedMesh& in, const std::vector<bool>& keep) {
    std::vector<int> number(keep.size());
    std::size_t kept = 0;
    for (std::size_t v = 0; v < keep.size(); ++v) {
        if (!keep[v]) continue;
        number[v] = int(kept);
        in.mesh.points[kept] = in.mesh.points[v];
        in.vertex_number[kept++] = in.vertex_number[v];
    }
    in.mesh.points.resize(kept), in.vertex_number.resize(kept);
    for (auto& t : in.mesh.triangles)
        for (int& v : t) v = number[v];
    return keep.size() - kept;
}

void refuse(const ImportedMesh& in, const std::string& message) {
    throw MeshError(in.file + ": " + message);
}

ImportedMesh read_mesh(const std::filesystem::path& path, double weld, bool drop_degenerate, const std::string* bytes) {
    if (!(weld >= 0) || !std::isfinite(weld))
        throw MeshError(fmt::format("{}: weld must be a number >= 0, not {}", path.string(), weld));
    const FileMesh file = read_file(path, bytes);
    if (file.faces.empty()) throw MeshError(path.string() + ": the file contains no faces");
    if (file.points.empty()) throw MeshError(path.string() + ": the file contains no vertices");
    double size = 0;
    for (const Eigen::Vector3d& x : file.points) size = std::max(size, x.lpNorm<Eigen::Infinity>());
    if (!(size > smallest_size && size < largest_size))
        throw MeshError(
            fmt::format("{}: the largest coordinate is {:g}; it must be between {:g} and {:g}: choose "
                        "another unit of length",
                        path.string(), size, smallest_size, largest_size));
    if (weld > 0 && weld < 1e-15 * size)
        throw MeshError(fmt::format("{}: weld = {:g} is below the rounding error of coordinates as large as {:g}",
                                    path.string(), weld, size));
    ImportedMesh out = imported({.points = file.points, .triangles = {}, .shifts = {}}, path.string(), file.first);
    std::size_t dropped = 0;
    for (const std::vector<FileCorner>& face : file.faces) dropped += !add_face(face, drop_degenerate, file.first, out);
    if (dropped > 0) out.notes.push_back(fmt::format("{} faces with a vertex twice were dropped.", dropped));
    merge_vertices(out, weld);
    return out;
}

}  // namespace tubule::surface3d
