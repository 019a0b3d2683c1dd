#include "tools/compare/triangle_surface.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <stdexcept>

#include "surface3d/mesh/reference_triangle.hpp"

namespace tubule::compare {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Parts are divided until their bulge is at most this fraction of their longest edge, up to this depth: close enough
// for Newton's method to converge.
constexpr double flat_enough = 0.05;
constexpr int deepest = 4;

const std::array<Vector2d, 3> corners{Vector2d(0, 0), Vector2d(1, 0), Vector2d(0, 1)};

int number_of(int order, int a, int b) {
    return a * (2 * order + 3 - a) / 2 + b;
}

// Position, first and second derivatives in xi and eta.
struct CellPoint {
    Vector3d x, d[2], dd[3];

    Vector3d along(const Vector2d& t) const { return d[0] * t[0] + d[1] * t[1]; }
    Vector3d twice_along(const Vector2d& t) const {
        return dd[0] * (t[0] * t[0]) + dd[1] * (2 * t[0] * t[1]) + dd[2] * (t[1] * t[1]);
    }
};

// De Casteljau, which works in place: what is written has been read.
CellPoint evaluate(int order, Coefficients c, const Vector2d& at) {
    const double l0 = 1 - at[0] - at[1], l1 = at[0], l2 = at[1];
    CellPoint p;
    for (Vector3d& second : p.dd) second.setZero();
    for (int n = order; n > 0; --n) {
        if (n == 2) {
            const double scale = order * (order - 1);
            p.dd[0] = scale * (c[number_of(2, 2, 0)] - 2 * c[number_of(2, 1, 0)] + c[0]);
            p.dd[1] = scale * (c[number_of(2, 1, 1)] - c[number_of(2, 1, 0)] - c[number_of(2, 0, 1)] + c[0]);
            p.dd[2] = scale * (c[number_of(2, 0, 2)] - 2 * c[number_of(2, 0, 1)] + c[0]);
        }
        if (n == 1) p.d[0] = order * (c[number_of(1, 1, 0)] - c[0]), p.d[1] = order * (c[number_of(1, 0, 1)] - c[0]);
        for (int a = 0; a < n; ++a)
            for (int b = 0; b < n - a; ++b)
                c[number_of(n - 1, a, b)] =
                    l0 * c[number_of(n, a, b)] + l1 * c[number_of(n, a + 1, b)] + l2 * c[number_of(n, a, b + 1)];
    }
    p.x = c[0];
    return p;
}

Eigen::MatrixXd bernstein_from_nodes(int order, const std::vector<std::array<int, 3>>& lattice) {
    const auto factorial = [](int n) { return std::tgamma(n + 1.0); };
    const int count = static_cast<int>(lattice.size());
    Eigen::MatrixXd values(count, count);
    for (int p = 0; p < count; ++p)
        for (int a = 0; a <= order; ++a)
            for (int b = 0; b <= order - a; ++b) {
                double value = factorial(order) / (factorial(order - a - b) * factorial(a) * factorial(b));
                const int power[3] = {order - a - b, a, b};
                for (int c = 0; c < 3; ++c) value *= std::pow(lattice[p][c] / static_cast<double>(order), power[c]);
                values(p, number_of(order, a, b)) = value;
            }
    return values.inverse();
}

// The part of a segment, 0 ... 1, that is nearest to x.
double along_segment(const Vector3d& from, const Vector3d& to, const Vector3d& x) {
    const Vector3d edge = to - from;
    const double square = edge.squaredNorm();
    return square > 0 ? std::clamp(edge.dot(x - from) / square, 0.0, 1.0) : 0;
}

// Of a flat triangle: barycentric coordinates of the point nearest to x.
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

struct TriangleSurface::Nearest {
    double square = std::numeric_limits<double>::infinity();
    int cell = -1;
    Vector2d at;
    Vector3d from;  // the query point, as the periodic image sees it

