#include "surface3d/meshing/remesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
#include "surface3d/curvature/curvature.hpp"
#include "surface3d/mesh/half_edges.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/meshing/remesh_sizes.hpp"

namespace tubule::surface3d {
namespace {

using Eigen::Vector3d;

// Botsch and Kobbelt (2004): longer edges are split, shorter ones collapse. Their halves and sums are neither.
constexpr double too_long = 4.0 / 3, too_short = 4.0 / 5;
constexpr double most_scale = 1.2;
constexpr int passes = 8, last_passes = 6, most_rounds = 10;
// Least scores of triangles that a change of the mesh may leave, if they were no worse before.
constexpr double fair_collapse = 0.4, fair_flip = 0.6, fair_move = 0.5;
// A node farther than this from the old mesh, over the width wanted there, is not on the same surface.
constexpr double near_foot = 0.5, near_graph = 0.02;

// 1 for an equilateral triangle that faces as the surface does at its corners, 0 or less if it turns away.
double score(const Vector3d (&x)[3], const Vector3d (&normal)[3]) {
    const Vector3d a = x[1] - x[0], b = x[2] - x[1], c = x[0] - x[2], area = a.cross(b);
    const double squares = a.squaredNorm() + b.squaredNorm() + c.squaredNorm();
    const double facing = std::min({area.dot(normal[0]), area.dot(normal[1]), area.dot(normal[2])});
    return squares > 0 ? 2 * std::sqrt(3.0) * facing / squares : 0;
}

// The triangulation under way: its vertices lie on the old mesh.
struct Work {
    const CurvedMesh& old;
    const ClosestPoint& closest;
    const MeshSizes& sizes;
    HalfEdges edges;
    std::vector<Vector3d> normal;  // of the old mesh at each vertex
    std::vector<double> width;     // wanted there
    double scale = 1;              // of all widths, so that the number of triangles comes out

