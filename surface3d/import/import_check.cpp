#include "surface3d/import/import_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "surface3d/import/mesh_smoothing.hpp"
#include "surface3d/mesh/self_intersection.hpp"

namespace tubule::surface3d {

namespace {

using Eigen::Vector3d;

constexpr double speck = 0.01;  // of the area of the largest piece
constexpr const char* wrapping =
    "shape.wrap = LENGTH, with shape.remesh, puts one surface around everything, closing gaps of that length";

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
        if (2 * area_vector(mesh, corner).norm() <= 1e-6 * longest * longest)
            refuse(in, fmt::format("{} is degenerate: {}, {} and {} are collinear", triangle_name(in, t),
                                   vertex_name(in, corner[0]), vertex_name(in, corner[1]), vertex_name(in, corner[2])));
    }
}

// For each triangle the first one with the same vertices.
std::vector<std::size_t> first_alike(const TriangleMesh& mesh) {
    std::vector<std::pair<std::array<int, 3>, std::size_t>> sorted;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        sorted.emplace_back(mesh.triangles[t], t);
        std::sort(sorted.back().first.begin(), sorted.back().first.end());
    }
    std::sort(sorted.begin(), sorted.end());
    std::vector<std::size_t> first(sorted.size());
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        const bool again = i > 0 && sorted[i].first == sorted[i - 1].first;
        first[sorted[i].second] = again ? first[sorted[i - 1].second] : sorted[i].second;
    }
    return first;
}

void check_duplicates(const ImportedMesh& in) {
    const std::vector<std::size_t> first = first_alike(in.mesh);
    for (std::size_t t = 0; t < first.size(); ++t)
        if (first[t] != t)
            refuse(in, fmt::format("duplicate faces: {} and {} have the same vertices", triangle_name(in, first[t]),
                                   triangle_name(in, t)));
}

void drop_useless(ImportedMesh& in) {
    const std::vector<std::size_t> first = first_alike(in.mesh);
    std::vector<bool> keep;
    std::size_t degenerate = 0;
    for (std::size_t t = 0; t < first.size(); ++t) {
        const bool twice = has_vertex_twice(in.mesh.triangles[t]);
        degenerate += twice;
        keep.push_back(!twice && first[t] == t);
    }
    const std::size_t repeated = keep_triangles(in, keep) - degenerate;
    if (degenerate > 0) in.notes.push_back(fmt::format("{} triangles with a vertex twice were dropped.", degenerate));
    if (repeated > 0) in.notes.push_back(fmt::format("{} repeated triangles were dropped.", repeated));
    if (in.mesh.triangles.empty()) refuse(in, "no triangle has an area");
}

void drop_isolated(ImportedMesh& in) {
    std::vector<bool> used(in.mesh.points.size());
    for (const auto& corner : in.mesh.triangles)
        for (const int v : corner) used[v] = true;
    if (const std::size_t dropped = keep_vertices(in, used))
        in.notes.push_back(fmt::format("{} vertices belong to no triangle and were dropped.", dropped));
}

// An edge as one of its triangles runs along it.
struct Side {
    int low, high;  // vertices
    std::size_t triangle;
    int corner;    // the edge goes from this corner to the next
    bool forward;  // from low to high

    // The corner of the triangle at one end, of all corners of the mesh.
    std::size_t end(bool at_low) const { return 3 * triangle + (forward == at_low ? corner : (corner + 1) % 3); }
};

// The sides of each edge, ascending by triangle.
struct Edges {
    std::vector<Side> sides;
    std::vector<std::span<const Side>> edges;

    explicit Edges(const TriangleMesh& mesh) {
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
            for (int i = 0; i < 3; ++i) {
                const int a = mesh.triangles[t][i], b = mesh.triangles[t][(i + 1) % 3];
                sides.push_back({std::min(a, b), std::max(a, b), t, i, a < b});
            }
        std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
            return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
        });
        for (std::size_t i = 0, n = 0; i < sides.size(); i += n) {
            for (n = 1; i + n < sides.size() &&
                        std::tie(sides[i + n].low, sides[i + n].high) == std::tie(sides[i].low, sides[i].high);)
                ++n;
            edges.emplace_back(&sides[i], n);
        }
    }
};

