#include "surface3d/motion/motion_fields.hpp"

#include "surface3d/fem/projection.hpp"

namespace tubule::surface3d {

MotionFields motion_fields(const SurfaceSpace& space, const CurvedMesh& mesh, const Projection& project, double kg) {
    const Tabulation& table = space.tabulation();
    using Columns6 = Eigen::Matrix<double, 6, Eigen::Dynamic>;
    const Columns6 both = project(load<6>(space, mesh, [&](int, const CellColumns<3>& X, int q, CellColumns<6>& out) {
        const SurfacePoint<double> p = tangent_point(X, table, q);
        const double dS = table.weight[q] * p.area;
        out.topRows<3>().noalias() += (dS * p.normal) * table.value.col(q).transpose();
        out.bottomRows<3>() -= dS * gradients(p, table, q);
    }));
    MotionFields fields{both.topRows<3>().colwise().normalized(), {}, {}};
    fields.H = both.bottomRows<3>().cwiseProduct(fields.normal).colwise().sum().transpose();
    using Row = Eigen::Matrix<double, 1, Eigen::Dynamic>;
    const Row K = project(load<1>(space, mesh, [&](int cell, const CellColumns<3>& X, int q, CellColumns<1>& out) {
        const SurfacePoint<double> p = tangent_point(X, table, q);
        const Eigen::Matrix3d B = shape_operator(p, gradients(p, table, q), space.gather(fields.normal, cell));
        const double H = B.trace();
        out += (table.weight[q] * p.area * (H * H - B.squaredNorm()) / 2) * table.value.col(q).transpose();
    }));
    fields.K = K.transpose();
    if (kg == 0) return fields;
    const Row mu = project(load<1>(space, mesh, [&](int cell, const CellColumns<3>& X, int q, CellColumns<1>& out) {
        const SurfacePoint<double> p = tangent_point(X, table, q);
        const CellColumns<3> grad = gradients(p, table, q);
        const Eigen::Vector3d slope = grad * space.gather(fields.H, cell);
        out += (2 * kg * table.weight[q] * p.area) * (slope.transpose() * grad);
    }));
    fields.mu = mu.transpose();
    return fields;
}

}  // namespace tubule::surface3d
