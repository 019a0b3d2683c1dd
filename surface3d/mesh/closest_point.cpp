#include "surface3d/mesh/closest_point.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace tubule::surface3d {
namespace {

using Eigen::Vector3d;

constexpr int most_iterations = 30;
constexpr double converged = 1e-14;  // in xi, eta

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
    return values.inverse();
}

Eigen::Vector2d on_edge(int edge, double s) {
    if (edge == 0) return {s, 0};
    return edge == 1 ? Eigen::Vector2d(1 - s, s) : Eigen::Vector2d(0, 1 - s);
}

// How far one can go from a point of the triangle, in units of `step`: 1 at most.
double room(const Eigen::Vector2d& at, const Eigen::Vector2d& step) {
    const Eigen::Vector3d l(1 - at.sum(), at[0], at[1]), d(-step.sum(), step[0], step[1]);
    double part = 1;
    for (int c = 0; c < 3; ++c)
        if (d[c] < 0) part = std::min(part, l[c] / -d[c]);
    return std::max(part, 0.0);
}

}  // namespace

ClosestPoint::ClosestPoint(const CurvedMesh& mesh) : order_(mesh.order), period_(mesh.period), cell_(mesh.triangles()) {
    const Eigen::MatrixXd to_bernstein = bernstein_from_nodes(order_);
    for (const auto& [i, j, m] : lattice(order_)) start_.push_back(Eigen::Vector2d(j, m) / order_);
    const int n = mesh.nodes_per_cell();
    std::vector<BoxTree<3>::Box> boxes(mesh.triangles());
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int i = 0; i < n; ++i) {
            Eigen::Vector3d& b = cell_[cell][i] = Eigen::Vector3d::Zero();
            for (int a = 0; a < n; ++a) b += to_bernstein(i, a) * mesh.position(cell, a);
            boxes[cell].extend(b);
        }
    tree_ = BoxTree<3>(std::move(boxes));
}

// De Casteljau; the last levels but one and two hold the derivatives.
ClosestPoint::Point ClosestPoint::evaluate(int cell, const Eigen::Vector2d& at) const {
    Coefficients b = cell_[cell];
    const double l0 = 1 - at[0] - at[1];
    Point p;
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

void ClosestPoint::accept(int cell, const Eigen::Vector2d& at, const Query& query, MeshPoint& best) const {
    const Point p = evaluate(cell, at);
    const double distance = (p.x - query.x).norm();
    if (!(distance < best.distance)) return;
    const Eigen::Vector3d normal = p.u.cross(p.v).normalized();
    if (normal.dot(query.normal) <= 0) return;
    best = {cell, at, p.x + query.periods * period_ * Eigen::Vector3d::UnitZ(), normal, query.periods, distance};
}

// Newton's method along a line or within the cell, where steps that do not come nearer are halved.
Eigen::Vector2d ClosestPoint::approach(int cell, Eigen::Vector2d at, const Eigen::Vector2d* line,
                                       const Vector3d& x) const {
    double value = (evaluate(cell, at).x - x).squaredNorm();
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
        const Point p = evaluate(cell, at);
        const Vector3d r = p.x - x;
        const Eigen::Vector2d slope(p.u.dot(r), p.v.dot(r));
        Eigen::Matrix2d metric, second;
        metric << p.u.dot(p.u), p.u.dot(p.v), p.u.dot(p.v), p.v.dot(p.v);
        second << p.uu.dot(r), p.uv.dot(r), p.uv.dot(r), p.vv.dot(r);
        second += metric;
        Eigen::Vector2d step;
        if (line) {
            const double along = line->dot(second * *line);
            step = -line->dot(slope) / (along > 0 ? along : line->dot(metric * *line)) * *line;
        } else {
            const bool convex = second(0, 0) > 0 && second.determinant() > 0;
            step = -(convex ? second : metric).inverse() * slope;
        }
        double part = room(at, step);
        const double shortest = converged / std::max(step.norm(), converged);
        for (; part > shortest; part /= 2) {
            const double next = (evaluate(cell, at + part * step).x - x).squaredNorm();
            if (next > value) continue;
            at += part * step, value = next;
            break;
        }
        if (part <= shortest) break;
    }
    return at;
}

// From the nearest node; and if that ends on an edge, also along the edges and from the nearest point there.
void ClosestPoint::look_at(int cell, const Query& query, MeshPoint& best) const {
    const auto distance2 = [&](const Eigen::Vector2d& at) { return (evaluate(cell, at).x - query.x).squaredNorm(); };
    const auto nearer = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return distance2(a) < distance2(b); };
    const Eigen::Vector2d start = *std::min_element(start_.begin(), start_.end(), nearer);
    Eigen::Vector2d at = approach(cell, start, nullptr, query.x);
    if (at.minCoeff() <= 0 || at.sum() >= 1 - converged) {
        for (int edge = 0; edge < 3; ++edge) {
            const Eigen::Vector2d from = on_edge(edge, 0), line = on_edge(edge, 1) - from;
            Eigen::Vector2d begin = from;
            for (int i = 1; i <= order_; ++i)
                if (const Eigen::Vector2d other = from + i * line / order_; nearer(other, begin)) begin = other;
            if (const Eigen::Vector2d found = approach(cell, begin, &line, query.x); nearer(found, at)) at = found;
        }
        at = approach(cell, at, nullptr, query.x);
    }
    accept(cell, at, query, best);
}

MeshPoint ClosestPoint::operator()(const Eigen::Vector3d& x, const Eigen::Vector3d& normal) const {
    MeshPoint best;
    double square = std::numeric_limits<double>::infinity();
    tree_.nearest(x, period_, square, [&](std::size_t cell, const Vector3d& image) {
        const int periods = period_ > 0 ? static_cast<int>(std::round((x.z() - image.z()) / period_)) : 0;
        look_at(static_cast<int>(cell), {image, normal, periods}, best);
        square = best.distance * best.distance;
    });
    return best;
}

}  // namespace tubule::surface3d