// Every edge belongs to two triangles, which run along it in opposite ways, unless it may be open or they may be mixed.
void check_edges(const ImportedMesh& in, const Edges& all, bool may_be_open, bool may_be_mixed) {
    const std::span<const Side>* first = nullptr;  // bad edge, by its first triangle
    std::size_t open = 0;
    for (const auto& sides : all.edges) {
        open += sides.size() == 1;
        const bool good = sides.size() == 1   ? may_be_open
                          : sides.size() == 2 ? may_be_mixed || sides[0].forward != sides[1].forward
                                              : false;
        if (!good && (!first || sides[0].triangle < first->front().triangle)) first = &sides;
    }
    if (!first) return;
    const auto name = [&](std::size_t i) { return triangle_name(in, (*first)[i].triangle); };
    const Side& e = first->front();
    const std::string edge = fmt::format("edge from {} to {}", vertex_name(in, e.forward ? e.low : e.high),
                                         vertex_name(in, e.forward ? e.high : e.low));
    if (first->size() == 1)
        refuse(in, fmt::format("the mesh is open: the {} of {} belongs to no other triangle ({} such edges); if the "
                               "surface is closed there, shape.weld joins vertices that are near each other; "
                               "shape.fill_holes = true, with shape.remesh, closes holes",
                               edge, name(0), open));
    if (first->size() == 2)
        refuse(in, fmt::format("inconsistently oriented: {} and {} traverse the same direction along the {}; turn one "
                               "of them, or let shape.remesh do so",
                               name(0), name(1), edge));
    refuse(in, fmt::format("non-manifold edge: the {} belongs to {} triangles, among them {}, {} and {}; {}", edge,
                           first->size(), name(0), name(1), name(2), wrapping));
}

// Disjoint sets of the numbers below n, each with a sign relative to the least of its set.
class SignedSets {
public:
    explicit SignedSets(std::size_t n) : up_(n), negative_(n) { std::iota(up_.begin(), up_.end(), 0); }

    // The least of the set of i, and whether the sign of i is the opposite.
    std::pair<std::size_t, bool> find(std::size_t i) {
        bool negative = false;
        while (up_[i] != i) {
            const std::size_t above = up_[i];
            negative_[i] = negative_[i] != negative_[above];
            up_[i] = up_[above];
            negative = negative != negative_[i];
            i = up_[i];
        }
        return {i, negative};
    }
    // Puts a and b into one set, with opposite signs or the same. False if they are in one with other signs.
    bool join(std::size_t a, std::size_t b, bool opposite = false) {
        const auto [i, a_negative] = find(a);
        const auto [j, b_negative] = find(b);
        const bool turned = (a_negative != b_negative) != opposite;
        if (i == j) return !turned;
        up_[std::max(i, j)] = std::min(i, j);
        negative_[std::max(i, j)] = turned;
        return true;
    }

private:
    std::vector<std::size_t> up_;
    std::vector<bool> negative_;
};

// The triangles that edges join, negative if they face the other way than the first one of their piece.
SignedSets pieces_of(const ImportedMesh& in, const Edges& all) {
    SignedSets pieces(in.mesh.triangles.size());
    for (const auto& sides : all.edges)
        if (sides.size() == 2 &&
            !pieces.join(sides[0].triangle, sides[1].triangle, sides[0].forward == sides[1].forward))
            refuse(in,
                   fmt::format("the surface has only one side, like a Moebius strip: {} and {} cannot face the "
                               "same way, whichever way their neighbours do; {}",
                               triangle_name(in, sides[0].triangle), triangle_name(in, sides[1].triangle), wrapping));
    return pieces;
}

// Makes each triangle face as the first of its piece does, and drops small pieces.
void orient_and_drop_specks(ImportedMesh& in, SignedSets pieces) {
    struct Piece {
        std::size_t triangles = 0, turned = 0;
        double area = 0;
    };
    std::map<std::size_t, Piece> all;  // by the first triangle
    for (std::size_t t = 0; t < in.mesh.triangles.size(); ++t) {
        auto& corner = in.mesh.triangles[t];
        const auto [first, turn] = pieces.find(t);
        if (turn) std::swap(corner[1], corner[2]);
        Piece& piece = all[first];
        ++piece.triangles, piece.turned += turn, piece.area += area_vector(in.mesh, corner).norm();
    }
    std::size_t turned = 0, specks = 0;
    double largest = 0;
    for (const auto& [first, piece] : all) {
        turned += std::min(piece.turned, piece.triangles - piece.turned);  // the fewer faced the wrong way
        largest = std::max(largest, piece.area);
    }
    if (turned > 0)
        in.notes.push_back(fmt::format("{} of {} triangles faced the other way than their neighbours and were turned.",
                                       turned, in.mesh.triangles.size()));
    for (const auto& [first, piece] : all) specks += piece.area < speck * largest;
    std::vector<bool> keep;
    for (std::size_t t = 0; t < in.mesh.triangles.size(); ++t)
        keep.push_back(all[pieces.find(t).first].area >= speck * largest);
    const std::size_t dropped = keep_triangles(in, keep);
    if (specks > 0)
        in.notes.push_back(
            fmt::format("{} pieces of less than 1 percent of the area of the largest, {} triangles in all, were "
                        "dropped.",
                        specks, dropped));
}

