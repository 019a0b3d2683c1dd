#include "surface3d/import/import_mesh.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "common/case/input_file.hpp"
#include "common/case/read.hpp"
#include "surface3d/import/import_formats.hpp"
#include "surface3d/import/import_text.hpp"

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

// Checks the vertices of each face and triangulates those with more than three.
void add_triangles(const FileMesh& file, const std::string& name, bool drop_degenerate, ImportedMesh& out) {
    std::size_t dropped = 0;
    const std::int64_t vertices = std::int64_t(file.points.size());
    for (const std::vector<FileCorner>& face : file.faces) {
        if (face.size() > corners_max) {
            throw MeshError(at(name, face[0].place) +
                            fmt::format("a face has {} vertices; polygons of at most {} can be triangulated",
                                        face.size(), corners_max));
        }
        std::vector<Eigen::Vector3d> corners;
        bool twice = false;
        for (std::size_t i = 0; i < face.size(); ++i) {
            const auto [vertex, place] = face[i];
            if (vertex < 0 || vertex >= vertices) {
                throw MeshError(at(name, place) +
                                fmt::format("the face uses vertex {}, but vertices are numbered {} to {}",
                                            vertex + file.first, file.first, vertices - 1 + file.first));
            }
            for (std::size_t j = 0; j < i; ++j) {
                if (face[j].vertex != vertex) continue;
                twice = true;
                if (!drop_degenerate) {
                    throw MeshError(at(name, place) +
                                    fmt::format("degenerate face: vertex {} occurs twice", vertex + file.first));
                }
            }
            corners.push_back(file.points[vertex]);
        }
        if (twice) {
            ++dropped;
            continue;
        }
        auto cut = face.size() == 3 ? std::vector<std::array<int, 3>>{{0, 1, 2}} : cut_polygon(corners);
        if (cut.empty()) {
            throw MeshError(at(name, face[0].place) +
                            fmt::format("a face of {} vertices crosses itself or has no area", face.size()));
        }
        for (const auto& [a, b, c] : cut) {
            out.mesh.triangles.push_back({int(face[a].vertex), int(face[b].vertex), int(face[c].vertex)});
            out.names.triangle_place.push_back(face[0].place);
        }
    }
    if (dropped > 0) out.notes.push_back(fmt::format("{} faces with a vertex twice were dropped.", dropped));
}

using Cell = std::array<std::int64_t, 3>;

struct CellHash {
    std::size_t operator()(const Cell& cell) const {
        std::uint64_t hash = 0;
        for (const std::int64_t i : cell) hash = (hash ^ std::uint64_t(i)) * 0x9E3779B97F4A7C15u, hash ^= hash >> 29;
        return hash;
    }
};

// For each point the first one at the same place, or within `weld` of it.
std::vector<int> representatives(const std::vector<Eigen::Vector3d>& points, double weld) {
    std::unordered_multimap<Cell, int, CellHash> cells;
    std::vector<int> first(points.size());
    const int reach = weld > 0 ? 1 : 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        Cell home;
        for (int d = 0; d < 3; ++d) {
            // + 0.0 makes the two zeros one.
            home[d] = weld > 0 ? std::int64_t(std::floor(points[i][d] / weld))
                               : std::bit_cast<std::int64_t>(points[i][d] + 0.0);
        }
        first[i] = int(i);
        for (int n = 0; n < (reach ? 27 : 1); ++n) {
            const Cell cell{home[0] + reach * (n % 3 - 1), home[1] + reach * (n / 3 % 3 - 1),
                            home[2] + reach * (n / 9 - 1)};
            const auto [begin, end] = cells.equal_range(cell);
            for (auto it = begin; it != end; ++it) {
                if ((points[it->second] - points[i]).norm() <= weld) first[i] = std::min(first[i], it->second);
            }
        }
        if (first[i] == int(i)) cells.emplace(home, int(i));
    }
    return first;
}

