#include "surface3d/fem/mesh_quality.hpp"

#include <algorithm>
#include <cmath>

#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {
namespace {

struct PointQuality {
    double quality, width;
};

PointQuality quality_at(const SurfacePoint<double>& p, const Eigen::Vector3d& middle) {
    const double width = triangle_width(p), shape = 2 / std::sqrt(3.0) * p.area / (width * width);
    if (!std::isfinite(shape)) return {-1, width};  // a point, or no numbers
    return {p.normal.dot(middle) > 0 ? shape : -shape, width};
}

}  // namespace

MeshQuality mesh_quality(const CurvedMesh& mesh) {
    const Tabulation table(mesh.order, quadrature(default_degree(mesh.order)));
    const Tabulation centre(mesh.order, {{1.0 / 3, 1.0 / 3, 0}});
    MeshQuality out;
    out.width.resize(mesh.triangles());
    double sum = 0;
    for (int cell = 0; cell < mesh.triangles(); ++cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        const Eigen::Vector3d middle = tangent_point(X, centre, 0).normal;
        double least = HUGE_VAL, widest = 0;
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const auto [quality, width] = quality_at(p, middle);
            least = std::min(least, quality), widest = std::max(widest, width);
            if (out.worst_cell >= 0 && quality >= out.worst) continue;
            out.worst = quality, out.worst_cell = cell, out.where = p.x;
        }
        sum += least;
        out.width[cell] = widest;
    }
    if (mesh.triangles() > 0) out.mean = sum / mesh.triangles();
    return out;
}

double largest_curvature(double H, double K) {
    return std::abs(H) / 2 + std::sqrt(std::max(H * H / 4 - K, 0.0));
}

MeshTurn mesh_turn(const CurvedMesh& mesh, const MeshQuality& quality, const Eigen::VectorXd& H,
                   const Eigen::VectorXd& K) {
    MeshTurn out;
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int a = 0; a < mesh.nodes_per_cell(); ++a) {
            const int i = mesh.node(cell, a);
            const double angle = largest_curvature(H[i], K[i]) * quality.width[cell] / mesh.order;
            if (!(angle <= out.angle)) out = {angle, mesh.nodes[i], K[i] < 0};
        }
    return out;
}

}  // namespace tubule::surface3d
