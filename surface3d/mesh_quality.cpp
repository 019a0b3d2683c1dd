#include "surface3d/mesh_quality.hpp"

#include <algorithm>
#include <cmath>

#include "surface3d/surface_space.hpp"

namespace tubule::surface3d {
namespace {

// The centre first, then the nodes.
Tabulation probes(int order) {
    std::vector<QuadraturePoint> points{{1.0 / 3, 1.0 / 3, 0}};
    for (const auto& [i, j, l] : lattice(order))
        points.push_back({static_cast<double>(j) / order, static_cast<double>(l) / order, 0});
    return {order, points};
}

double quality(const CellColumns<3>& X, const Tabulation& table) {
    Eigen::Vector3d middle;
    double least = HUGE_VAL, squares = 0;
    for (int q = 0; q < table.points(); ++q) {
        const Eigen::Vector3d u = X * table.d[0].col(q), v = X * table.d[1].col(q), area = u.cross(v);
        if (q == 0) middle = area.normalized();
        least = std::min(least, area.dot(middle));
        squares += u.squaredNorm() + v.squaredNorm() - u.dot(v);
    }
    // With tangents u, v of the right-angled reference triangle, those of the equilateral one are u and (2v -
    // u)/sqrt 3.
    const double J = least * 2 / std::sqrt(3.0), half_square = squares / table.points() * 2 / 3;
    return half_square > 0 ? J / half_square : -1;  // a point, or no numbers
}

}  // namespace

MeshQuality mesh_quality(const CurvedMesh& mesh) {
    const Tabulation table = probes(mesh.order);
    MeshQuality out;
    out.cell.resize(mesh.triangles());
    for (int cell = 0; cell < mesh.triangles(); ++cell) out.cell[cell] = quality(cell_nodes(mesh, cell), table);
    if (mesh.triangles() == 0) return out;
    out.worst = out.cell.minCoeff(&out.worst_cell);
    out.mean = out.cell.mean();
    out.where = cell_nodes(mesh, out.worst_cell) * table.value.col(0);
    return out;
}

double largest_curvature(double H, double K) {
    return std::abs(H) / 2 + std::sqrt(std::max(H * H / 4 - K, 0.0));
}

MeshResolution mesh_resolution(const CurvedMesh& mesh, const Eigen::VectorXd& H, const Eigen::VectorXd& K) {
    MeshResolution out;
    for (int cell = 0; cell < mesh.triangles(); ++cell) {
        const Eigen::Vector3d p[3] = {mesh.position(cell, 0), mesh.position(cell, 1), mesh.position(cell, 2)};
        const double width = std::max({(p[0] - p[1]).norm(), (p[1] - p[2]).norm(), (p[2] - p[0]).norm()});
        for (int a = 0; a < mesh.nodes_per_cell(); ++a) {
            const int node = mesh.node(cell, a);
            const double curvature = largest_curvature(H[node], K[node]);
            if (curvature * width > out.angle) out = {curvature * width, curvature, width, mesh.position(cell, a)};
        }
    }
    return out;
}

}  // namespace tubule::surface3d
