#include "surface3d/import/import_check.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

#include "surface3d/mesh/self_intersection.hpp"

namespace tubule::surface3d {

namespace {

using Eigen::Vector3d;

constexpr double degrees = 180 / std::numbers::pi;

Vector3d area_vector(const TriangleMesh& mesh, std::size_t t) {
    const auto& [a, b, c] = mesh.triangles[t];
    return 0.5 * (mesh.points[b] - mesh.points[a]).cross(mesh.points[c] - mesh.points[a]);
}

void check_triangles(const ImportedMesh& in) {
    const TriangleMesh& mesh = in.mesh;
    if (mesh.period != 0) refuse(in, "a periodic mesh is not closed");
    if (mesh.triangles.empty()) refuse(in, "the mesh has no triangles");
    const int points = int(mesh.points.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& corner = mesh.triangles[t];
        double longest = 0;
        for (int i = 0; i < 3; ++i) {
            const int a = corner[i], b = corner[(i + 1) % 3];
            if (a < 0 || a >= points)
                refuse(in, fmt::format("{} uses point {}, but there are {}", triangle_name(in, t), a, points));
            if (!mesh.points[a].allFinite()) refuse(in, vertex_name(in, a) + " is not finite");
            if (a == b)
                refuse(in, fmt::format("{} is degenerate: {} occurs twice in it", triangle_name(in, t),
                                       vertex_name(in, a)));
            if (b >= 0 && b < points) longest = std::max(longest, (mesh.points[b] - mesh.points[a]).norm());
        }
        // In float coordinates (STL), heights below 1e-6 of a side are rounding.
        if (2 * area_vector(mesh, t).norm() <= 1e-6 * longest * longest) {
            refuse(in, fmt::format("{} is degenerate: {}, {} and {} are collinear", triangle_name(in, t),
                                   vertex_name(in, corner[0]), vertex_name(in, corner[1]), vertex_name(in, corner[2])));
        }
    }
}

void check_duplicates(const ImportedMesh& in) {
    std::vector<std::pair<std::array<int, 3>, std::size_t>> sorted;
    for (std::size_t t = 0; t < in.mesh.triangles.size(); ++t) {
        sorted.emplace_back(in.mesh.triangles[t], t);
        std::sort(sorted.back().first.begin(), sorted.back().first.end());
    }
    std::sort(sorted.begin(), sorted.end());
    std::pair first{sorted.size(), sorted.size()};
    for (std::size_t i = 1; i < sorted.size(); ++i) {
        if (sorted[i].first == sorted[i - 1].first) first = std::min(first, {sorted[i - 1].second, sorted[i].second});
    }
    if (first.first == sorted.size()) return;
    refuse(in, fmt::format("duplicate faces: {} and {} have the same vertices", triangle_name(in, first.first),
                           triangle_name(in, first.second)));
}

struct HalfEdge {
    int low, high;  // vertices
    std::size_t triangle;
    int corner;    // the edge goes from this corner to the next
    bool forward;  // from low to high
};

// Sorted by edge, then triangle.
std::vector<HalfEdge> half_edges(const TriangleMesh& mesh) {
    std::vector<HalfEdge> out;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (int i = 0; i < 3; ++i) {
            const int a = mesh.triangles[t][i], b = mesh.triangles[t][(i + 1) % 3];
            out.push_back({std::min(a, b), std::max(a, b), t, i, a < b});
        }
    }
    std::sort(out.begin(), out.end(), [](const HalfEdge& a, const HalfEdge& b) {
        return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
    });
    return out;
}

// Every edge belongs to two triangles, which run along it in opposite ways.
void check_edges(const ImportedMesh& in, const std::vector<HalfEdge>& edges) {
    std::size_t first = edges.size(), count = 0, open = 0;  // begin and size of the first bad group
    for (std::size_t i = 0, n = 0; i < edges.size(); i += n) {
        for (n = 1; i + n < edges.size() && edges[i + n].low == edges[i].low && edges[i + n].high == edges[i].high;)
            ++n;
        open += n == 1;
        if (n == 2 && edges[i].forward != edges[i + 1].forward) continue;
        if (first == edges.size() || edges[i].triangle < edges[first].triangle) first = i, count = n;
    }
    if (first == edges.size()) return;
    const HalfEdge& e = edges[first];
    const std::string edge = fmt::format("edge from {} to {}", vertex_name(in, e.forward ? e.low : e.high),
                                         vertex_name(in, e.forward ? e.high : e.low));
    if (count == 1) {
        refuse(in, fmt::format("the mesh is open: the {} of {} belongs to no other triangle ({} such edges; if the "
                               "surface is closed there, weld its vertices)",
                               edge, triangle_name(in, e.triangle), open));
    }
    if (count == 2) {
        refuse(in, fmt::format("inconsistently oriented: {} and {} traverse the same direction along the {}; turn one "
                               "of them, or let shape.remesh do so",
                               triangle_name(in, e.triangle), triangle_name(in, edges[first + 1].triangle), edge));
    }
    refuse(in, fmt::format("non-manifold edge: the {} belongs to {} triangles, among them {}, {} and {}", edge, count,
                           triangle_name(in, e.triangle), triangle_name(in, edges[first + 1].triangle),
                           triangle_name(in, edges[first + 2].triangle)));
}

// neighbour[t][i] across the edge from corner i to the next.
std::vector<std::array<std::size_t, 3>> neighbours(const TriangleMesh& mesh, const std::vector<HalfEdge>& edges) {
    std::vector<std::array<std::size_t, 3>> out(mesh.triangles.size());
    for (std::size_t i = 0; i < edges.size(); i += 2) {
        out[edges[i].triangle][edges[i].corner] = edges[i + 1].triangle;
        out[edges[i + 1].triangle][edges[i + 1].corner] = edges[i].triangle;
    }
    return out;
}

int corner_of(const TriangleMesh& mesh, std::size_t t, int v) {
    const auto& corner = mesh.triangles[t];
    return int(std::find(corner.begin(), corner.end(), v) - corner.begin());
}

// The triangles at a vertex follow each other around it.
void check_fans(const ImportedMesh& in, const std::vector<std::array<std::size_t, 3>>& across) {
    const TriangleMesh& mesh = in.mesh;
    std::vector<int> size(mesh.points.size());
    for (const auto& corner : mesh.triangles) {
        for (const int v : corner) ++size[v];
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const int v : mesh.triangles[t]) {
            if (size[v] == 0) continue;  // seen
            std::set<std::size_t> fan;
            for (std::size_t s = t; fan.insert(s).second;) s = across[s][corner_of(mesh, s, v)];
            if (int(fan.size()) == std::exchange(size[v], 0)) continue;
            std::size_t other = t;
            while (fan.contains(other) || corner_of(mesh, other, v) == 3) ++other;
            refuse(in,
                   fmt::format("non-manifold vertex: {} and {} meet at {}, but no fan of triangles around it connects "
                               "them",
                               triangle_name(in, t), triangle_name(in, other), vertex_name(in, v)));
        }
    }
}

