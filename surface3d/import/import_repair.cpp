#include "surface3d/import/import_repair.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "surface3d/import/mesh_smoothing.hpp"

namespace tubule::surface3d {

namespace {

constexpr double speck = 0.01;  // of the area of the largest piece
constexpr const char* wrapping = "shape.wrap = LENGTH puts one surface around everything, closing gaps of that length";

// Keeps the triangles for which keep(number).
template <class Keep>
std::size_t drop_triangles(ImportedMesh& in, const Keep& keep) {
    std::size_t kept = 0;
    const std::size_t count = in.mesh.triangles.size();
    in.names.number_triangles(count);
    for (std::size_t t = 0; t < count; ++t) {
        if (!keep(t)) continue;
        in.mesh.triangles[kept] = in.mesh.triangles[t];
        in.names.triangle_number[kept] = in.names.triangle_number[t];
        if (!in.names.triangle_place.empty()) in.names.triangle_place[kept] = in.names.triangle_place[t];
        ++kept;
    }
    in.mesh.triangles.resize(kept), in.names.triangle_number.resize(kept);
    if (!in.names.triangle_place.empty()) in.names.triangle_place.resize(kept);
    return count - kept;
}

void drop_useless(ImportedMesh& in) {
    std::set<std::array<int, 3>> seen;
    std::size_t degenerate = 0;
    const std::size_t dropped = drop_triangles(in, [&](std::size_t t) {
        std::array<int, 3> sorted = in.mesh.triangles[t];
        std::sort(sorted.begin(), sorted.end());
        const bool has_area = sorted[0] != sorted[1] && sorted[1] != sorted[2];
        degenerate += !has_area;
        return has_area && seen.insert(sorted).second;
    });
    if (degenerate > 0) in.notes.push_back(fmt::format("{} triangles with a vertex twice were dropped.", degenerate));
    if (dropped > degenerate)
        in.notes.push_back(fmt::format("{} repeated triangles were dropped.", dropped - degenerate));
    if (in.mesh.triangles.empty()) refuse(in, "no triangle has an area");
}

// The triangles at each edge (low vertex, high vertex).
using Edges = std::map<std::pair<int, int>, std::vector<std::size_t>>;

Edges edges_of(const TriangleMesh& mesh) {
    Edges edges;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int i = 0; i < 3; ++i) {
            const auto [low, high] = std::minmax(mesh.triangles[t][i], mesh.triangles[t][(i + 1) % 3]);
            edges[{low, high}].push_back(t);
        }
    return edges;
}

bool runs(const std::array<int, 3>& corner, int from, int to) {
    for (int i = 0; i < 3; ++i)
        if (corner[i] == from && corner[(i + 1) % 3] == to) return true;
    return false;
}

void check_edges(const ImportedMesh& in, const Edges& edges) {
    for (const auto& [edge, at] : edges)
        if (at.size() > 2)
            refuse(in,
                   fmt::format("non-manifold edge: the edge from {} to {} belongs to {} triangles, among them {}, {} "
                               "and {}; {}",
                               vertex_name(in, edge.first), vertex_name(in, edge.second), at.size(),
                               triangle_name(in, at[0]), triangle_name(in, at[1]), triangle_name(in, at[2]), wrapping));
}

void check_closed(const ImportedMesh& in, const Edges& edges) {
    std::size_t open = 0;
    const std::pair<int, int>* first = nullptr;
    for (const auto& [edge, at] : edges)
        if (at.size() == 1 && open++ == 0) first = &edge;
    if (!first) return;
    const std::size_t t = edges.at(*first)[0];
    refuse(in,
           fmt::format("the mesh is open: the edge from {} to {} of {} belongs to no other triangle ({} such edges); "
                       "if the surface is closed there, shape.weld joins vertices that are near each other; "
                       "shape.fill_holes = true closes holes",
                       vertex_name(in, first->first), vertex_name(in, first->second), triangle_name(in, t), open));
}

// Makes each triangle face as its neighbours do, from the first of its piece on; the number of the piece of each.
std::vector<int> orient(ImportedMesh& in, const Edges& edges) {
    std::vector<int> piece(in.mesh.triangles.size(), -1);
    std::vector<std::size_t> turned, total;
    std::vector<bool> is_turned(piece.size());
    for (std::size_t seed = 0; seed < piece.size(); ++seed) {
        if (piece[seed] >= 0) continue;
        const int number = int(total.size());
        total.push_back(0), turned.push_back(0);
        std::vector<std::size_t> stack{seed};
        piece[seed] = number;
        while (!stack.empty()) {
            const std::size_t t = stack.back();
            stack.pop_back();
            ++total.back(), turned.back() += is_turned[t];
            for (int i = 0; i < 3; ++i) {
                const int from = in.mesh.triangles[t][i], to = in.mesh.triangles[t][(i + 1) % 3];
                for (const std::size_t s : edges.at(std::minmax(from, to))) {
                    if (s == t) continue;
                    std::array<int, 3>& other = in.mesh.triangles[s];
                    const bool differs = runs(other, from, to);
                    if (differs && piece[s] >= 0)
                        refuse(in, fmt::format("the surface has only one side, like a Moebius strip: {} and {} cannot "
                                               "face the same way, whichever way their neighbours do; {}",
                                               triangle_name(in, t), triangle_name(in, s), wrapping));
                    if (piece[s] >= 0) continue;
                    if (differs) std::swap(other[1], other[2]), is_turned[s] = true;
                    piece[s] = number;
                    stack.push_back(s);
                }
            }
        }
    }
    std::size_t sum = 0;  // the fewer of a piece are those that faced the wrong way
    for (std::size_t i = 0; i < total.size(); ++i) sum += std::min(turned[i], total[i] - turned[i]);
    if (sum > 0)
        in.notes.push_back(fmt::format("{} of {} triangles faced the other way than their neighbours and were turned.",
                                       sum, piece.size()));
    return piece;
}

// The name of a triangle of every piece that stays.
std::vector<std::string> drop_specks(ImportedMesh& in, const std::vector<int>& piece) {
    std::vector<double> area;
    std::vector<std::string> name;
    for (std::size_t t = 0; t < piece.size(); ++t) {
        const auto& [a, b, c] = in.mesh.triangles[t];
        const auto& x = in.mesh.points;
        if (piece[t] >= int(area.size())) area.push_back(0), name.push_back(triangle_name(in, t));
        area[piece[t]] += (x[b] - x[a]).cross(x[c] - x[a]).norm() / 2;
    }
    const double largest = *std::ranges::max_element(area);
    std::size_t specks = 0;
    std::vector<std::string> stay;
    for (std::size_t i = 0; i < area.size(); ++i) {
        if (area[i] < speck * largest)
            ++specks;
        else
            stay.push_back(name[i]);
    }
    const std::size_t dropped = drop_triangles(in, [&](std::size_t t) { return area[piece[t]] >= speck * largest; });
    if (specks > 0)
        in.notes.push_back(
            fmt::format("{} pieces of less than 1 percent of the area of the largest, {} triangles in all, were "
                        "dropped.",
                        specks, dropped));
    return stay;
}

// The triangles around a vertex that are connected by edges there.
struct Fan {
    std::vector<std::size_t> triangles;
    bool open = false;
};
std::vector<Fan> fans_at(const TriangleMesh& mesh, const Edges& edges, int v, const std::vector<std::size_t>& around) {
    std::set<std::size_t> left(around.begin(), around.end());
    std::vector<Fan> fans;
    while (!left.empty()) {
        Fan& fan = fans.emplace_back();
        fan.triangles.push_back(*left.begin());
        left.erase(left.begin());
        for (std::size_t i = 0; i < fan.triangles.size(); ++i)
            for (const int w : mesh.triangles[fan.triangles[i]]) {
                if (w == v) continue;
                const std::vector<std::size_t>& both = edges.at(std::minmax(v, w));
                fan.open = fan.open || both.size() == 1;
                for (const std::size_t t : both)
                    if (left.erase(t) > 0) fan.triangles.push_back(t);
            }
    }
    return fans;
}

// A vertex where sheets touch that share no edge there: closed ones are an error, borders are taken apart.
void part_vertices(ImportedMesh& in, const Edges& edges) {
    TriangleMesh& mesh = in.mesh;
    std::vector<std::vector<std::size_t>> at(mesh.points.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const int v : mesh.triangles[t]) at[v].push_back(t);
    std::vector<std::pair<int, Fan>> parted;
    for (int v = 0; v < int(at.size()); ++v) {
        std::vector<Fan> fans = fans_at(mesh, edges, v, at[v]);
        if (fans.size() < 2) continue;
        if (!std::ranges::all_of(fans, &Fan::open))
            refuse(in,
                   fmt::format("non-manifold vertex: {} and {} meet at {}, but no fan of triangles around it connects "
                               "them: two surfaces, or two parts of one, touch there; move them apart, or {}",
                               triangle_name(in, fans[0].triangles[0]), triangle_name(in, fans[1].triangles[0]),
                               vertex_name(in, v), wrapping));
        for (std::size_t i = 1; i < fans.size(); ++i) parted.emplace_back(v, std::move(fans[i]));
    }
    if (parted.empty()) return;
    in.names.number_vertices(mesh.points.size());
    for (const auto& [v, fan] : parted) {
        for (const std::size_t t : fan.triangles)
            std::replace(mesh.triangles[t].begin(), mesh.triangles[t].end(), v, int(mesh.points.size()));
        mesh.points.push_back(mesh.points[v]);
        in.names.vertex_number.push_back(in.names.vertex_number[v]);
    }
    in.notes.push_back(fmt::format("At {} vertices borders touched; they were taken apart.", parted.size()));
}

void check_one_piece(const ImportedMesh& in, const std::vector<std::string>& pieces) {
    if (pieces.size() > 1)
        refuse(in, fmt::format("the mesh consists of {} separate surfaces: {} is not connected to {}; a case has one "
                               "membrane: keep one of them in the file",
                               pieces.size(), pieces[1], pieces[0]));
}

}  // namespace

void repair_mesh(ImportedMesh& in, bool may_be_open) {
    drop_useless(in);
    Edges edges = edges_of(in.mesh);
    check_edges(in, edges);
    const std::vector<std::string> pieces = drop_specks(in, orient(in, edges));
    edges = edges_of(in.mesh);
    if (!may_be_open) check_closed(in, edges);
    part_vertices(in, edges);
    check_one_piece(in, pieces);
    const bool closed = std::ranges::all_of(edges, [](const auto& edge) { return edge.second.size() == 2; });
    if (closed && mesh_volume(in.mesh) < 0) {
        for (auto& corner : in.mesh.triangles) std::swap(corner[1], corner[2]);
        in.notes.emplace_back("The surface faced inward; it was turned inside out.");
    }
}

}  // namespace tubule::surface3d
