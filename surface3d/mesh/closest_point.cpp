#include "surface3d/mesh/closest_point.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/solve/dense.hpp"

namespace tubule::surface3d {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Parts are divided until their bulge is at most this fraction of their longest edge, up to this depth: close enough
// for Newton's method to converge.
constexpr double flat_enough = 0.05;
constexpr int deepest = 4;

const std::array<Vector2d, 3> reference_corners{Vector2d(0, 0), Vector2d(1, 0), Vector2d(0, 1)};

int number_of(int j, int m) {
    return (j + m) * (j + m + 1) / 2 + m;
}

// From nodal values (VTK's order) to Bernstein coefficients.
Eigen::MatrixXd bernstein_from_nodes(int order) {
    const auto nodes = lattice(order);
    const auto n = static_cast<Eigen::Index>(nodes.size());
    const auto factorial = [](int i) { return std::tgamma(i + 1.0); };
    Eigen::MatrixXd values(n, n);  // of the Bernstein polynomials, one column each
    for (Eigen::Index row = 0; row < n; ++row)
        for (const auto& [i, j, m] : nodes) {
            double value = factorial(order) / (factorial(i) * factorial(j) * factorial(m));
            const int power[3] = {i, j, m};
            for (int c = 0; c < 3; ++c) value *= std::pow(static_cast<double>(nodes[row][c]) / order, power[c]);
            values(row, number_of(j, m)) = value;
        }
    return solve_dense(values, Eigen::MatrixXd::Identity(n, n));
}

// The part of a segment, 0 ... 1, that is nearest to x.
double along_segment(const Vector3d& from, const Vector3d& to, const Vector3d& x) {
    const Vector3d edge = to - from;
    const double square = edge.squaredNorm();
    return square > 0 ? std::clamp(edge.dot(x - from) / square, 0.0, 1.0) : 0;
}

// Barycentric coordinates of the point of a flat triangle that is nearest to x.
Vector3d nearest_barycentric(const std::array<Vector3d, 3>& corner, const Vector3d& x) {
    const Vector3d u = corner[1] - corner[0], v = corner[2] - corner[0], w = x - corner[0];
    const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), det = uu * vv - uv * uv;
    if (det > 0) {
        const double s = (vv * u.dot(w) - uv * v.dot(w)) / det, t = (uu * v.dot(w) - uv * u.dot(w)) / det;
        if (s >= 0 && t >= 0 && s + t <= 1) return {1 - s - t, s, t};
    }
    Vector3d best = Vector3d::UnitX();
    double least = std::numeric_limits<double>::infinity();
    for (int e = 0; e < 3; ++e) {
        const Vector3d &from = corner[e], &to = corner[(e + 1) % 3];
        const double t = along_segment(from, to, x), away = (from + t * (to - from) - x).squaredNorm();
        if (away >= least) continue;
        least = away;
        best.setZero();
        best[e] = 1 - t, best[(e + 1) % 3] = t;
    }
    return best;
}

}  // namespace

struct ClosestPoint::Search {
    Vector3d x;                        // the query point, as the periodic image sees it
    const Vector3d* normal = nullptr;  // none: points may face any way
    double square = std::numeric_limits<double>::infinity();
    int cell = -1;
    Vector2d at;
    Vector3d from;  // x where the nearest point was found

    void consider(int c, const Vector2d& place, const CellPoint& p) {
        const double away = (p.x - x).squaredNorm();
        if (!(away < square) || (normal && p.u.cross(p.v).dot(*normal) <= 0)) return;
        square = away, cell = c, at = place, from = x;
    }
};

