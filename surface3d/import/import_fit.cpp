#include "surface3d/import/import_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/solve/pause.hpp"
#include "surface3d/curvature/polynomial_graph.hpp"
#include "surface3d/import/mesh_smoothing.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/mesh/self_intersection.hpp"

namespace tubule::surface3d {

namespace {

using Eigen::MatrixXd, Eigen::Vector3d, Eigen::VectorXd;

// Neighbours whose normal is turned further than this (72 degrees) do not belong to a graph over the tangent plane.
constexpr double cos_turn = 0.3;

// How a patch is fitted to its neighbourhood.
struct Locality {
    int degree;
    std::size_t wanted;  // at least this many neighbours, if they exist
    double decay;        // residuals are weighted by exp(-decay r^2), r = 1 for the farthest neighbour
    bool free;           // need not pass through the vertex
};

// Fast decay trades averaging for locality: on irregular samples of an ellipsoid and a bumpy sphere errors of
// position, normal and curvature are half to a quarter of those of decay 1; from 12 on systems become ill-conditioned.
Locality interpolating(int degree) {
    return {degree, std::size_t(1.5 * (graph_coefficients(degree) - 1)), 6, false};
}

// The opposite: averages noise out.
constexpr Locality smoothing{3, 30, 2, true};

// The surface about a vertex.
struct Patch {
    PolynomialGraph graph;  // from the vertex: far from the origin of space its points keep their digits
    Vector3d vertex, normal;

    // The t for which x + t direction is on the graph, nearest to t = 0; NaN if there is none within `reach`.
    double meet(const Vector3d& x, const Vector3d& direction, double reach) const {
        double t = 0;
        for (int iteration = 0; iteration < 30; ++iteration) {
            const Vector3d y = x - vertex + t * direction;
            const SurfacePoint<double> p = graph.at(y);
            const double change = (p.x - y).dot(p.normal) / direction.dot(p.normal);
            t += change;
            if (!(std::abs(t) <= reach)) return NAN;
            if (std::abs(change) < 1e-14 * reach) return t;
        }
        return NAN;
    }
};

struct Neighbourhood {
    std::vector<std::vector<int>> of;  // vertices that share an edge

    explicit Neighbourhood(const TriangleMesh& mesh) : of(mesh.points.size()) {
        for (const auto& t : mesh.triangles) {
            for (int i = 0; i < 3; ++i) of[t[i]].push_back(t[(i + 1) % 3]);  // closed: each edge once each way
        }
    }