void check_connected(const ImportedMesh& in, const std::vector<std::array<std::size_t, 3>>& across) {
    std::vector<int> component(across.size(), -1);
    int count = 0;
    std::size_t second = 0;
    for (std::size_t seed = 0; seed < across.size(); ++seed) {
        if (component[seed] >= 0) continue;
        if (count == 1) second = seed;
        std::vector<std::size_t> stack{seed};
        component[seed] = count;
        while (!stack.empty()) {
            const std::size_t t = stack.back();
            stack.pop_back();
            for (const std::size_t s : across[t]) {
                if (component[s] < 0) component[s] = count, stack.push_back(s);
            }
        }
        ++count;
    }
    if (count > 1) {
        refuse(in, fmt::format("the mesh consists of {} separate surfaces: {} is not connected to {}; keep one of them "
                               "in a file",
                               count, triangle_name(in, second), triangle_name(in, 0)));
    }
}

void drop_isolated(ImportedMesh& in) {
    TriangleMesh& mesh = in.mesh;
    std::vector<int> number(mesh.points.size(), -1);
    for (const auto& corner : mesh.triangles) {
        for (const int v : corner) number[v] = 0;
    }
    std::size_t used = 0;
    for (std::size_t v = 0; v < number.size(); ++v) {
        if (number[v] < 0) continue;
        mesh.points[used] = mesh.points[v];
        if (!in.names.vertex_number.empty()) in.names.vertex_number[used] = in.names.vertex_number[v];
        number[v] = int(used++);
    }
    if (used == mesh.points.size()) return;
    in.notes.push_back(fmt::format("{} vertices belong to no triangle and were dropped.", mesh.points.size() - used));
    mesh.points.resize(used);
    if (!in.names.vertex_number.empty()) in.names.vertex_number.resize(used);
    for (auto& corner : mesh.triangles) {
        for (int& v : corner) v = number[v];
    }
}