// The triangles at a vertex follow each other around it. Where they do not, closed sheets touch, which is an error, or
// borders do, which are taken apart.
void part_vertices(ImportedMesh& in, const Edges& all) {
    TriangleMesh& mesh = in.mesh;
    const std::size_t corners = 3 * mesh.triangles.size();
    SignedSets fans(corners);  // corners at a vertex that edges join
    for (const auto& sides : all.edges)
        if (sides.size() == 2)
            for (const bool low : {true, false}) fans.join(sides[0].end(low), sides[1].end(low));
    std::vector<bool> open(corners);  // of the first corner of a fan
    for (const auto& sides : all.edges)
        if (sides.size() == 1)
            for (const bool low : {true, false}) open[fans.find(sides[0].end(low)).first] = true;
    std::vector<std::size_t> first_fan(mesh.points.size(), corners);
    std::map<std::size_t, int> new_vertex;  // of further fans
    for (std::size_t c = 0; c < corners; ++c) {
        int& v = mesh.triangles[c / 3][c % 3];
        const std::size_t fan = fans.find(c).first, first = first_fan[v] = std::min(first_fan[v], fan);
        if (fan == first) continue;
        if (!open[fan] || !open[first])
            refuse(in,
                   fmt::format("non-manifold vertex: {} and {} meet at {}, but no fan of triangles around it "
                               "connects them: two surfaces, or two parts of one, touch there; move them apart, "
                               "or {}",
                               triangle_name(in, first / 3), triangle_name(in, fan / 3), vertex_name(in, v), wrapping));
        const auto [found, is_new] = new_vertex.try_emplace(fan, int(mesh.points.size()));
        if (is_new) {
            mesh.points.push_back(Vector3d(mesh.points[v]));
            in.vertex_number.push_back(std::int64_t(in.vertex_number[v]));
        }
        v = found->second;
    }
    if (!new_vertex.empty())
        in.notes.push_back(fmt::format("At {} vertices borders touched; they were taken apart.", new_vertex.size()));
}

void check_one_piece(const ImportedMesh& in, SignedSets pieces) {
    std::vector<std::size_t> first;
    for (std::size_t t = 0; t < in.mesh.triangles.size(); ++t)
        if (pieces.find(t).first == t) first.push_back(t);
    if (first.size() > 1)
        refuse(in, fmt::format("the mesh consists of {} separate surfaces: {} is not connected to {}; a case has one "
                               "membrane: keep one of them in the file",
                               first.size(), triangle_name(in, first[1]), triangle_name(in, first[0])));
}

void face_outward(ImportedMesh& in, double& volume) {
    if (!(volume < 0)) return;
    for (auto& corner : in.mesh.triangles) std::swap(corner[1], corner[2]);
    volume = -volume;
    in.notes.emplace_back("All triangles faced inward; their orientation was reversed.");
}

}  // namespace

MeshReport close_mesh(ImportedMesh& in) {
    check_triangles(in);
    check_duplicates(in);
    drop_isolated(in);
    const Edges edges(in.mesh);
    check_edges(in, edges, false, false);
    part_vertices(in, edges);
    check_one_piece(in, pieces_of(in, edges));
    if (const auto pair = first_intersection(in.mesh))
        refuse(in, fmt::format("the surface intersects itself: {} intersects {}", triangle_name(in, pair->first),
                               triangle_name(in, pair->second)));
    const int euler = int(in.mesh.points.size()) - int(edges.edges.size()) + int(in.mesh.triangles.size());
    MeshReport report{(2 - euler) / 2, mesh_area(in.mesh), mesh_volume(in.mesh)};
    face_outward(in, report.volume);
    std::pair<std::size_t, std::size_t> sharpest;
    for (const auto& sides : edges.edges) {
        const std::size_t a = sides[0].triangle, b = sides[1].triangle;
        const double kink =
            kink_between(area_vector(in.mesh, in.mesh.triangles[a]), area_vector(in.mesh, in.mesh.triangles[b]));
        if (kink > report.kink_max) report.kink_max = kink, sharpest = {a, b};
    }
    if (report.kink_max > 60)
        in.notes.push_back(
            fmt::format("The largest kink is {:.0f} degrees, between {} and {}: a smooth surface "
                        "through such edges is a guess.",
                        report.kink_max, triangle_name(in, sharpest.first), triangle_name(in, sharpest.second)));
    return report;
}

void repair_mesh(ImportedMesh& in, bool may_be_open) {
    drop_useless(in);
    {
        const Edges edges(in.mesh);
        check_edges(in, edges, true, true);
        orient_and_drop_specks(in, pieces_of(in, edges));
    }
    const Edges edges(in.mesh);
    check_edges(in, edges, may_be_open, false);
    part_vertices(in, edges);
    check_one_piece(in, pieces_of(in, edges));
    const bool closed = std::ranges::all_of(edges.edges, [](const auto& sides) { return sides.size() == 2; });
    double volume = closed ? mesh_volume(in.mesh) : 0;
    face_outward(in, volume);
}

}  // namespace tubule::surface3d