ClosestPoint::ClosestPoint(const CurvedMesh& mesh)
    : order_(mesh.order), period_(mesh.period), cell_(mesh.triangles()), to_bernstein_(bernstein_from_nodes(order_)) {
    for (const auto& [i, j, m] : lattice(order_)) node_place_.push_back(Vector2d(j, m) / order_);
    const int n = mesh.nodes_per_cell();
    std::vector<BoxTree<3>::Box> boxes;
    for (int cell = 0; cell < mesh.triangles(); ++cell) {
        for (int i = 0; i < n; ++i) {
            Vector3d& b = cell_[cell][i] = Vector3d::Zero();
            for (int a = 0; a < n; ++a) b += to_bernstein_(i, a) * mesh.position(cell, a);
        }
        add_parts(cell, reference_corners, 0, boxes);
    }
    tree_ = BoxTree<3>(std::move(boxes));
}

// De Casteljau; the last levels but one and two hold the derivatives.
ClosestPoint::CellPoint ClosestPoint::evaluate(int cell, const Eigen::Vector2d& at) const {
    Coefficients b = cell_[cell];
    const double l0 = 1 - at[0] - at[1];
    CellPoint p;
    p.uu = p.uv = p.vv = Eigen::Vector3d::Zero();  // of flat triangles
    for (int level = order_; level > 0; --level) {
        if (level == 2) {
            const double scale = order_ * (order_ - 1);
            p.uu = scale * (b[3] - 2 * b[1] + b[0]);
            p.uv = scale * (b[4] - b[1] - b[2] + b[0]);
            p.vv = scale * (b[5] - 2 * b[2] + b[0]);
        }
        if (level == 1) p.u = order_ * (b[1] - b[0]), p.v = order_ * (b[2] - b[0]);
        for (int row = 0, i = 0; row < level; ++row)
            for (int m = 0; m <= row; ++m, ++i)
                b[i] = l0 * b[i] + at[0] * b[number_of(row + 1 - m, m)] + at[1] * b[number_of(row - m, m + 1)];
    }
    p.x = b[0];
    return p;
}

void ClosestPoint::add_parts(int cell, const std::array<Vector2d, 3>& corner, int depth,
                             std::vector<BoxTree<3>::Box>& boxes) {
    const auto place = [&](const Vector2d& at) {
        return Vector2d(corner[0] + at[0] * (corner[1] - corner[0]) + at[1] * (corner[2] - corner[0]));
    };
    Eigen::MatrixX3d nodes(node_place_.size(), 3);
    for (std::size_t a = 0; a < node_place_.size(); ++a)
        nodes.row(a) = evaluate(cell, place(node_place_[a])).x.transpose();
    const Eigen::MatrixX3d control = to_bernstein_ * nodes;
    Part part{cell, corner, {}, 0};
    for (int c = 0; c < 3; ++c) part.x[c] = nodes.row(c).transpose();
    BoxTree<3>::Box box;
    for (int a = 0; a <= order_; ++a)
        for (int b = 0; b <= order_ - a; ++b) {
            const Vector3d point = control.row(number_of(a, b)).transpose();
            const Vector3d flat =
                part.x[0] + (part.x[1] - part.x[0]) * a / order_ + (part.x[2] - part.x[0]) * b / order_;
            part.bulge = std::max(part.bulge, (point - flat).norm());
            box.extend(point);
        }
    const double edge =
        std::max({(part.x[1] - part.x[0]).norm(), (part.x[2] - part.x[1]).norm(), (part.x[0] - part.x[2]).norm()});
    if (part.bulge > flat_enough * edge && depth < deepest) {
        const Vector2d m01 = (corner[0] + corner[1]) / 2, m12 = (corner[1] + corner[2]) / 2,
                       m20 = (corner[2] + corner[0]) / 2;
        add_parts(cell, {corner[0], m01, m20}, depth + 1, boxes);
        add_parts(cell, {m01, corner[1], m12}, depth + 1, boxes);
        add_parts(cell, {m20, m12, corner[2]}, depth + 1, boxes);
        add_parts(cell, {m12, m20, m01}, depth + 1, boxes);
        return;
    }
    part_.push_back(part);
    boxes.push_back(box);
}