    void consider(int c, const Vector2d& place, const Vector3d& point, const Vector3d& x) {
        const double away = (point - x).squaredNorm();
        if (away < square) square = away, cell = c, at = place, from = x;
    }
};

TriangleSurface::TriangleSurface(const SurfaceCells& cells, const std::vector<double>& points)
    : order_(cells.order), period_(cells.period) {
    if (order_ < 1 || order_ > surface3d::max_order)
        throw std::invalid_argument("triangles must be of order 1 to 4, not " + std::to_string(order_));
    const auto lattice = surface3d::lattice(order_);
    const std::size_t width = lattice.size();
    if (points.size() != 3 * cells.nodes || cells.cells.empty() || cells.cells.size() % width != 0 ||
        (period_ > 0 && cells.shifts.size() != cells.cells.size()))
        throw std::invalid_argument("the points of the surface do not fit its triangles");
    to_bernstein_ = bernstein_from_nodes(order_, lattice);
    for (const auto& [i, j, l] : lattice) node_place_.emplace_back(double(j) / order_, double(l) / order_);
    std::vector<surface3d::BoxTree<3>::Box> boxes;
    cell_.resize(cells.cells.size() / width);
    for (std::size_t cell = 0; cell < cell_.size(); ++cell) {
        Eigen::MatrixX3d nodes(width, 3);
        for (std::size_t a = 0; a < width; ++a) {
            const std::size_t i = cell * width + a;
            nodes.row(a) = Eigen::Map<const Eigen::RowVector3d>(&points[3 * cells.cells.at(i)]);
            if (period_ > 0) nodes(a, 2) += period_ * cells.shifts[i];
        }
        const Eigen::MatrixX3d control = to_bernstein_ * nodes;
        for (std::size_t a = 0; a < width; ++a) cell_[cell][a] = control.row(a).transpose();
        add_parts(static_cast<int>(cell), corners, 0, boxes);
        grain_ += (nodes.row(1) - nodes.row(0)).cross(nodes.row(2) - nodes.row(0)).norm() / 2;
    }
    grain_ = std::sqrt(grain_ / static_cast<double>(cell_.size()));
    tree_ = surface3d::BoxTree<3>(std::move(boxes));
}

void TriangleSurface::add_parts(int cell, const std::array<Vector2d, 3>& corner, int depth,
                                std::vector<surface3d::BoxTree<3>::Box>& boxes) {
    const auto place = [&](const Vector2d& at) {
        return Vector2d(corner[0] + at[0] * (corner[1] - corner[0]) + at[1] * (corner[2] - corner[0]));
    };
    Eigen::MatrixX3d nodes(node_place_.size(), 3);
    for (std::size_t a = 0; a < node_place_.size(); ++a)
        nodes.row(a) = evaluate(order_, cell_[cell], place(node_place_[a])).x.transpose();
    const Eigen::MatrixX3d control = to_bernstein_ * nodes;
    Part part{cell, corner, {}, 0};
    for (int c = 0; c < 3; ++c) part.x[c] = nodes.row(c).transpose();
    surface3d::BoxTree<3>::Box box;
    for (int a = 0; a <= order_; ++a)
        for (int b = 0; b <= order_ - a; ++b) {
            const Vector3d point = control.row(number_of(order_, a, b)).transpose();
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

Foot TriangleSurface::foot(const Vector3d& x) const {
    Nearest nearest;
    tree_.nearest(x, period_, nearest.square,
                  [&](std::size_t part, const Vector3d& image) { look_at(part_[part], image, nearest); });
    const CellPoint p = evaluate(order_, cell_[nearest.cell], nearest.at);
    Foot foot;
    foot.point = p.x + (x - nearest.from);
    foot.normal = p.d[0].cross(p.d[1]).normalized();
    foot.distance = std::sqrt(nearest.square);
    return foot;
}

void TriangleSurface::look_at(const Part& part, const Vector3d& x, Nearest& nearest) const {
    const Vector3d b = nearest_barycentric(part.x, x);
    const double away = (b[0] * part.x[0] + b[1] * part.x[1] + b[2] * part.x[2] - x).norm() - part.bulge;
    if (away > 0 && away * away >= nearest.square) return;
    look_inside(part.cell, b[0] * part.corner[0] + b[1] * part.corner[1] + b[2] * part.corner[2], x, nearest);
}

// Newton's method on the polynomials, which continue beyond the triangle, then along the edges that it has crossed.
void TriangleSurface::look_inside(int cell, Vector2d at, const Vector3d& x, Nearest& nearest) const {
    constexpr int most = 20;
    constexpr double longest = 0.5, done = 1e-9, margin = 0.5;
    double last = 1;
    bool converged = false;
    for (int i = 0; i < most; ++i) {
        const CellPoint p = evaluate(order_, cell_[cell], at);
        if (at.minCoeff() >= 0 && at.sum() <= 1) nearest.consider(cell, at, p.x, x);
        if ((converged = last < done)) break;
        const Vector3d away = p.x - x;
        const Vector2d gradient(p.d[0].dot(away), p.d[1].dot(away));
        Eigen::Matrix2d metric;
        metric << p.d[0].dot(p.d[0]), p.d[0].dot(p.d[1]), p.d[0].dot(p.d[1]), p.d[1].dot(p.d[1]);
        Eigen::Matrix2d hessian = metric;
        hessian(0, 0) += p.dd[0].dot(away), hessian(1, 1) += p.dd[2].dot(away);
        hessian(0, 1) += p.dd[1].dot(away), hessian(1, 0) = hessian(0, 1);
        const bool convex = hessian(0, 0) > 0 && hessian.determinant() > 1e-3 * metric.determinant();
        Vector2d step = -(convex ? hessian : metric).inverse() * gradient;
        last = step.norm();
        if (!(last < longest)) step *= longest / last;
        at += step;
        if (!(std::min(at.minCoeff(), 1 - at.sum()) > -margin)) break;
    }
    const double inside[3] = {1 - at.sum(), at[0], at[1]};
    for (int edge = 0; edge < 3; ++edge)  // edge e runs from corner e to the next; corner e + 2 is opposite
        if (!converged || inside[(edge + 2) % 3] < 0) look_along(cell, edge, at, x, nearest);
}

void TriangleSurface::look_along(int cell, int edge, const Vector2d& from, const Vector3d& x, Nearest& nearest) const {
    constexpr int most = 15;
    constexpr double done = 1e-9;
    const Vector2d begin = corners[edge], way = corners[(edge + 1) % 3] - begin;
    double t = std::clamp(way.dot(from - begin) / way.squaredNorm(), 0.0, 1.0), last = 1;
    for (int i = 0; i < most && last > 0; ++i) {
        const CellPoint p = evaluate(order_, cell_[cell], begin + t * way);
        nearest.consider(cell, begin + t * way, p.x, x);
        if (last < done) return;
        const Vector3d tangent = p.along(way), away = p.x - x;
        const double square = tangent.squaredNorm(), curved = square + p.twice_along(way).dot(away);
        const double next = std::clamp(t - tangent.dot(away) / (curved > 1e-3 * square ? curved : square), 0.0, 1.0);
        last = std::abs(next - t);
        t = next;
    }
}

Vector3d TriangleSurface::at(const Place& place) const {
    return evaluate(order_, cell_[place.piece], place.at).x;
}

void TriangleSurface::confine(Place& place) const {
    Vector2d& at = place.at;
    at = at.cwiseMax(0).cwiseMin(1);
    const double beyond = at.sum() - 1;
    if (beyond > 0) at -= Vector2d::Constant(beyond / 2);
}

std::vector<Sample> TriangleSurface::samples(double) const {
    // The distance from a smooth surface is nearly a polynomial of degree k + 1 on each triangle.
    const auto rule = surface3d::quadrature(2 * order_ + 2);
    const Vector2d reach = Vector2d::Constant(0.5 / order_);
    std::vector<Sample> out;
    for (int cell = 0; cell < static_cast<int>(cell_.size()); ++cell) {
        for (const auto& [xi, eta, weight] : rule) {
            const CellPoint p = evaluate(order_, cell_[cell], {xi, eta});
            out.push_back({{cell, {xi, eta}}, reach, p.x, weight * p.d[0].cross(p.d[1]).norm()});
        }
        for (const Vector2d& at : node_place_)
            out.push_back({{cell, at}, reach, evaluate(order_, cell_[cell], at).x, 0});
    }
    return out;
}

}  // namespace tubule::compare
