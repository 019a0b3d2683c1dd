// Irregular meshes whose vertices lie on surfaces known exactly, and the errors of a curved mesh against them.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "common/solve/dense.hpp"
#include "surface3d/import/import_mesh.hpp"
#include "surface3d/mesh/curved_mesh.hpp"
#include "surface3d/mesh/triangle_mesh.hpp"

namespace tubule::surface3d::samples {

using Eigen::Matrix3d, Eigen::Vector3d;

// A surface F(x) = 0, star-shaped about the origin, F < 0 inside:
// F = |x/axes|^2 + bump sin(3x + 1) sin(3y + 2) sin(3z) - 1.
struct Surface {
    Vector3d axes{1, 1, 1};
    double bump = 0;

    double value(const Vector3d& x) const {
        const Vector3d y = 3 * x + Vector3d(1, 2, 0);
        return x.cwiseQuotient(axes).squaredNorm() + bump * std::sin(y[0]) * std::sin(y[1]) * std::sin(y[2]) - 1;
    }
    Vector3d gradient(const Vector3d& x) const {
        const Vector3d y = 3 * x + Vector3d(1, 2, 0), s = y.array().sin(), c = y.array().cos();
        return 2 * x.cwiseQuotient(axes.cwiseAbs2()) +
               3 * bump * Vector3d(c[0] * s[1] * s[2], s[0] * c[1] * s[2], s[0] * s[1] * c[2]);
    }
    Matrix3d hessian(const Vector3d& x) const {
        const Vector3d y = 3 * x + Vector3d(1, 2, 0), s = y.array().sin(), c = y.array().cos();
        Matrix3d h = (2 * axes.cwiseAbs2().cwiseInverse()).asDiagonal();
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                double product = 9 * bump;
                for (int d = 0; d < 3; ++d) product *= (i == j || (d != i && d != j)) ? s[d] : c[d];
                h(i, j) += i == j ? -product : product;
            }
        }
        return h;
    }
    // Where the ray from the origin meets it: the F of a point far out is > 0, bisection and Newton steps.
    Vector3d along(const Vector3d& direction) const {
        double low = 0, high = 4;
        for (int i = 0; i < 60; ++i) {
            const double middle = (low + high) / 2;
            (value(middle * direction) < 0 ? low : high) = middle;
        }
        return low * direction;
    }
    // H = -div(grad F/|grad F|), negative on a sphere.
    double mean_curvature(const Vector3d& x) const {
        const Vector3d g = gradient(x);
        const Matrix3d h = hessian(x);
        return -(g.squaredNorm() * h.trace() - g.dot(h * g)) / std::pow(g.norm(), 3);
    }
};

