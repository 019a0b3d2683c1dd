#include "surface3d/import/import_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "common/solve/pause.hpp"
#include "surface3d/mesh/reference_triangle.hpp"
#include "surface3d/mesh/self_intersection.hpp"

namespace tubule::surface3d {

namespace {

using Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d, Eigen::VectorXd;

// Neighbours whose normal is turned further than this (72 degrees) do not belong to a graph over the tangent plane.
constexpr double cos_turn = 0.3;

// Number of monomials x^i y^j, 1 <= i + j <= degree.
int monomials(int degree) {
    return (degree + 1) * (degree + 2) / 2 - 1;
}

// x, y, x^2, xy, y^2, x^3, ...
void fill_monomials(int degree, const Vector2d& x, Eigen::Ref<VectorXd> out) {
    out[0] = x[0];
    out[1] = x[1];
    for (int d = 2, k = 2; d <= degree; ++d, k += d) {
        for (int j = 0; j < d; ++j) out[k + j] = out[k + j - d] * x[0];
        out[k + d] = out[k - 1] * x[1];
    }
}

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
    return {degree, std::size_t(1.5 * monomials(degree)), 6, false};
}

// The opposite: averages noise out.
constexpr Locality smoothing{3, 30, 2, true};

// z = p(x, y) in the frame about a vertex; lengths there are in units of `scale`.
struct Patch {
    Vector3d origin;
    Matrix3d frame;  // rows: two tangents, normal
    double scale = 1;
    int degree = 1;
    double constant = 0;  // p(0, 0); zero where it passes through the vertex
    VectorXd coefficient;
    Vector3d normal;  // of the patch at the vertex

    Vector3d local(const Vector3d& x) const { return frame * (x - origin) / scale; }

    // p and its gradient.
    std::pair<double, Vector2d> value(const Vector2d& x) const {
        VectorXd m(monomials(degree));
        fill_monomials(degree, x, m);
        Vector2d gradient(coefficient[0], coefficient[1]);
        for (int d = 2, k = 2; d <= degree; ++d, k += d) {
            // The monomials one degree below begin d places before; degree 0 is the number one.
            for (int j = 0; j <= d; ++j) {
                if (j < d) gradient[0] += coefficient[k + j] * (d - j) * m[k + j - d];
                if (j > 0) gradient[1] += coefficient[k + j] * j * m[k + j - 1 - d];
            }
        }
        return {constant + coefficient.dot(m), gradient};
    }

