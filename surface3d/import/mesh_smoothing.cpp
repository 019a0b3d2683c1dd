#include "surface3d/import/mesh_smoothing.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/solve/sparse.hpp"

namespace tubule::surface3d {

namespace {

using Eigen::Vector3d;
using Sparse = Eigen::SparseMatrix<double>;
using Columns = Eigen::MatrixX3d;

double half_cotangent(const TriangleMesh& mesh, const std::array<int, 3>& t, int corner) {
    const Vector3d& x = mesh.points[t[corner]];
    const Vector3d u = mesh.points[t[(corner + 1) % 3]] - x, v = mesh.points[t[(corner + 2) % 3]] - x;
    return u.dot(v) / (2 * u.cross(v).norm());
}

// Linear elements: the stiffness matrix, and a third of the area of the triangles at each vertex.
struct Laplacian {
    Sparse stiffness;
    Eigen::VectorXd area;
};

Laplacian laplacian(const TriangleMesh& mesh) {
    const int n = int(mesh.points.size());
    Laplacian out{Sparse(n, n), Eigen::VectorXd::Zero(n)};
    std::vector<Eigen::Triplet<double>> entries;
    for (const auto& t : mesh.triangles) {
        const double third = area_vector(mesh, t).norm() / 3;
        for (int i = 0; i < 3; ++i) {
            const int a = t[(i + 1) % 3], b = t[(i + 2) % 3];
            const double weight = half_cotangent(mesh, t, i);
            entries.emplace_back(a, b, -weight), entries.emplace_back(b, a, -weight);
            entries.emplace_back(a, a, weight), entries.emplace_back(b, b, weight);
            out.area[t[i]] += third;
        }
    }
    out.stiffness.setFromTriplets(entries.begin(), entries.end());
    return out;
}

Columns normal_columns(const TriangleMesh& mesh) {
    Columns n = Columns::Zero(Eigen::Index(mesh.points.size()), 3);
    for (const auto& t : mesh.triangles)
        for (const int v : t) n.row(v) += area_vector(mesh, t).transpose();
    for (Eigen::Index i = 0; i < n.rows(); ++i)
        if (const double length = n.row(i).norm(); length > 0) n.row(i) /= length;
    return n;
}

// The fields that minimise INT |f - f0|^2 + lambda^4 |Lap f|^2.
Columns filtered(const Laplacian& of, double halved, const Columns& fields) {
    const double lambda = halved / (2 * std::numbers::pi);
    const Sparse half = of.area.cwiseSqrt().cwiseInverse().asDiagonal() * of.stiffness;
    SparseCholesky solver;
    solver.factor(std::pow(lambda, 4) * Sparse(half.transpose() * half) + Sparse(of.area.asDiagonal()));
    return solver.solve(Columns(of.area.asDiagonal() * fields));
}

// About the middle: a small body far away keeps its digits.
struct Centred {
    Columns x;
    Eigen::RowVector3d middle;

    explicit Centred(const TriangleMesh& mesh) : x(mesh.points.size(), 3) {
        for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(i) = mesh.points[i];
        middle = x.colwise().mean();
        x.rowwise() -= middle;
    }
    TriangleMesh moved(TriangleMesh mesh, const Columns& to) const {
        for (Eigen::Index i = 0; i < to.rows(); ++i) mesh.points[i] = to.row(i) + middle;
        return mesh;
    }
};

// The divergence of the gradients of the points, projected.
Columns projected_edges(const TriangleMesh& mesh, const Columns& normal) {
    Columns sum = Columns::Zero(normal.rows(), 3);
    for (const auto& t : mesh.triangles) {
        const Vector3d n = (normal.row(t[0]) + normal.row(t[1]) + normal.row(t[2])).transpose().normalized();
        for (int i = 0; i < 3; ++i) {
            const int a = t[(i + 1) % 3], b = t[(i + 2) % 3];
            const Vector3d edge = mesh.points[a] - mesh.points[b];
            const Vector3d weighted = half_cotangent(mesh, t, i) * (edge - n.dot(edge) * n);
            sum.row(a) += weighted.transpose(), sum.row(b) -= weighted.transpose();
        }
    }
    return sum;
}

}  // namespace

TriangleMesh smoothed(const TriangleMesh& mesh, double halved) {
    const Laplacian of = laplacian(mesh);
    const Centred points(mesh);
    // Where waves of the length are concerned this holds the points by less than 3 percent, farther ones fast.
    const Eigen::VectorXd hold = of.area / (halved * halved);
    SparseCholesky solver;
    solver.factor(of.stiffness + Sparse(hold.asDiagonal()));
    const Columns normal = filtered(of, halved, normal_columns(mesh));
    return points.moved(mesh, solver.solve(Columns(projected_edges(mesh, normal) + hold.asDiagonal() * points.x)));
}

TriangleMesh unfolded(const TriangleMesh& mesh, double halved) {
    const Centred points(mesh);
    return points.moved(mesh, filtered(laplacian(mesh), halved, points.x));
}

TriangleMesh with_volume(const TriangleMesh& mesh, double volume) {
    const Columns normal = normal_columns(mesh);
    TriangleMesh out = mesh;
    double moved = 0;
    for (int step = 0; step < 5; ++step) {  // Newton's method: the third step is already rounding
        moved += (volume - mesh_volume(out)) / mesh_area(out);
        for (std::size_t i = 0; i < out.points.size(); ++i)
            out.points[i] = mesh.points[i] + moved * normal.row(Eigen::Index(i)).transpose();
    }
    return out;
}

Vector3d area_vector(const TriangleMesh& mesh, const std::array<int, 3>& t) {
    return (mesh.points[t[1]] - mesh.points[t[0]]).cross(mesh.points[t[2]] - mesh.points[t[0]]) / 2;
}

double kink_between(const Vector3d& a, const Vector3d& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

double mesh_area(const TriangleMesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles) sum += area_vector(mesh, t).norm();
    return sum;
}

// About a point of the mesh, not the origin: a small body far away keeps its digits.
double mesh_volume(const TriangleMesh& mesh) {
    double sum = 0;
    const Vector3d origin = mesh.points[mesh.triangles[0][0]];
    for (const auto& t : mesh.triangles) sum += area_vector(mesh, t).dot(mesh.points[t[0]] - origin) / 3;
    return sum;
}

double even_edge(double area, double triangles) {
    return std::sqrt(4 / std::sqrt(3.0) * area / triangles);
}

}  // namespace tubule::surface3d
