#include "surface3d/mesh/base_meshes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <stdexcept>

#include "common/geometry/profile_point.hpp"
#include "common/solve/pause.hpp"

namespace tubule::surface3d {
namespace {

// An edge by its corners, the lower number first, and by the periods between them.
using EdgeKey = std::array<int, 3>;

struct EdgeSide {
    int triangle, corner;  // the edge runs from this corner to the next
};

int shift_of(const TriangleMesh& mesh, int t, int c) {
    return mesh.period > 0 ? mesh.shifts[t][c % 3] : 0;
}

EdgeKey key_of(int a, int shift_a, int b, int shift_b) {
    return a < b ? EdgeKey{a, b, shift_b - shift_a} : EdgeKey{b, a, shift_a - shift_b};
}

EdgeKey edge_key(const TriangleMesh& mesh, int t, int c) {
    return key_of(mesh.triangles[t][c], shift_of(mesh, t, c), mesh.triangles[t][(c + 1) % 3], shift_of(mesh, t, c + 1));
}

// The angle opposite to the edge that begins at this corner.
double opposite_angle(const TriangleMesh& mesh, const EdgeSide& s) {
    const Eigen::Vector3d top = mesh.corner(s.triangle, (s.corner + 2) % 3);
    const Eigen::Vector3d a = mesh.corner(s.triangle, s.corner) - top;
    const Eigen::Vector3d b = mesh.corner(s.triangle, (s.corner + 1) % 3) - top;
    return std::atan2(a.cross(b).norm(), a.dot(b));
}

// Replaces the edge ab of triangles abc, bad by cd.
void flip(TriangleMesh& mesh, const EdgeSide& left, const EdgeSide& right) {
    auto& T = mesh.triangles[left.triangle];
    auto& U = mesh.triangles[right.triangle];
    const int a = T[left.corner], b = T[(left.corner + 1) % 3], c = T[(left.corner + 2) % 3];
    const int d = U[(right.corner + 2) % 3];
    if (mesh.period > 0) {
        auto& S = mesh.shifts[left.triangle];
        auto& R = mesh.shifts[right.triangle];
        const int sa = S[left.corner], sb = S[(left.corner + 1) % 3], sc = S[(left.corner + 2) % 3];
        const int sd = R[(right.corner + 2) % 3] + sa - R[(right.corner + 1) % 3];
        S = {sc, sa, sd};
        R = {sd, sb, sc};
    }
    T = {c, a, d};
    U = {d, b, c};
}

void make_delaunay(TriangleMesh& mesh) {
    for (bool again = true; again;) {
        check_pause();
        again = false;
        std::map<EdgeKey, std::vector<EdgeSide>> edges;
        for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t)
            for (int c = 0; c < 3; ++c) edges[edge_key(mesh, t, c)].push_back({t, c});
        std::vector<char> touched(mesh.triangles.size(), 0);
        for (const auto& [key, sides] : edges) {
            const EdgeSide &left = sides[0], &right = sides[1];
            if (touched[left.triangle] || touched[right.triangle]) continue;
            if (opposite_angle(mesh, left) + opposite_angle(mesh, right) <= pi + 1e-9) continue;
            const int c = mesh.triangles[left.triangle][(left.corner + 2) % 3];
            const int d = mesh.triangles[right.triangle][(right.corner + 2) % 3];
            const int to_left =
                shift_of(mesh, left.triangle, left.corner) - shift_of(mesh, right.triangle, right.corner + 1);
            const EdgeKey other = key_of(c, shift_of(mesh, left.triangle, left.corner + 2), d,
                                         shift_of(mesh, right.triangle, right.corner + 2) + to_left);
            if (edges.count(other)) continue;  // c and d are neighbours already
            flip(mesh, left, right);
            touched[left.triangle] = touched[right.triangle] = 1;
            again = true;
        }
    }
}

}  // namespace

