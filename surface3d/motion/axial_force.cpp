#include "surface3d/motion/axial_force.hpp"

#include "surface3d/motion/axial_stretch.hpp"

namespace tubule::surface3d {

double axial_force(const MovingSurface& surface, const MotionState& state, const MotionFields& fields,
                   const VectorField& u, double M, double tension, double pressure) {
    const CurvedMesh mesh = surface.mesh(state);
    if (!(mesh.period > 0)) return 0;
    const SurfaceSpace& space = surface.space();
    const SurfaceLaw& law = surface.law();
    const Tabulation& table = space.tabulation();
    const Bending bending = with_M(surface.bending(), M);
    const std::optional<Formula> W = potential_density_in_space(bending.potentials);
    Eigen::VectorXd p = Eigen::VectorXd::Constant(mesh.size(), -tension);
    if (law.inextensible && state.p.size() > 0) p = surface.pressure_at_nodes(state);
    Eigen::VectorXd of_cell(space.cells());
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell), U = space.gather(u, cell),
                             normals = space.gather(fields.normal, cell);
        const auto nodal_H = space.gather(fields.H, cell), nodal_K = space.gather(fields.K, cell),
                   nodal_p = space.gather(p, cell);
        double sum = 0;
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> x = tangent_point(X, table, q);
            const CellColumns<3> grad = gradients(x, table, q);
            const auto phi = table.value.col(q);
            const double H = nodal_H.dot(phi), K = nodal_K.dot(phi);
            const PointH0 H0(bending, gather_H0(space, fields.H0, cell), grad, phi, H, K);
            Eigen::Matrix<double, 3, 2> e;
            e << x.tangent[0].normalized(), x.normal.cross(x.tangent[0].normalized());
            const Eigen::Matrix2d B = e.transpose() * shape_operator(x, grad, normals) * e;
            const AxialStretch s = axial_stretch(e.row(2).transpose(), B, H, K);
            const Eigen::Vector3d along = e * s.along;
            const CurvatureJet<double> f = density_at(bending, H0.value, H, K);
            const double strain = along.dot(U * (grad.transpose() * along)) + state.stretch * s.area * s.area;
            double of_gradients = 0;
            if (bending.kg != 0) {
                const Eigen::Vector3d slope = grad * nodal_H;
                const double across = along.dot(slope);
                of_gradients = space.gather(fields.mu, cell).dot(phi) * s.H +
                               bending.kg * (slope.squaredNorm() * s.area - 2 * across * across);
            }
            const double pulls = f.f + PointPotential(W, x.x).value - nodal_p.dot(phi);
            sum += table.weight[q] * x.area *
                   (of_gradients + f.H * s.H + f.K * s.K + pulls * s.area + 2 * law.viscosity * strain);
        }
        of_cell[cell] = sum;
    });
    return (of_cell.sum() - pressure * extent(space, mesh).volume) / mesh.period;
}

}  // namespace tubule::surface3d