    // Whole rings about v, at least two and until there are `wanted` vertices, of those for which use(vertex).
    template <class Use>
    std::vector<int> rings(int v, std::size_t wanted, const Use& use) const {
        std::vector<int> found{v};
        for (std::size_t begin = 0, ring = 0; begin < found.size() && (ring < 2 || found.size() <= wanted); ++ring) {
            const std::size_t end = found.size();
            for (std::size_t i = begin; i < end; ++i) {
                for (const int w : of[found[i]]) {
                    if (use(w) && std::find(found.begin(), found.end(), w) == found.end()) found.push_back(w);
                }
            }
            begin = end;
        }
        found.erase(found.begin());
        return found;
    }
};

// Means of the triangles' normals with weights that are exact on a sphere (N. Max, "Weights for computing vertex
// normals from facet normals", 1999).
std::vector<Vector3d> vertex_normals(const TriangleMesh& mesh) {
    std::vector<Vector3d> normal(mesh.points.size(), Vector3d::Zero());
    for (const auto& t : mesh.triangles) {
        for (int i = 0; i < 3; ++i) {
            const Vector3d a = mesh.points[t[(i + 1) % 3]] - mesh.points[t[i]];
            const Vector3d b = mesh.points[t[(i + 2) % 3]] - mesh.points[t[i]];
            normal[t[i]] += a.cross(b) / (a.squaredNorm() * b.squaredNorm());
        }
    }
    for (Vector3d& n : normal) n.normalize();
    return normal;
}

// The patch of the highest degree up to the wanted one that the points determine well.
Patch fit_patch(const TriangleMesh& mesh, int v, const Vector3d& normal, const std::vector<int>& points,
                const Locality& locality) {
    const Vector3d tangent = normal.unitOrthogonal();
    PolynomialGraph graph{1, Vector3d::Zero(), tangent, normal.cross(tangent), normal, 0, {}};
    graph.coefficient.setZero();
    for (const int w : points) graph.scale = std::max(graph.scale, (mesh.points[w] - mesh.points[v]).norm());
    const int count = int(points.size());
    for (int degree = locality.degree; degree > 1; --degree) {
        const int n = graph_coefficients(degree);
        if (count < n - 1 + (n - 1) / 4) continue;
        MatrixXd a = MatrixXd::Zero(count + 1, n);
        VectorXd b = VectorXd::Zero(count + 1);
        for (int row = 0; row < count; ++row) {
            const Vector3d d = (mesh.points[points[row]] - mesh.points[v]) / graph.scale;
            const double x = d.dot(graph.e1), y = d.dot(graph.e2);
            const double weight = std::exp(-locality.decay * (x * x + y * y));
            double power = weight;  // weight x^i y^j
            for (int i = 0, column = 0; i <= degree; ++i, power *= x)
                for (double j = 0, term = power; i + j <= degree; ++j, term *= y) a(row, column++) = term;
            if (!locality.free) a(row, 0) = 0;
            b[row] = weight * d.dot(normal);
        }
        a(count, 0) = 1;  // the vertex itself
        const Eigen::ColPivHouseholderQR<MatrixXd> qr(a);
        const auto diagonal = qr.matrixR().diagonal().cwiseAbs();
        if (diagonal.minCoeff() < 1e-4 * diagonal.maxCoeff()) continue;
        graph.degree = degree;
        graph.coefficient.head(n) = qr.solve(b);
        break;
    }
    return {graph, mesh.points[v], graph.at(graph.origin).normal};
}

std::vector<Patch> fit_patches(const TriangleMesh& mesh, const Locality& locality) {
    const Neighbourhood near(mesh);
    const std::vector<Vector3d> normal = vertex_normals(mesh);
    std::vector<Patch> patches;
    for (int v = 0; v < int(mesh.points.size()); ++v) {
        if (v % 256 == 0) check_pause();
        const auto use = [&](int w) { return normal[w].dot(normal[v]) > cos_turn; };
        const std::vector<int> points = near.rings(v, locality.wanted, use);
        patches.push_back(fit_patch(mesh, v, normal[v], points, locality));
    }
    return patches;
}

double mean_edge(const TriangleMesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles) {
        for (int i = 0; i < 3; ++i) sum += (mesh.points[t[i]] - mesh.points[t[(i + 1) % 3]]).norm();
    }
    return sum / (3 * double(mesh.triangles.size()));
}

[[noreturn]] void fail(const ImportedMesh& in, std::size_t triangle, const std::string& message) {
    refuse(in, fmt::format("{}: {}; the mesh is too coarse or too rough there for a smooth surface{}",
                           triangle_name(in, triangle), message,
                           in.is_new ? "" : ": shape.remesh = NUMBER makes one of so many new triangles"));
}

// The place of the node at `barycentric` of a flat triangle; NaN when a patch is not met.
Vector3d curved_point(const TriangleMesh& mesh, const std::vector<Patch>& patches, const std::array<int, 3>& corner,
                      const Vector3d& barycentric) {
    Vector3d flat = Vector3d::Zero(), direction = Vector3d::Zero();
    double reach = 0;
    for (int i = 0; i < 3; ++i) {
        flat += barycentric[i] * mesh.points[corner[i]];
        direction += barycentric[i] * patches[corner[i]].normal;
        reach = std::max(reach, (mesh.points[corner[i]] - mesh.points[corner[(i + 1) % 3]]).norm());
    }
    direction.normalize();
    double t = 0;
    for (int i = 0; i < 3; ++i) {
        if (barycentric[i] > 0) t += barycentric[i] * patches[corner[i]].meet(flat, direction, reach);
    }
    return flat + t * direction;
}

CurvedMesh place_nodes(const ImportedMesh& imported, const TriangleMesh& mesh, const std::vector<Patch>& patches,
                       int k) {
    CurvedMesh out = flat_mesh(mesh, k);
    std::vector<bool> placed(out.nodes.size());
    const auto indices = lattice(k);
    for (int t = 0; t < out.triangles(); ++t)
        for (int a = 3; a < out.nodes_per_cell(); ++a) {
            const int node = out.node(t, a);
            if (placed[node]) continue;
            placed[node] = true;
            const Vector3d barycentric = Vector3d(indices[a][0], indices[a][1], indices[a][2]) / k;
            out.nodes[node] = curved_point(mesh, patches, mesh.triangles[t], barycentric);
            if (!out.nodes[node].allFinite())
                fail(imported, std::size_t(t),
                     "the polynomials fitted at its vertices do not reach a common point above it");
        }
    return out;
}

// No part of an element may face away from its flat triangle, and no two may intersect.
void check_surface(const ImportedMesh& imported, const TriangleMesh& mesh, const CurvedMesh& surface) {
    const TriangleMesh parts = node_triangles(surface);
    const std::size_t each = std::size_t(surface.order * surface.order);
    for (std::size_t t = 0; t < parts.triangles.size(); ++t)
        if (!(area_vector(parts, parts.triangles[t]).dot(area_vector(mesh, mesh.triangles[t / each])) > 0))
            fail(imported, t / each, "the fitted element folds");
    if (const auto pair = first_intersection(parts))
        fail(imported, pair->first / each,
             "the fitted element intersects that of " + triangle_name(imported, pair->second / each));
}

// How far each vertex is from the least-squares polynomial about it.
std::vector<Vector3d> to_smooth(const TriangleMesh& mesh) {
    std::vector<Vector3d> out;
    for (const auto& [graph, vertex, normal] : fit_patches(mesh, smoothing))
        out.push_back(graph.scale * graph.coefficient[0] * graph.normal);
    return out;
}

// Smoothed `times` times.
TriangleMesh smoothed(TriangleMesh mesh, int times, FitReport& report) {
    std::vector<Vector3d> change = to_smooth(mesh);
    double squares = 0;
    for (const Vector3d& x : change) squares += x.squaredNorm();
    report.roughness = std::sqrt(squares / double(change.size())) / mean_edge(mesh);
    if (times == 0 && report.roughness > 0.01)
        report.notes.push_back(
            fmt::format("The vertices are {:.2g} of an edge (root mean square) off the smooth surface "
                        "through their neighbours: the mesh is coarse, or it is noisy; shape.remesh makes a smooth one "
                        "of new triangles.",
                        report.roughness));
    for (int i = 0; i < times; ++i) {
        if (i > 0) change = to_smooth(mesh);
        for (std::size_t v = 0; v < change.size(); ++v) mesh.points[v] += change[v];
    }
    return mesh;
}

void count_reduced(const std::vector<Patch>& patches, int degree, FitReport& report) {
    for (const Patch& patch : patches) report.reduced += patch.graph.degree < degree;
    if (report.reduced == 0) return;
    report.notes.push_back(
        fmt::format("At {} of {} vertices the neighbourhood does not determine a polynomial of degree {}; a lower "
                    "one was used.",
                    report.reduced, patches.size(), degree));
}

}  // namespace

Fit fit_surface(const ImportedMesh& imported, const FitOptions& options) {
    const int degree = options.order + 1;
    Fit fit;
    const TriangleMesh mesh = smoothed(imported.mesh, options.smoothing, fit.report);
    const std::vector<Patch> patches = fit_patches(mesh, interpolating(degree));
    count_reduced(patches, degree, fit.report);
    fit.surface = place_nodes(imported, mesh, patches, options.order);
    check_surface(imported, mesh, fit.surface);
    return fit;
}

}  // namespace tubule::surface3d