TriangleMesh icosphere(int n) {
    if (n < 1) throw std::invalid_argument("an icosphere needs 1 or more divisions of each edge");
    const double g = (1 + std::sqrt(5.0)) / 2;
    const std::vector<Eigen::Vector3d> corners{{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                               {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                               {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    const std::vector<std::array<int, 3>> faces{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                                {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                                {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                                {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    TriangleMesh mesh;
    // A lattice point is named by the corners it lies between and its weights on them, so that faces share theirs.
    std::map<std::array<std::array<int, 2>, 3>, int> number;
    const auto point = [&](const std::array<int, 3>& face, int i, int j) {
        std::array<std::array<int, 2>, 3> name{{{face[0], n - i - j}, {face[1], i}, {face[2], j}}};
        Eigen::Vector3d x = Eigen::Vector3d::Zero();
        for (auto& [corner, weight] : name) {
            x += weight * corners[corner];
            if (weight == 0) corner = -1;
        }
        std::sort(name.begin(), name.end());
        const auto [found, is_new] = number.try_emplace(name, static_cast<int>(mesh.points.size()));
        if (is_new) mesh.points.push_back(x.normalized());
        return found->second;
    };
    for (const auto& face : faces)
        for (int i = 0; i < n; ++i) {
            check_pause();
            for (int j = 0; i + j < n; ++j) {
                mesh.triangles.push_back({point(face, i, j), point(face, i + 1, j), point(face, i, j + 1)});
                if (i + j + 1 < n)
                    mesh.triangles.push_back({point(face, i + 1, j), point(face, i + 1, j + 1), point(face, i, j + 1)});
            }
        }
    return mesh;
}

TriangleMesh torus_grid(const Torus& torus, int n_axis, int n_tube) {
    if (n_axis < 4 || n_tube < 4 || n_axis % 2 || n_tube % 2)
        throw std::invalid_argument("a torus grid needs even numbers of cells, 4 or more");
    TriangleMesh mesh;
    for (int i = 0; i < n_axis; ++i)
        for (int j = 0; j < n_tube; ++j) {
            const double phi = 2 * pi * i / n_axis, theta = 2 * pi * j / n_tube;
            const double rho = torus.radius + torus.tube_radius * std::cos(theta);
            mesh.points.emplace_back(rho * std::cos(phi), rho * std::sin(phi), torus.tube_radius * std::sin(theta));
        }
    const auto at = [&](int i, int j) { return (i % n_axis) * n_tube + j % n_tube; };
    for (int i = 0; i < n_axis; ++i)
        for (int j = 0; j < n_tube; ++j) {
            const int a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
            if ((i + j) % 2)
                mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
            else
                mesh.triangles.insert(mesh.triangles.end(), {{a, b, d}, {b, c, d}});
        }
    return mesh;
}

TriangleMesh ring_mesh(const std::vector<Ring>& rings, double period) {
    const int n = static_cast<int>(rings.size());
    if (n < 2 || (period == 0 && (n < 3 || rings.front().count != 1 || rings.back().count != 1)))
        throw std::invalid_argument("rings must end in poles or be periodic");
    TriangleMesh mesh{.points = {}, .triangles = {}, .period = period, .shifts = {}};
    std::vector<int> first;
    for (const Ring& ring : rings) {
        first.push_back(static_cast<int>(mesh.points.size()));
        for (int i = 0; i < ring.count; ++i) {
            const double theta = 2 * pi * (i + ring.phase) / ring.count;
            mesh.points.emplace_back(ring.count == 1
                                         ? Eigen::Vector3d(0, 0, ring.z)
                                         : Eigen::Vector3d(ring.r * std::cos(theta), ring.r * std::sin(theta), ring.z));
        }
    }
    // Between two rings, the triangle that comes next is the one whose new point comes first around the axis.
    for (int k = 0; k < (period > 0 ? n : n - 1); ++k) {
        const int above = (k + 1) % n, moved = above == 0 ? 1 : 0;
        const Ring &low = rings[k], &high = rings[above];
        int i = 0, j = 0;
        const int rows = low.count > 1 ? low.count : 0, columns = high.count > 1 ? high.count : 0;
        while (i < rows || j < columns) {
            const double next_low = (i + 1 + low.phase) / low.count, next_high = (j + 1 + high.phase) / high.count;
            const bool step_low = j == columns || (i < rows && next_low <= next_high);
            const int a = first[k] + i % low.count, b = first[above] + j % high.count;
            if (step_low) {
                mesh.triangles.push_back({a, first[k] + (i + 1) % low.count, b});
                if (period > 0) mesh.shifts.push_back({0, 0, moved});
                ++i;
            } else {
                mesh.triangles.push_back({a, first[above] + (j + 1) % high.count, b});
                if (period > 0) mesh.shifts.push_back({0, moved, moved});
                ++j;
            }
        }
    }
    return mesh;
}

TriangleMesh tube_rings(double radius, double length, int n_z, int n_theta) {
    if (n_z < 2 || n_z % 2 || n_theta < 3)
        throw std::invalid_argument("a tube needs an even number of rings and at least 3 points in each");
    std::vector<Ring> rings;
    for (int k = 0; k < n_z; ++k) rings.push_back({radius, length * k / n_z, n_theta, k % 2 ? 0.5 : 0.0});
    return ring_mesh(rings, length);
}

TriangleMesh jittered(TriangleMesh mesh, double amount, unsigned seed) {
    const std::size_t n = mesh.points.size();
    std::vector<Eigen::Vector3d> normal(n, Eigen::Vector3d::Zero());
    std::vector<double> shortest(n, std::numeric_limits<double>::infinity());
    for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
        const Eigen::Vector3d a = mesh.corner(t, 0), b = mesh.corner(t, 1), c = mesh.corner(t, 2);
        for (int k = 0; k < 3; ++k) {
            const int i = mesh.triangles[t][k], j = mesh.triangles[t][(k + 1) % 3];
            const double length = (mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k)).norm();
            normal[i] += (b - a).cross(c - a);
            shortest[i] = std::min(shortest[i], length);
            shortest[j] = std::min(shortest[j], length);
        }
    }
    std::mt19937 random(seed);
    const auto uniform = [&] { return 2.0 * random() / std::mt19937::max() - 1; };  // the same on every platform
    for (std::size_t i = 0; i < n; ++i) {
        const double x = uniform(), y = uniform(), z = uniform();
        const Eigen::Vector3d move = amount * shortest[i] * Eigen::Vector3d(x, y, z), nu = normal[i].normalized();
        mesh.points[i] += move - nu * nu.dot(move);
    }
    make_delaunay(mesh);
    return mesh;
}

}  // namespace tubule::surface3d
