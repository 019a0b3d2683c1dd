#include "surface3d/import/mesh_distance.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/solve/pause.hpp"

namespace tubule::surface3d {

namespace {

using Eigen::Vector3d;
using Corners = std::array<Vector3d, 3>;

double squared_to_segment(const Vector3d& x, const Vector3d& a, const Vector3d& b) {
    const Vector3d edge = b - a;
    const double square = edge.squaredNorm();
    const double t = square > 0 ? std::clamp(edge.dot(x - a) / square, 0.0, 1.0) : 0;
    return (a + t * edge - x).squaredNorm();
}

double squared_to_triangle(const Vector3d& x, const Corners& t) {
    const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
    bool above = normal.squaredNorm() > 0;
    for (int i = 0; i < 3; ++i) above = above && (t[(i + 1) % 3] - t[i]).cross(x - t[i]).dot(normal) >= 0;
    if (above) return std::pow(normal.dot(x - t[0]), 2) / normal.squaredNorm();
    return std::min(
        {squared_to_segment(x, t[0], t[1]), squared_to_segment(x, t[1], t[2]), squared_to_segment(x, t[2], t[0])});
}

Corners corners(const TriangleMesh& mesh, std::size_t t) {
    const auto& [a, b, c] = mesh.triangles[t];
    return {mesh.points[a], mesh.points[b], mesh.points[c]};
}

}  // namespace

MeshDistance::MeshDistance(const TriangleMesh& mesh) : mesh_(mesh) {
    std::vector<BoxTree<3>::Box> boxes;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        boxes.emplace_back();
        for (const Vector3d& x : corners(mesh, t)) boxes.back().extend(x);
    }
    tree_ = BoxTree<3>(std::move(boxes));
}

double MeshDistance::operator()(const Vector3d& x) const {
    double best = std::numeric_limits<double>::infinity();
    if (mesh_.triangles.empty()) return best;
    tree_.nearest(x, 0, best, [&](std::size_t t, const Vector3d& y) {
        best = std::min(best, squared_to_triangle(y, corners(mesh_, t)));
    });
    return std::sqrt(best);
}

std::vector<DistanceSample> distances(const TriangleMesh& from, const TriangleMesh& to, double grain) {
    const MeshDistance distance(to);
    std::vector<DistanceSample> out;
    for (std::size_t t = 0; t < from.triangles.size(); ++t) {
        if (t % 256 == 0) check_pause();
        const auto [a, b, c] = corners(from, t);
        const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
        const int n = int(std::clamp(std::ceil(longest / grain), 1.0, 1000.0));
        const double area = (b - a).cross(c - a).norm() / (2.0 * n * n);
        // The centres of the n^2 parts, and the corners, where extremes are likely.
        const auto add = [&](double i, double j, double weight) {
            const Vector3d x = a + (b - a) * (i / n) + (c - a) * (j / n);
            out.push_back({x, weight, distance(x)});
        };
        for (int i = 0; i < n; ++i)
            for (int j = 0; i + j < n; ++j) {
                add(i + 1 / 3.0, j + 1 / 3.0, area);
                if (i + j < n - 1) add(i + 2 / 3.0, j + 2 / 3.0, area);
            }
        for (const auto& [i, j] : {std::pair{0, 0}, {n, 0}, {0, n}}) add(i, j, 0);
    }
    return out;
}

}  // namespace tubule::surface3d