    // The length of an edge over the width wanted.
    double stretch(int h) const {
        return edges.vector(h).norm() * 2 / (scale * (width[edges.origin[h]] + width[edges.target(h)]));
    }
    // Score of the triangle of h with the origin of h at x.
    double score_with(int h, const Vector3d& x, const Vector3d& n) const {
        const int second = HalfEdges::next(h), third = HalfEdges::previous(h);
        return score({x, edges.position(second), edges.position(third)},
                     {n, normal[edges.origin[second]], normal[edges.origin[third]]});
    }
    double score_of(int h) const { return score_with(h, edges.position(h), normal[edges.origin[h]]); }
    // Least score of the triangles around a vertex, as they are or with it moved.
    double score_around(int v, const Vector3d& move, const Vector3d& n) const {
        double least = 1;
        edges.around(v, [&](int h) { least = std::min(least, score_with(h, edges.position(h) + move, n)); });
        return least;
    }
    void add_vertex(const MeshPoint& foot) {
        normal.push_back(foot.normal);
        width.push_back(sizes.at(old, foot));
    }
};

// All half-edges for which select(stretch), one of each edge, in the order of their stretch.
template <class Select>
std::vector<int> edges_by_stretch(const Work& w, Select&& select) {
    std::vector<std::pair<double, int>> found;
    for (int h = 0; h < w.edges.size(); ++h)
        if (w.edges.exists(h) && h < w.edges.twin[h])
            if (const double s = w.stretch(h); select(s)) found.emplace_back(s, h);
    std::sort(found.begin(), found.end());
    std::vector<int> out;
    for (const auto& [s, h] : found) out.push_back(h);
    return out;
}

// The longest first.
void split_long(Work& w) {
    for (int round = 0; round < most_rounds; ++round) {
        const std::vector<int> found = edges_by_stretch(w, [](double s) { return s > too_long; });
        if (found.empty()) return;
        for (auto h = found.rbegin(); h != found.rend(); ++h) {
            if (w.stretch(*h) <= too_long) continue;
            const Vector3d n = w.normal[w.edges.origin[*h]] + w.normal[w.edges.target(*h)];
            const MeshPoint foot = w.closest(w.edges.position(*h) + w.edges.vector(*h) / 2, n);
            if (foot.cell < 0) continue;
            w.edges.split(*h, foot.x);
            w.add_vertex(foot);
        }
    }
}

// Whether its origin may go: no edge becomes too long, and no triangle bad.
bool collapses_well(const Work& w, int h) {
    if (!w.edges.can_collapse(h)) return false;
    const int v = w.edges.origin[h], into = w.edges.target(h);
    const Vector3d move = w.edges.vector(h);
    const double limit = std::min(fair_collapse, w.score_around(v, Vector3d::Zero(), w.normal[v]));
    bool well = true;
    w.edges.around(v, [&](int g) {
        const double length = (w.edges.vector(g) - move).norm();
        well &= length <= too_long * w.scale * (w.width[into] + w.width[w.edges.target(g)]) / 2;
        const bool goes = g == h || HalfEdges::previous(g) == w.edges.twin[h];
        well &= goes || w.score_with(g, w.edges.position(g) + move, w.normal[into]) >= limit;
    });
    return well;
}

void collapse_short(Work& w) {
    for (const int h : edges_by_stretch(w, [](double s) { return s < too_short; })) {
        if (!w.edges.exists(h) || w.stretch(h) >= too_short) continue;
        for (const int way : {h, w.edges.twin[h]})
            if (collapses_well(w, way)) {
                w.edges.collapse(way);
                break;
            }
    }
}

// How far the four vertices are from having six neighbours each, before and after the flip.
std::array<int, 2> valence_defects(const HalfEdges& e, int h) {
    const int ends[2] = {e.origin[h], e.target(h)};
    const int others[2] = {e.origin[HalfEdges::previous(h)], e.origin[HalfEdges::previous(e.twin[h])]};
    std::array<int, 2> defect{};
    for (const int v : ends) {
        const int n = e.valence(v) - 6;
        defect[0] += n * n, defect[1] += (n - 1) * (n - 1);
    }
    for (const int v : others) {
        const int n = e.valence(v) - 6;
        defect[0] += n * n, defect[1] += (n + 1) * (n + 1);
    }
    return defect;
}

// Flips what makes the worse of two triangles better; or, `even`, valences more equal and triangles not bad.
void flip_edges(Work& w, bool even) {
    for (int round = 0; round < most_rounds; ++round) {
        int flips = 0;
        for (int h = 0; h < w.edges.size(); ++h) {
            if (!w.edges.exists(h) || h > w.edges.twin[h] || !w.edges.can_flip(h)) continue;
            const int g = w.edges.twin[h];
            const double before = std::min(w.score_of(h), w.score_of(g));
            const auto [now, then] = valence_defects(w.edges, h);
            if (!even && before > 0.95) continue;
            w.edges.flip(h);
            const double after = std::min(w.score_of(h), w.score_of(g));
            const bool better = after > before + 1e-6;
            const bool keep = even ? after >= std::min(before, fair_flip) && then < now : better;
            keep ? void(++flips) : w.edges.flip(h);  // a second flip is the way back
        }
        if (flips == 0) return;
    }
}

// To the centre of the triangles around, each weighted as if the density of points were that of the widths wanted.
Vector3d towards_centre(const Work& w, int v) {
    Vector3d sum = Vector3d::Zero();
    double total = 0;
    w.edges.around(v, [&](int h) {
        const Vector3d a = w.edges.vector(h), b = -w.edges.vector(HalfEdges::previous(h));
        const int second = w.edges.target(h), third = w.edges.origin[HalfEdges::previous(h)];
        const double width = (w.width[v] + w.width[second] + w.width[third]) / 3;
        const double weight = a.cross(b).norm() / std::pow(width, 4);
        sum += weight * (a + b) / 3;
        total += weight;
    });
    const Vector3d n = w.normal[v], move = total > 0 ? Vector3d(sum / total) : Vector3d::Zero();
    return move - n.dot(move) * n;
}

void smooth(Work& w) {
    for (int v = 0; v < static_cast<int>(w.edges.points.size()); ++v) {
        if (w.edges.leaving[v] < 0) continue;
        const double limit = std::min(fair_move, w.score_around(v, Vector3d::Zero(), w.normal[v]));
        const Vector3d move = towards_centre(w, v);
        for (const double part : {1.0, 0.5, 0.25}) {
            const MeshPoint foot = w.closest(w.edges.points[v] + part * move, w.normal[v]);
            if (foot.cell < 0 || w.score_around(v, foot.x - w.edges.points[v], foot.normal) < limit) continue;
            w.edges.points[v] = foot.x;
            w.normal[v] = foot.normal;
            w.width[v] = w.sizes.at(w.old, foot);
            break;
        }
    }
}

void improve(Work& w) {
    for (int pass = 0; pass < passes; ++pass) {
        check_pause();
        split_long(w);
        collapse_short(w);
        flip_edges(w, false);
        flip_edges(w, true);
        smooth(w);
        // Mean edges differ a little from the widths: whether more are split than collapse depends on the old mesh.
        const double excess = w.edges.live_triangles() / w.sizes.triangles;
        w.scale = std::clamp(w.scale * std::sqrt(excess), 1 / most_scale, most_scale);
    }
    for (int pass = 0; pass < last_passes; ++pass) {
        check_pause();
        flip_edges(w, false);
        smooth(w);
    }
    flip_edges(w, false);
}

Work begin(const CurvedMesh& mesh, const ClosestPoint& closest, const MeshSizes& sizes) {
    const TriangleMesh corners = corner_triangles(mesh);
    Work w{mesh, closest, sizes, HalfEdges(corners), {}, {}};
    const Tabulation table(mesh.order, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    w.normal.assign(corners.points.size(), Vector3d::Zero());
    for (int cell = 0; cell < mesh.triangles(); ++cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        for (int c = 0; c < 3; ++c) {
            const int v = corners.triangles[cell][c];
            w.normal[v] += tangent_point(X, table, c).normal;
            if (v >= static_cast<int>(w.width.size())) w.width.push_back(sizes.width[mesh.node(cell, c)]);
        }
    }
    for (Vector3d& n : w.normal) n.normalize();
    return w;
}

// A node of the new mesh, as the cell sees it that is first to have it.
struct NewNode {
    Vector3d flat, normal;
    double width = 0;
    int shift = 0;
    MeshPoint foot;
};

std::vector<NewNode> new_nodes(const Work& w, const CurvedMesh& mesh, const TriangleMesh& base) {
    std::vector<int> vertex;  // of each point of the base
    for (int v = 0; v < static_cast<int>(w.edges.points.size()); ++v)
        if (w.edges.leaving[v] >= 0) vertex.push_back(v);
    const auto at = lattice(mesh.order);
    std::vector<NewNode> out(mesh.size());
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int a = 0; a < mesh.nodes_per_cell(); ++a) {
            NewNode& node = out[mesh.node(cell, a)];
            if (node.width > 0) continue;
            node.flat = mesh.position(cell, a), node.normal.setZero();
            node.shift = mesh.period > 0 ? mesh.shifts[cell * mesh.nodes_per_cell() + a] : 0;
            for (int c = 0; c < 3; ++c) {
                const int v = vertex[base.triangles[cell][c]];
                node.normal += at[a][c] * w.normal[v] / mesh.order;
                node.width += at[a][c] * w.width[v] / mesh.order;
            }
        }
    return out;
}

StopReport lost(Stop reason, const std::string& what, const Vector3d& x, const std::string& advice) {
    return {reason, 0, what + " at " + words_of_place(x, 6), advice};
}

// A triangle that does not face as the surface does.
std::optional<StopReport> find_turned(const Work& w) {
    for (int h = 0; h < w.edges.size(); h += 3)
        if (w.edges.exists(h) && !(w.score_of(h) > 0))
            return lost(Stop::mesh_lost,
                        "remeshing leaves a triangle whose normal points away from that of the surface",
                        w.edges.position(h), "use more triangles, or remesh earlier");
    return std::nullopt;
}

std::variant<Remeshed, StopReport> place(const Work& w, const PatchRecovery& recovery, const Eigen::MatrixXd& fields,
                                         const RemeshOptions& options) {
    const CurvedMesh& old = w.old;
    const TriangleMesh base = w.edges.triangles();
    Remeshed out{flat_mesh(base, old.order), {}, {}, 0};
    std::vector<NewNode> nodes = new_nodes(w, out.mesh, base);
    const std::vector<PolynomialGraph> graphs = recovery.fit(old);
    const int n = old.nodes_per_cell();
    out.fields.setZero(fields.rows(), out.mesh.size());
    std::vector<double> moved(nodes.size());
    SharedPause pause;
    parallel_for(nodes.size(), [&](std::size_t i) {
        if (pause.look(i)) return;
        NewNode& node = nodes[i];
        node.foot = w.closest(node.flat, node.normal);
        if (node.foot.cell < 0) return;
        const double up = node.foot.periods * old.period;
        const Vector3d x = node.foot.x - up * Vector3d::UnitZ();
        const Vector3d smooth = recovery.position(graphs, old, node.foot.cell, node.foot.at, x);
        moved[i] = (smooth - x).norm() / node.width;
        out.mesh.nodes[i] = smooth + (up - node.shift * old.period) * Vector3d::UnitZ();
        if (fields.rows() == 0) return;
        const Eigen::VectorXd phi = functions_at(old.order, node.foot.at);
        for (int a = 0; a < n; ++a) out.fields.col(i) += phi[a] * fields.col(old.node(node.foot.cell, a));
    });
    pause.check();
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (!(nodes[i].foot.distance < near_foot * nodes[i].width))
            return lost(Stop::mesh_lost, "the new triangles are too far from the surface", nodes[i].flat,
                        "use more triangles");
        if (!(moved[i] < near_graph))
            return lost(Stop::resolution_lost, "the nodes do not determine a smooth surface", nodes[i].foot.x,
                        "use more triangles, or remesh earlier");
        out.moved = std::max(out.moved, moved[i]);
    }
    out.quality = mesh_quality(out.mesh);
    if (!(out.quality.worst >= options.quality))
        return lost(Stop::mesh_lost,
                    fmt::format("remeshing reaches a quality of {:.2g} instead of the required {:.2g} in the triangle",
                                out.quality.worst, options.quality),
                    out.quality.where, "use more triangles, or remesh earlier");
    return out;
}

void check(const CurvedMesh& mesh, const Eigen::MatrixXd& fields, const RemeshOptions& o) {
    if (fields.rows() > 0 && fields.cols() != mesh.size())
        throw std::invalid_argument(
            fmt::format("fields have {} columns, but the mesh has {} nodes", fields.cols(), mesh.size()));
    if (!(o.triangles >= 0 && o.angle > 0 && o.growth > 0 && o.quality > 0 && o.quality < 1))
        throw std::invalid_argument(
            fmt::format("remeshing needs triangles >= 0, angle > 0, growth > 0 and 0 < quality < 1, not {}, {}, {}, {}",
                        o.triangles, o.angle, o.growth, o.quality));
}

}  // namespace

std::variant<Remeshed, StopReport> remesh(const CurvedMesh& mesh, const Eigen::MatrixXd& fields,
                                          const RemeshOptions& options) {
    check(mesh, fields, options);
    const MeshQuality before = mesh_quality(mesh);
    if (!(before.worst > 0))
        return lost(Stop::mesh_lost, fmt::format("triangle {} folds", before.worst_cell), before.where,
                    "remesh earlier");
    try {
        HalfEdges{corner_triangles(mesh)};
    } catch (const std::invalid_argument&) {
        return StopReport{Stop::mesh_lost, 0, "a tube with fewer than three rings of triangles cannot be remeshed",
                          "use more elements"};
    }
    const PatchRecovery recovery(mesh);
    const CurvatureField curvature = recovery.nodal(mesh);
    const MeshSizes sizes = mesh_sizes(mesh, curvature.H, curvature.K, options);
    if (sizes.lost) return *sizes.lost;
    const ClosestPoint closest(mesh);
    Work work = begin(mesh, closest, sizes);
    improve(work);
    if (const auto turned = find_turned(work)) return *turned;
    return place(work, recovery, fields, options);
}

}  // namespace tubule::surface3d