    // The t for which x + t direction is on the graph, nearest to t = 0; NaN if there is none within `reach`.
    double meet(const Vector3d& x, const Vector3d& direction, double reach) const {
        const Vector3d start = local(x), step = frame * direction / scale;
        double t = 0;
        for (int iteration = 0; iteration < 30; ++iteration) {
            const Vector3d y = start + t * step;
            const auto [p, gradient] = value(y.head<2>());
            const double change = (p - y[2]) / (step[2] - gradient.dot(step.head<2>()));
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
    Patch patch;
    patch.origin = mesh.points[v];
    const Vector3d tangent = normal.unitOrthogonal();
    patch.frame << tangent.transpose(), normal.cross(tangent).transpose(), normal.transpose();
    double reach = 0;
    for (const int w : points) reach = std::max(reach, (mesh.points[w] - patch.origin).norm());
    patch.scale = reach;
    const int count = int(points.size());
    int degree = locality.degree;
    for (; degree > 1; --degree) {
        const int n = monomials(degree);
        if (count < n + n / 4) continue;
        MatrixXd a = MatrixXd::Zero(count + 1, n + 1);
        VectorXd b = VectorXd::Zero(count + 1), m(n);
        for (int i = 0; i < count; ++i) {
            const Vector3d x = patch.local(mesh.points[points[i]]);
            const double weight = std::exp(-locality.decay * x.head<2>().squaredNorm());
            fill_monomials(degree, x.head<2>(), m);
            a.row(i).head(n) = weight * m.transpose();
            a(i, n) = locality.free ? weight : 0;
            b[i] = weight * x[2];
        }
        a(count, n) = 1;  // the vertex itself
        const Eigen::ColPivHouseholderQR<MatrixXd> qr(a);
        const auto diagonal = qr.matrixR().diagonal().cwiseAbs();
        if (diagonal.minCoeff() < 1e-4 * diagonal.maxCoeff()) continue;
        const VectorXd solution = qr.solve(b);
        patch.coefficient = solution.head(n);
        patch.constant = solution[n];
        break;
    }
    patch.degree = degree;
    if (degree == 1) patch.coefficient = Vector2d::Zero();
    patch.normal = patch.frame.transpose() * Vector3d(-patch.coefficient[0], -patch.coefficient[1], 1).normalized();
    return patch;
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

[[noreturn]] void fail(const ImportedMesh& imported, std::size_t triangle, const std::string& message) {
    throw MeshError(fmt::format(
        "{}: {}: {}; the mesh is too coarse or too rough there for a smooth surface{}", imported.names.file,
        triangle_name(imported, triangle), message,
        imported.names.triangle_centre.empty() ? ": shape.remesh = NUMBER makes one of so many new triangles" : ""));
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
    CurvedMesh out{.order = k, .nodes = mesh.points, .cells = {}, .period = 0, .shifts = {}};
    const auto indices = lattice(k);
    std::map<std::array<int, 3>, int> edge_nodes;  // (low vertex, high vertex, how far from the low one)
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& corner = mesh.triangles[t];
        out.cells.insert(out.cells.end(), corner.begin(), corner.end());
        for (int a = 3; a < int(indices.size()); ++a) {
            const bool on_edge = a < 3 * k;
            int number = int(out.nodes.size());
            if (on_edge) {
                const int edge = (a - 3) / (k - 1), i = corner[edge], j = corner[(edge + 1) % 3];
                const int from_low = indices[a][i < j ? (edge + 1) % 3 : edge];
                number = edge_nodes.try_emplace({std::min(i, j), std::max(i, j), from_low}, number).first->second;
            }
            out.cells.push_back(number);
            if (number < int(out.nodes.size())) continue;
            const Vector3d barycentric = Vector3d(indices[a][0], indices[a][1], indices[a][2]) / k;
            out.nodes.push_back(curved_point(mesh, patches, corner, barycentric));
            if (!out.nodes.back().allFinite())
                fail(imported, t, "the polynomials fitted at its vertices do not reach a common point above it");
        }
    }
    return out;
}

// No part of an element may face away from its flat triangle, and no two may intersect.
void check_surface(const ImportedMesh& imported, const TriangleMesh& mesh, const CurvedMesh& surface) {
    const TriangleMesh parts = node_triangles(surface);
    const std::size_t each = std::size_t(surface.order * surface.order);
    const auto normal = [](const TriangleMesh& m, std::size_t t) {
        const auto& [a, b, c] = m.triangles[t];
        return Vector3d((m.points[b] - m.points[a]).cross(m.points[c] - m.points[a]));
    };
    for (std::size_t t = 0; t < parts.triangles.size(); ++t) {
        if (!(normal(parts, t).dot(normal(mesh, t / each)) > 0)) fail(imported, t / each, "the fitted element folds");
    }
    if (const auto pair = first_intersection(parts)) {
        fail(imported, pair->first / each,
             "the fitted element intersects that of " + triangle_name(imported, pair->second / each));
    }
}

// How far each vertex is from the least-squares polynomial about it.
std::vector<Vector3d> to_smooth(const TriangleMesh& mesh) {
    std::vector<Vector3d> out;
    for (const Patch& patch : fit_patches(mesh, smoothing)) {
        out.push_back(patch.scale * patch.constant * patch.frame.row(2).transpose());
    }
    return out;
}

double root_mean_square(const std::vector<Vector3d>& vectors) {
    double sum = 0;
    for (const Vector3d& x : vectors) sum += x.squaredNorm();
    return std::sqrt(sum / double(vectors.size()));
}

// Smooths `times` times and reports how far the vertices moved.
TriangleMesh smoothed(const TriangleMesh& original, int times, FitReport& report) {
    TriangleMesh mesh = original;
    std::vector<Vector3d> change = to_smooth(mesh);
    report.roughness = root_mean_square(change) / mean_edge(mesh);
    if (times == 0 && report.roughness > 0.01) {
        report.notes.push_back(
            fmt::format("The vertices are {:.2g} of an edge (root mean square) off the smooth surface "
                        "through their neighbours: the mesh is coarse, or it is noisy; shape.remesh makes a smooth one "
                        "of new triangles.",
                        report.roughness));
    }
    for (int i = 0; i < times; ++i) {
        if (i > 0) change = to_smooth(mesh);
        for (std::size_t v = 0; v < change.size(); ++v) mesh.points[v] += change[v];
    }
    for (std::size_t v = 0; v < change.size(); ++v) {
        change[v] = mesh.points[v] - original.points[v];
        report.moved_max = std::max(report.moved_max, change[v].norm());
    }
    report.moved_rms = root_mean_square(change);
    return mesh;
}

void count_reduced(const std::vector<Patch>& patches, int degree, FitReport& report) {
    for (const Patch& patch : patches) report.reduced += patch.degree < degree;
    if (report.reduced == 0) return;
    report.notes.push_back(
        fmt::format("At {} of {} vertices the neighbourhood does not determine a polynomial of degree {}; a lower "
                    "one was used.",
                    report.reduced, patches.size(), degree));
}

}  // namespace

TriangleMesh node_triangles(const CurvedMesh& surface) {
    const auto indices = lattice(surface.order);
    const int k = surface.order;
    std::map<std::array<int, 3>, int> number;
    for (int a = 0; a < int(indices.size()); ++a) number[indices[a]] = a;
    TriangleMesh out;
    out.points = surface.nodes;
    for (int cell = 0; cell < surface.triangles(); ++cell) {
        const auto node = [&](int i, int j) { return surface.node(cell, number.at({k - i - j, i, j})); };
        for (int i = 0; i < k; ++i) {
            for (int j = 0; i + j < k; ++j) {
                out.triangles.push_back({node(i, j), node(i + 1, j), node(i, j + 1)});
                if (i + j < k - 1) out.triangles.push_back({node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)});
            }
        }
    }
    return out;
}

Fit fit_surface(const ImportedMesh& imported, const FitOptions& options) {
    if (options.order < 2 || options.order > 4) {
        throw std::invalid_argument(fmt::format("fit_surface: order must be 2, 3 or 4, not {}", options.order));
    }
    if (options.smoothing < 0 || options.smoothing > 100) {
        throw std::invalid_argument(fmt::format("fit_surface: smoothing must be 0 to 100, not {}", options.smoothing));
    }
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