// About the first point, not the origin: a small body far away keeps its digits.
double volume(const TriangleMesh& mesh) {
    double sum = 0;
    const Vector3d origin = mesh.points[mesh.triangles[0][0]];
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        sum += area_vector(mesh, t).dot(mesh.points[mesh.triangles[t][0]] - origin) / 3;
    }
    return sum;
}

double smallest_angle(const TriangleMesh& mesh, std::size_t t) {
    double angle = std::numbers::pi;
    for (int i = 0; i < 3; ++i) {
        const Vector3d& x = mesh.points[mesh.triangles[t][i]];
        const Vector3d a = mesh.points[mesh.triangles[t][(i + 1) % 3]] - x;
        const Vector3d b = mesh.points[mesh.triangles[t][(i + 2) % 3]] - x;
        angle = std::min(angle, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
    return angle;
}

MeshReport measure(const TriangleMesh& mesh, const std::vector<HalfEdge>& edges) {
    MeshReport report{.vertices = mesh.points.size(), .edges = edges.size() / 2, .triangles = mesh.triangles.size()};
    report.euler = int(report.vertices) - int(report.edges) + int(report.triangles);
    report.genus = (2 - report.euler) / 2;
    report.volume = volume(mesh);
    report.edge_min = HUGE_VAL;
    report.angle_min = 180;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        report.area += area_vector(mesh, t).norm();
        report.angle_min = std::min(report.angle_min, degrees * smallest_angle(mesh, t));
    }
    for (std::size_t i = 0; i < edges.size(); i += 2) {
        const Vector3d a = area_vector(mesh, edges[i].triangle), b = area_vector(mesh, edges[i + 1].triangle);
        const double kink = degrees * std::atan2(a.cross(b).norm(), a.dot(b));
        const double length = (mesh.points[edges[i].high] - mesh.points[edges[i].low]).norm();
        report.edge_min = std::min(report.edge_min, length);
        report.edge_max = std::max(report.edge_max, length);
        if (kink <= report.kink_max) continue;
        report.kink_max = kink;
        report.kink_first = edges[i].triangle, report.kink_second = edges[i + 1].triangle;
    }
    return report;
}

}  // namespace

MeshReport close_mesh(ImportedMesh& in) {
    check_triangles(in);
    check_duplicates(in);
    drop_isolated(in);
    const std::vector<HalfEdge> edges = half_edges(in.mesh);
    check_edges(in, edges);
    const auto across = neighbours(in.mesh, edges);
    check_fans(in, across);
    check_connected(in, across);
    if (const auto pair = first_intersection(in.mesh)) {
        refuse(in, fmt::format("the surface intersects itself: {} intersects {}", triangle_name(in, pair->first),
                               triangle_name(in, pair->second)));
    }
    MeshReport report = measure(in.mesh, edges);
    if (report.volume < 0) {
        for (auto& corner : in.mesh.triangles) std::swap(corner[1], corner[2]);
        report.volume = -report.volume;
        in.notes.push_back("All triangles faced inward; their orientation was reversed.");
    }
    if (report.kink_max > 60) {
        in.notes.push_back(
            fmt::format("The largest kink is {2:.0f} degrees, between {0} and {1}: a smooth surface "
                        "through such edges is a guess.",
                        triangle_name(in, report.kink_first), triangle_name(in, report.kink_second), report.kink_max));
    }
    return report;
}

}  // namespace tubule::surface3d