void ClosestPoint::search_part(const Part& part, Search& search) const {
    const Vector3d b = nearest_barycentric(part.x, search.x);
    const double away = (b[0] * part.x[0] + b[1] * part.x[1] + b[2] * part.x[2] - search.x).norm() - part.bulge;
    if (away > 0 && away * away >= search.square) return;
    search_cell(part.cell, b[0] * part.corner[0] + b[1] * part.corner[1] + b[2] * part.corner[2], search);
}

// Newton's method on the polynomials, which continue beyond the triangle, then along the edges that it has crossed.
void ClosestPoint::search_cell(int cell, Vector2d at, Search& search) const {
    constexpr int most = 20;
    constexpr double longest = 0.5, done = 1e-9, margin = 0.5;
    double last = 1;
    bool converged = false;
    for (int i = 0; i < most; ++i) {
        const CellPoint p = evaluate(cell, at);
        if (at.minCoeff() >= 0 && at.sum() <= 1) search.consider(cell, at, p);
        if ((converged = last < done)) break;
        const Vector3d away = p.x - search.x;
        const Vector2d gradient(p.u.dot(away), p.v.dot(away));
        Eigen::Matrix2d metric;
        metric << p.u.dot(p.u), p.u.dot(p.v), p.u.dot(p.v), p.v.dot(p.v);
        Eigen::Matrix2d hessian = metric;
        hessian(0, 0) += p.uu.dot(away), hessian(1, 1) += p.vv.dot(away);
        hessian(0, 1) += p.uv.dot(away), hessian(1, 0) = hessian(0, 1);
        const bool convex = hessian(0, 0) > 0 && hessian.determinant() > 1e-3 * metric.determinant();
        Vector2d step = -(convex ? hessian : metric).inverse() * gradient;
        last = step.norm();
        if (!(last < longest)) step *= longest / last;
        at += step;
        if (!(std::min(at.minCoeff(), 1 - at.sum()) > -margin)) break;
    }
    const double inside[3] = {1 - at.sum(), at[0], at[1]};
    for (int edge = 0; edge < 3; ++edge)  // edge e runs from corner e to the next; corner e + 2 is opposite
        if (!converged || inside[(edge + 2) % 3] < 0) search_edge(cell, edge, at, search);
}

void ClosestPoint::search_edge(int cell, int edge, const Vector2d& from, Search& search) const {
    constexpr int most = 15;
    constexpr double done = 1e-9;
    const Vector2d begin = reference_corners[edge], way = reference_corners[(edge + 1) % 3] - begin;
    double t = std::clamp(way.dot(from - begin) / way.squaredNorm(), 0.0, 1.0), last = 1;
    for (int i = 0; i < most && last > 0; ++i) {
        const CellPoint p = evaluate(cell, begin + t * way);
        search.consider(cell, begin + t * way, p);
        if (last < done) return;
        const Vector3d tangent = p.u * way[0] + p.v * way[1], away = p.x - search.x;
        const Vector3d bend = p.uu * (way[0] * way[0]) + p.uv * (2 * way[0] * way[1]) + p.vv * (way[1] * way[1]);
        const double square = tangent.squaredNorm(), curved = square + bend.dot(away);
        const double next = std::clamp(t - tangent.dot(away) / (curved > 1e-3 * square ? curved : square), 0.0, 1.0);
        last = std::abs(next - t);
        t = next;
    }
}

MeshPoint ClosestPoint::nearest(const Vector3d& x, const Vector3d* normal) const {
    Search search;
    search.x = x, search.normal = normal;
    tree_.nearest(x, period_, search.square, [&](std::size_t part, const Vector3d& image) {
        search.x = image;
        search_part(part_[part], search);
    });
    if (search.cell < 0) return {};
    const CellPoint p = evaluate(search.cell, search.at);
    const double up = x.z() - search.from.z();
    return {search.cell,
            search.at,
            p.x + up * Vector3d::UnitZ(),
            p.u.cross(p.v).normalized(),
            period_ > 0 ? static_cast<int>(std::round(up / period_)) : 0,
            std::sqrt(search.square)};
}

}  // namespace tubule::surface3d
