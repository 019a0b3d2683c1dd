#include "surface3d/run/given_surface.hpp"

#include "surface3d/curvature/curvature.hpp"

namespace tubule::surface3d {
namespace {

struct Moments {
    double area = 0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();  // INT x dS
};
Moments moments(const CurvedMesh& mesh) {
    const Tabulation table(mesh.order, quadrature(default_degree(mesh.order)));
    Moments out;
    for (int cell = 0; cell < mesh.triangles(); ++cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        for (int q = 0; q < table.points(); ++q) {
            const auto p = tangent_point(X, table, q);
            out.area += table.weight[q] * p.area;
            out.first += table.weight[q] * p.area * p.x;
        }
    }
    return out;
}

}  // namespace

double area_of(const CurvedMesh& mesh) {
    return moments(mesh).area;
}

CurvedMesh scaled(CurvedMesh mesh, double factor) {
    for (Eigen::Vector3d& x : mesh.nodes) x *= factor;
    mesh.period *= factor;
    return mesh;
}

CurvedMesh displaced(CurvedMesh mesh, const DisturbedShape& modes) {
    const Moments m = moments(mesh);
    const Eigen::Vector3d centre =
        std::holds_alternative<Sphere>(modes) ? Eigen::Vector3d(m.first / m.area) : Eigen::Vector3d::Zero();
    const VectorField normal = PatchRecovery(mesh).nodal(mesh).normal;
    for (int i = 0; i < mesh.size(); ++i) {
        const Eigen::Vector3d at = mesh.nodes[i] - centre;
        mesh.nodes[i] += height_at<double>(modes, at) * normal.col(i);
    }
    return mesh;
}

}  // namespace tubule::surface3d