void merge_vertices(ImportedMesh& out, double weld) {
    TriangleMesh& mesh = out.mesh;
    const std::vector<int> merged = representatives(mesh.points, weld);
    std::vector<int> number(mesh.points.size());
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        if (merged[i] != int(i)) continue;
        number[i] = int(points.size());
        points.push_back(mesh.points[i]);
        out.names.vertex_number.push_back(std::int64_t(i) + out.names.first);
    }
    std::vector<std::array<int, 3>> triangles;
    std::vector<Place> places;
    std::vector<std::int64_t> numbers;
    const auto collapsed = [](const std::vector<int>& to, const std::array<int, 3>& t) {
        return to[t[0]] == to[t[1]] || to[t[1]] == to[t[2]] || to[t[2]] == to[t[0]];
    };
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const std::array<int, 3>& old = mesh.triangles[t];
        // Without welding a triangle that has no area is kept, so that the checks name and reject it.
        if (weld > 0 && collapsed(merged, old)) continue;
        triangles.push_back({number[merged[old[0]]], number[merged[old[1]]], number[merged[old[2]]]});
        places.push_back(out.names.triangle_place[t]);
        numbers.push_back(std::int64_t(t) + out.names.first);
    }
    const std::size_t lost = mesh.triangles.size() - triangles.size();
    if (lost > 0)
        out.notes.push_back(fmt::format("{} triangles collapsed when vertices were welded, and were dropped.", lost));
    mesh.points = std::move(points);
    mesh.triangles = std::move(triangles);
    out.names.triangle_place = std::move(places);
    out.names.triangle_number = std::move(numbers);
}

void number(std::vector<std::int64_t>& numbers, std::size_t count, std::int64_t first) {
    if (!numbers.empty()) return;
    numbers.resize(count);
    std::iota(numbers.begin(), numbers.end(), first);
}

}  // namespace

void MeshNames::number_vertices(std::size_t count) {
    number(vertex_number, count, first);
}
void MeshNames::number_triangles(std::size_t count) {
    number(triangle_number, count, first);
}

std::string triangle_name(const ImportedMesh& mesh, std::size_t triangle) {
    const MeshNames& names = mesh.names;
    if (!names.triangle_centre.empty()) {
        const Eigen::Vector3d& x = names.triangle_centre[triangle];
        return fmt::format("the new triangle at ({:.6g}, {:.6g}, {:.6g})", x[0], x[1], x[2]);
    }
    std::string name = fmt::format("triangle {}", names.triangle_number.empty() ? std::int64_t(triangle) + names.first
                                                                                : names.triangle_number[triangle]);
    if (names.triangle_place.empty()) return name;
    const Place& place = names.triangle_place[triangle];
    return name + (place.line ? fmt::format(" (line {})", place.line) : fmt::format(" (byte {})", place.byte));
}

std::string vertex_name(const ImportedMesh& mesh, int vertex) {
    const std::vector<std::int64_t>& numbers = mesh.names.vertex_number;
    const std::int64_t number = numbers.empty() ? vertex + mesh.names.first : numbers[vertex];
    const Eigen::Vector3d& x = mesh.mesh.points[vertex];
    return fmt::format("vertex {} ({:.6g}, {:.6g}, {:.6g})", number, x[0], x[1], x[2]);
}

void refuse(const ImportedMesh& mesh, const std::string& message) {
    throw MeshError(mesh.names.file + ": " + message);
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
    if (weld > 0 && weld < 1e-15 * size) {
        throw MeshError(fmt::format("{}: weld = {:g} is below the rounding error of coordinates as large as {:g}",
                                    path.string(), weld, size));
    }
    ImportedMesh out;
    out.names.file = path.string();
    out.names.first = file.first;
    out.mesh.points = file.points;
    add_triangles(file, path.string(), drop_degenerate, out);
    merge_vertices(out, weld);
    return out;
}

}  // namespace tubule::surface3d
