#include "surface3d/curvature/bending_force.hpp"

#include <set>

#include "common/geometry/profile_point.hpp"
#include "surface3d/fem/places.hpp"
#include "surface3d/fem/projection.hpp"

namespace tubule::surface3d {

Observables observe(const SurfaceSpace& space, const CurvedMesh& mesh, const CurvatureField& curvature,
                    const Bending& bending, const Eigen::VectorXd& H0) {
    // Summed up cell by cell, so that the answer does not depend on the number of threads.
    const int terms = static_cast<int>(count_terms(bending));
    Eigen::MatrixXd of_cell(terms + 10, space.cells());
    const std::optional<Formula> W = potential_density_in_space(bending.potentials);
    const Tabulation& table = space.tabulation();
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        const auto H = space.gather(curvature.H, cell), K = space.gather(curvature.K, cell);
        Eigen::VectorXd nodal_H0;
        if (H0.size() > 0) nodal_H0 = space.gather(H0, cell);
        auto sum = of_cell.col(cell);
        sum.setZero();
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const double dS = table.weight[q] * p.area, h = H.dot(table.value.col(q)), k = K.dot(table.value.col(q));
            const double h0 = H0.size() > 0 ? nodal_H0.dot(table.value.col(q)) : bending.H0;
            for_each_value_at(bending, h0, h, k, [&](std::size_t i, double value) { sum[i] += dS * value; });
            // The flux of (x, y, 0)/2, which also holds for a period of a tube.
            const double flux = p.x.head<2>().dot(p.normal.head<2>()) / 2;
            const PointPotential of_place(W, p.x);
            const double slope = bending.kg != 0 ? (gradients(p, table, q) * H).norm() : 0;
            const Eigen::Matrix<double, 10, 1> others{1,
                                                      flux,
                                                      h * h,
                                                      k,
                                                      magnitude(bending, h0, h, k),
                                                      h,
                                                      of_place.value,
                                                      -of_place.slope[2],
                                                      std::abs(of_place.value),
                                                      bending.kg * slope * slope};
            sum.template tail<10>() += dS * others;
        }
    });
    const Eigen::VectorXd total = of_cell.rowwise().sum();
    Observables o;
    o.M = total[terms + 5];
    o.energy = o.energy_alpha = area_difference_energy(bending, o.M);
    for (int i = 0; i < terms; ++i) o.energy += o.energy_term.emplace_back(total[i]);
    o.area = total[terms], o.volume = total[terms + 1], o.integral_H2 = total[terms + 2];
    o.energy_kg = total[terms + 9], o.energy += o.energy_kg;
    o.integral_K = total[terms + 3];
    o.magnitude = total[terms + 4] + o.energy_kg + o.energy_alpha + total[terms + 8];
    o.potential = total[terms + 6], o.potential_force = total[terms + 7], o.energy += o.potential;
    return o;
}

int euler_characteristic(const CurvedMesh& mesh) {
    std::set<int> vertices;
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int c = 0; c < 3; ++c) vertices.insert(mesh.node(cell, c));
    return static_cast<int>(vertices.size()) - mesh.triangles() / 2;  // every triangle has three halves of an edge
}

double gauss_bonnet_defect(const Observables& o, const CurvedMesh& mesh) {
    return o.integral_K - 2 * pi * euler_characteristic(mesh);
}

VectorField bending_force(const SurfaceSpace& space, const CurvedMesh& mesh, const CurvatureField& curvature,
                          const Bending& bending) {
    const Tabulation& table = space.tabulation();
    VectorField force = VectorField::Zero(3, space.size());
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell), normals = space.gather(curvature.normal, cell);
        const CellColumns<6> tensors = space.gather(curvature.B, cell);
        const auto H = space.gather(curvature.H, cell), K = space.gather(curvature.K, cell);
        CellColumns<3> out = CellColumns<3>::Zero(3, space.width());
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const CellColumns<3> grad = gradients(p, table, q);
            const auto phi = table.value.col(q);
            const double h = H.dot(phi), k = K.dot(phi);
            const Eigen::Vector3d nu = (normals * phi).normalized();
            const Eigen::Matrix3d B = tensor(tensors * phi);
            const CurvatureJet<double> f = density(bending, h, k);

            const Eigen::Vector3d grad_H = grad * H, grad_K = grad * K;
            const Eigen::Vector3d grad_fK = f.HK * grad_H + f.KK * grad_K;
            const Eigen::Vector3d s = f.HH * grad_H + f.HK * grad_K + h * grad_fK - B * grad_fK;
            const double c = (h * h - 2 * k) * f.H + h * k * f.K - h * f.f;
            const double dS = table.weight[q] * p.area;
            out += (dS * nu) * (s.transpose() * grad) - (dS * (B * s + c * nu)) * phi.transpose();
        }
        for (int a = 0; a < space.width(); ++a) force.col(space.node(cell, a)) += out.col(a);
    });
    return force;
}

}  // namespace tubule::surface3d
