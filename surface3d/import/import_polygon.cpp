#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "surface3d/import/import_formats.hpp"

namespace tubule::surface3d {

namespace {

using Eigen::Vector2d, Eigen::Vector3d;

double cross(const Vector2d& a, const Vector2d& b) {
    return a[0] * b[1] - a[1] * b[0];
}

// The polygon in its mean plane (Newell's normal), counter-clockwise; empty when it has no area.
std::vector<Vector2d> flattened(const std::vector<Vector3d>& corners) {
    Vector3d normal = Vector3d::Zero();
    double scale = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vector3d a = corners[i] - corners[0], b = corners[(i + 1) % corners.size()] - corners[0];
        normal += a.cross(b);
        scale = std::max(scale, a.squaredNorm());
    }
    if (!(normal.norm() > 1e-12 * scale)) return {};
    const Vector3d e = normal.normalized().unitOrthogonal(), f = normal.normalized().cross(e);
    std::vector<Vector2d> flat;
    for (const Vector3d& x : corners) flat.emplace_back(e.dot(x - corners[0]), f.dot(x - corners[0]));
    return flat;
}

// Twice the area over the squared longest side: 0.87 for an equilateral triangle, <= 0 for none.
double shape(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    return cross(b - a, c - a) / std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
}

bool inside(const Vector2d& x, const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    return cross(b - a, x - a) >= 0 && cross(c - b, x - b) >= 0 && cross(a - c, x - c) >= 0;
}

}  // namespace

std::vector<std::array<int, 3>> cut_polygon(const std::vector<Vector3d>& corners) {
    const std::vector<Vector2d> x = flattened(corners);
    if (x.empty()) return {};
    std::vector<int> left(corners.size());
    std::iota(left.begin(), left.end(), 0);
    std::vector<std::array<int, 3>> out;
    while (left.size() >= 3) {
        // The quality of an ear is that of its triangle and, at the last cut, of the one that remains.
        double best = 1e-10;
        std::size_t ear = left.size();
        const std::size_t n = left.size();
        for (std::size_t i = 0; i < n; ++i) {
            const int a = left[(i + n - 1) % n], b = left[i], c = left[(i + 1) % n];
            double quality = shape(x[a], x[b], x[c]);
            if (n == 4) quality = std::min(quality, shape(x[c], x[left[(i + 2) % n]], x[a]));
            if (quality <= best) continue;
            const bool empty = std::none_of(left.begin(), left.end(), [&](int j) {
                return j != a && j != b && j != c && inside(x[j], x[a], x[b], x[c]);
            });
            if (empty) best = quality, ear = i;
        }
        if (ear == n) return {};
        out.push_back({left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]});
        left.erase(left.begin() + std::ptrdiff_t(ear));
    }
    return out;
}

}  // namespace tubule::surface3d