// An icosahedron, each face cut into n^2 triangles, blown up to the unit sphere: 20 n^2 triangles.
inline TriangleMesh geodesic_sphere(int n) {
    const double p = (1 + std::sqrt(5.0)) / 2;
    const std::vector<Vector3d> corner{{-1, p, 0},  {1, p, 0},  {-1, -p, 0}, {1, -p, 0}, {0, -1, p},  {0, 1, p},
                                       {0, -1, -p}, {0, 1, -p}, {p, 0, -1},  {p, 0, 1},  {-p, 0, -1}, {-p, 0, 1}};
    const std::vector<std::array<int, 3>> face{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                               {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                               {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                               {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    TriangleMesh mesh;
    std::map<std::array<long, 3>, int> number;
    const auto vertex = [&](const Vector3d& x) {
        const std::array<long, 3> key{std::lround(1e6 * x[0]), std::lround(1e6 * x[1]), std::lround(1e6 * x[2])};
        const auto [it, added] = number.try_emplace(key, int(mesh.points.size()));
        if (added) mesh.points.push_back(x.normalized());
        return it->second;
    };
    for (const auto& [a, b, c] : face) {
        const auto at = [&](int i, int j) {
            return vertex((corner[a] * (n - i - j) + corner[b] * i + corner[c] * j) / n);
        };
        for (int i = 0; i < n; ++i) {
            for (int j = 0; i + j < n; ++j) {
                mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
                if (i + j < n - 1) mesh.triangles.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
            }
        }
    }
    return mesh;
}

// Turns about one edge in ten, where that leaves triangles of a fair shape: valences from 4 to 8 and more.
inline void flip_edges(TriangleMesh& mesh, std::mt19937& random) {
    std::map<std::pair<int, int>, int> left;  // the triangle to the left of each directed edge
    const auto enter = [&](int t) {
        for (int i = 0; i < 3; ++i) left[{mesh.triangles[t][i], mesh.triangles[t][(i + 1) % 3]}] = t;
    };
    for (int t = 0; t < int(mesh.triangles.size()); ++t) enter(t);
    const auto fair = [&](int a, int b, int c) {
        const Vector3d &x = mesh.points[a], &y = mesh.points[b], &z = mesh.points[c];
        const Vector3d area = (y - x).cross(z - x);
        const double longest = std::max({(y - x).squaredNorm(), (z - y).squaredNorm(), (x - z).squaredNorm()});
        return area.dot(x) > 0.35 * longest;
    };
    const auto third = [&](int t, int a, int b) {
        for (const int v : mesh.triangles[t]) {
            if (v != a && v != b) return v;
        }
        return -1;
    };
    for (std::size_t tries = 0; tries < mesh.triangles.size() / 3; ++tries) {
        const int t = int(random() % mesh.triangles.size()), i = int(random() % 3);
        const int a = mesh.triangles[t][i], b = mesh.triangles[t][(i + 1) % 3], s = left[{b, a}];
        const int c = third(t, a, b), d = third(s, a, b);
        if (left.contains({c, d}) || left.contains({d, c}) || !fair(c, a, d) || !fair(d, b, c)) continue;
        left.erase({a, b}), left.erase({b, a});
        mesh.triangles[t] = {c, a, d}, mesh.triangles[s] = {d, b, c};
        enter(t), enter(s);
    }
}

// 20 n^2 triangles with vertices on the surface, pushed about by up to a quarter of an edge, some edges turned.
inline TriangleMesh irregular(const Surface& surface, int n, unsigned seed = 1) {
    std::mt19937 random(seed);  // the same everywhere, unlike the distributions of the standard library
    const auto uniform = [&] { return 2 * double(random()) / 4294967295.0 - 1; };
    TriangleMesh mesh = geodesic_sphere(n);
    const double jitter = 0.25 * 1.1 / n;  // an edge is 0.9 to 1.3 of 1/n
    for (Vector3d& x : mesh.points) x = (x + jitter * Vector3d(uniform(), uniform(), uniform())).normalized();
    flip_edges(mesh, random);
    for (Vector3d& x : mesh.points) x = surface.along(x);
    return mesh;
}

// A long body bent round until its ends face each other, `gap` apart (negative: they overlap) if it were smooth. Two
// flat triangles face each other there, so those have a gap still when the smooth ends overlap a little.
inline TriangleMesh bent_body(double gap) {
    TriangleMesh mesh = geodesic_sphere(10);
    const Vector3d face_centre = Vector3d(-1, (1 + std::sqrt(5.0)) / 2, 0) + Vector3d(-(1 + std::sqrt(5.0)) / 2, 0, 1) +
                                 Vector3d(0, 1, (1 + std::sqrt(5.0)) / 2);
    const Vector3d across = face_centre.cross(Vector3d::UnitZ());
    const Eigen::AngleAxisd turn(std::atan2(across.norm(), face_centre[2]), across.normalized());
    const double radius = 1.6, stretch = std::numbers::pi * radius - gap / 2 - 1;
    for (Vector3d& x : mesh.points) {
        x = turn * x;
        const double angle = (x[2] + stretch * std::sin(std::numbers::pi / 2 * x[2])) / radius;
        x = Vector3d((radius + x[0]) * std::cos(angle), x[1], (radius + x[0]) * std::sin(angle));
    }
    return mesh;
}

// Root mean squares over the elements, each sampled evenly inside, without weights for area.
struct Errors {
    double position = 0, normal = 0,
           mean_curvature = 0;  // distance; length of the difference; of H, element by element
};

// Lagrange functions of degree k at barycentric coordinates, from products of linear factors, with first and second
// derivatives by finite differences of a polynomial of degree 4 (exact up to rounding: central, five points).
inline Errors errors(const CurvedMesh& mesh, const Surface& surface) {
    const int k = mesh.order, n = mesh.nodes_per_cell();
    std::vector<std::array<int, 3>> index{{k, 0, 0}, {0, k, 0}, {0, 0, k}};
    for (int i = 1; i < k; ++i) index.push_back({k - i, i, 0});
    for (int i = 1; i < k; ++i) index.push_back({0, k - i, i});
    for (int i = 1; i < k; ++i) index.push_back({i, 0, k - i});
    if (k == 3) index.push_back({1, 1, 1});
    if (k == 4) index.insert(index.end(), {{2, 1, 1}, {1, 2, 1}, {1, 1, 2}});
    // The monomials s^i t^j of degree <= k at the nodes; rows of the inverse are the shape functions.
    const auto monomial_row = [&](double s, double t, int ds, int dt) {
        Eigen::VectorXd row(n);
        int column = 0;
        const auto power = [](double x, int e, int d) {
            double factor = 1;
            for (int m = 0; m < d; ++m) factor *= e - m;
            return e < d ? 0 : factor * std::pow(x, e - d);
        };
        for (int i = 0; i <= k; ++i) {
            for (int j = 0; i + j <= k; ++j) row[column++] = power(s, i, ds) * power(t, j, dt);
        }
        return row;
    };
    Eigen::MatrixXd at_nodes(n, n);
    for (int a = 0; a < n; ++a) at_nodes.row(a) = monomial_row(double(index[a][1]) / k, double(index[a][2]) / k, 0, 0);
    const Eigen::MatrixXd inverse = solve_dense(at_nodes, Eigen::MatrixXd::Identity(n, n));

    Errors sum;
    int count = 0;
    const int samples = 4;
    for (int i = 0; i < samples; ++i) {
        for (int j = 0; i + j < samples; ++j, ++count) {
            const double s = (i + 1 / 3.0) / samples, t = (j + 1 / 3.0) / samples;
            Eigen::MatrixXd shape(6, n);  // X, X_s, X_t, X_ss, X_st, X_tt
            const int order[6][2] = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}};
            for (int d = 0; d < 6; ++d)
                shape.row(d) = monomial_row(s, t, order[d][0], order[d][1]).transpose() * inverse;
            for (int cell = 0; cell < mesh.triangles(); ++cell) {
                Eigen::Matrix<double, 6, 3> x = Eigen::Matrix<double, 6, 3>::Zero();
                for (int a = 0; a < n; ++a) x += shape.col(a) * mesh.position(cell, a).transpose();
                const Vector3d place = x.row(0), xs = x.row(1), xt = x.row(2);
                const Vector3d normal = xs.cross(xt).normalized(), exact = surface.gradient(place).normalized();
                // H = trace of (first form)^-1 (second form), B = -grad nu
                Eigen::Matrix2d first, second;
                first << xs.dot(xs), xs.dot(xt), xs.dot(xt), xt.dot(xt);
                second << x.row(3) * normal, x.row(4) * normal, x.row(4) * normal, x.row(5) * normal;
                const double H = (first.inverse() * second).trace();
                sum.position += std::pow(surface.value(place) / surface.gradient(place).norm(), 2);
                sum.normal += (normal - exact).squaredNorm();
                sum.mean_curvature += std::pow(H - surface.mean_curvature(place), 2);
            }
        }
    }
    const double total = double(count) * mesh.triangles();
    return {std::sqrt(sum.position / total), std::sqrt(sum.normal / total), std::sqrt(sum.mean_curvature / total)};
}

}  // namespace tubule::surface3d::samples
