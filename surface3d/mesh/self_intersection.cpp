// Self-intersection of a triangle mesh: a tree of boxes for the pairs that may meet, signs of determinants for
// whether they do.
#include "surface3d/mesh/self_intersection.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/solve/pause.hpp"
#include "surface3d/mesh/box_tree.hpp"

namespace tubule::surface3d {

namespace {

using Eigen::Vector3d;

// Bounds on the rounding of the determinants below, relative to the sum of the magnitudes of their products
// (Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric predicates", 1997: 7.8e-16 and
// 3.4e-16). What is below is taken for zero, that is, for contact.
constexpr double bound3 = 8e-16, bound2 = 4e-16;

int sign(double value, double bound) {
    return value > bound ? 1 : value < -bound ? -1 : 0;
}

// On which side of the plane abc is d?
int side(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
    const Vector3d u = a - d, v = b - d, w = c - d;
    const Vector3d magnitude(std::abs(v[1] * w[2]) + std::abs(v[2] * w[1]),
                             std::abs(v[2] * w[0]) + std::abs(v[0] * w[2]),
                             std::abs(v[0] * w[1]) + std::abs(v[1] * w[0]));
    return sign(u.dot(v.cross(w)), bound3 * u.cwiseAbs().dot(magnitude));
}

// The plane of projection: coordinates i and j.
struct Axes {
    int i, j;
};

// On which side of the line ab is c?
int side(const Axes& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    const double left = (a[p.i] - c[p.i]) * (b[p.j] - c[p.j]), right = (a[p.j] - c[p.j]) * (b[p.i] - c[p.i]);
    return sign(left - right, bound2 * (std::abs(left) + std::abs(right)));
}

bool segments_meet(const Axes& p, const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
    for (const int k : {p.i, p.j}) {
        if (std::max(a[k], b[k]) < std::min(c[k], d[k]) || std::max(c[k], d[k]) < std::min(a[k], b[k])) return false;
    }
    return side(p, a, b, c) * side(p, a, b, d) <= 0 && side(p, c, d, a) * side(p, c, d, b) <= 0;
}

using Corners = std::array<Vector3d, 3>;

// Seen along the coordinate axis nearest to the triangle's normal; if all is in one plane, whether they meet in space.
bool segment_meets_projected(const Vector3d& p, const Vector3d& q, const Corners& t) {
    Eigen::Index drop;
    (t[1] - t[0]).cross(t[2] - t[0]).cwiseAbs().maxCoeff(&drop);
    const Axes axes{int(drop + 1) % 3, int(drop + 2) % 3};
    int sides[3];
    for (int i = 0; i < 3; ++i) {
        if (segments_meet(axes, p, q, t[i], t[(i + 1) % 3])) return true;
        sides[i] = side(axes, t[i], t[(i + 1) % 3], p);
    }
    return sides[0] == sides[1] && sides[1] == sides[2];  // within
}

// Both closed.
bool segment_meets(const Vector3d& p, const Vector3d& q, const Corners& t) {
    const int sp = side(t[0], t[1], t[2], p), sq = side(t[0], t[1], t[2], q);
    if (sp * sq > 0) return false;
    if (sp == 0 && sq == 0) return segment_meets_projected(p, q, t);
    const int s[3] = {side(p, q, t[0], t[1]), side(p, q, t[1], t[2]), side(p, q, t[2], t[0])};
    const auto [low, high] = std::minmax({s[0], s[1], s[2]});
    // Where all five points are nearly in one plane, these signs are rounding. What meets, meets in every projection.
    return low * high >= 0 && segment_meets_projected(p, q, t);
}

// The corners of `a`, those that `b` has too first; and how many those are.
int shared_first(std::array<int, 3>& a, const std::array<int, 3>& b) {
    const auto shared = [&](int v) { return std::find(b.begin(), b.end(), v) != b.end(); };
    return int(std::stable_partition(a.begin(), a.end(), shared) - a.begin());
}

Corners corners(const TriangleMesh& mesh, const std::array<int, 3>& t) {
    return {mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]};
}

bool meet(const TriangleMesh& mesh, std::array<int, 3> a, std::array<int, 3> b) {
    const int shared = shared_first(a, b);
    shared_first(b, a);
    const Corners x = corners(mesh, a), y = corners(mesh, b);
    if (shared >= 2) {
        // Beyond their edge they meet only if folded onto each other.
        const Vector3d edge = x[1] - x[0];
        const Vector3d u = edge.cross(x[2] - x[0]).normalized(), v = edge.cross(y[2] - x[0]).normalized();
        return u.dot(v) > 0 && u.cross(v).norm() < 1e-6;
    }
    // If two triangles share more than one vertex's point, then an edge away from that vertex meets the other one.
    if (shared == 1) return segment_meets(x[1], x[2], y) || segment_meets(y[1], y[2], x);
    for (int i = 0; i < 3; ++i) {
        if (segment_meets(x[i], x[(i + 1) % 3], y) || segment_meets(y[i], y[(i + 1) % 3], x)) return true;
    }
    return false;
}

BoxTree<3> boxes(const TriangleMesh& mesh) {
    std::vector<BoxTree<3>::Box> out(mesh.triangles.size());
    for (std::size_t t = 0; t < out.size(); ++t)
        for (const int v : mesh.triangles[t]) out[t].extend(mesh.points[v]);
    return BoxTree<3>(std::move(out));
}

}  // namespace

std::optional<std::pair<std::size_t, std::size_t>> first_intersection(const TriangleMesh& mesh) {
    const BoxTree<3> tree = boxes(mesh);
    const std::size_t none = mesh.triangles.size();
    for (std::size_t t = 0; t < none; ++t) {
        if (t % 1024 == 0) check_pause();
        std::size_t first = none;
        tree.meeting(tree.item(t), [&](std::size_t s) {
            if (s > t && s < first && meet(mesh, mesh.triangles[t], mesh.triangles[s])) first = s;
        });
        if (first < none) return std::pair{t, first};
    }
    return {};
}

}  // namespace tubule::surface3d
