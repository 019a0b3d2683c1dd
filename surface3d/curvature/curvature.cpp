#include "surface3d/curvature/curvature.hpp"

#include <fmt/core.h>

#include <cmath>
#include <map>
#include <stdexcept>

#include "surface3d/fem/projection.hpp"

namespace tubule::surface3d {
namespace {

VectorField projected_normal(const SurfaceSpace& space, const CurvedMesh& mesh, const Projection& project) {
    const Tabulation& table = space.tabulation();
    VectorField normal = project(load<3>(space, mesh, [&](int, const CellColumns<3>& X, int q, CellColumns<3>& out) {
        const SurfacePoint<double> p = tangent_point(X, table, q);
        out.noalias() += (table.weight[q] * p.area * p.normal) * table.value.col(q).transpose();
    }));
    normal.colwise().normalize();
    return normal;
}

// B, H and K as one column, and back.
using Column8 = Eigen::Matrix<double, 8, 1>;
Column8 column_of(const Eigen::Matrix3d& B, double H, double K) {
    Column8 out;
    out.head<6>() = packed_tensor(B);
    out[6] = H, out[7] = K;
    return out;
}
CurvatureField field_of(VectorField normal, const Eigen::Matrix<double, 8, Eigen::Dynamic>& BHK) {
    return {std::move(normal), BHK.topRows<6>(), BHK.row(6).transpose(), BHK.row(7).transpose()};
}

double K_of(double H, const Eigen::Matrix3d& B) {
    return (H * H - B.squaredNorm()) / 2;
}

CurvatureField elementwise(const SurfaceSpace& space, const CurvedMesh& mesh) {
    const Tabulation& table = space.tabulation();
    const Projection project(space, mesh);
    const auto BHK = load<8>(space, mesh, [&](int, const CellColumns<3>& X, int q, CellColumns<8>& out) {
        const SurfacePoint<double> p = curved_point(X, table, q);
        out.noalias() += (table.weight[q] * p.area * column_of(p.B, p.H, p.K)) * table.value.col(q).transpose();
    });
    return field_of(projected_normal(space, mesh, project), project(BHK));
}

CurvatureField from_normal(const SurfaceSpace& space, const CurvedMesh& mesh) {
    const Tabulation& table = space.tabulation();
    const Projection project(space, mesh);
    const VectorField normal = projected_normal(space, mesh, project);
    const auto BHK = load<8>(space, mesh, [&](int cell, const CellColumns<3>& X, int q, CellColumns<8>& out) {
        const SurfacePoint<double> p = tangent_point(X, table, q);
        const CellColumns<3> nu = space.gather(normal, cell);
        const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - p.normal * p.normal.transpose();
        const Eigen::Matrix3d grad = gradients(p, table, q) * nu.transpose() * P;
        const Eigen::Matrix3d B = -(grad + grad.transpose()) / 2;
        out.noalias() +=
            (table.weight[q] * p.area * column_of(B, B.trace(), K_of(B.trace(), B))) * table.value.col(q).transpose();
    });
    return field_of(normal, project(BHK));
}

// INT (B_ij - H nu_i nu_j) phi = INT nu_j d_i phi, of which the tangential part is B; INT kappa_i phi = -INT d_i phi.
CurvatureField weak(const SurfaceSpace& space, const CurvedMesh& mesh) {
    const Tabulation& table = space.tabulation();
    const Projection project(space, mesh);
    CurvatureField field{projected_normal(space, mesh, project), TensorField(6, space.size()),
                         Eigen::VectorXd(space.size()), Eigen::VectorXd(space.size())};
    const auto kappa = project(load<3>(space, mesh, [&](int, const CellColumns<3>& X, int q, CellColumns<3>& out) {
        const SurfacePoint<double> p = tangent_point(X, table, q);
        out -= table.weight[q] * p.area * gradients(p, table, q);
    }));
    const auto BN = project(load<6>(space, mesh, [&](int, const CellColumns<3>& X, int q, CellColumns<6>& out) {
        const SurfacePoint<double> p = tangent_point(X, table, q);
        const CellColumns<3> grad = gradients(p, table, q);
        for (int a = 0; a < out.cols(); ++a)
            out.col(a) += table.weight[q] * p.area * packed_tensor(grad.col(a) * p.normal.transpose());
    }));
    for (int i = 0; i < space.size(); ++i) {
        const Eigen::Vector3d nu = field.normal.col(i);
        const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - nu * nu.transpose();
        const Eigen::Matrix3d B = P * tensor(BN.col(i)) * P;
        field.B.col(i) = packed_tensor(B);
        field.H[i] = kappa.col(i).dot(nu);
        field.K[i] = K_of(field.H[i], B);
    }
    return field;
}

// Adds INT angle phi mu mu over the edges: what the elements miss of -grad nu, as the normal turns by an angle about
// the edge, in the direction mu across it.
void add_kinks(const SurfaceSpace& space, const CurvedMesh& mesh, TensorField& total) {
    // Gauss points on each edge of the reference triangle. The neighbour runs through its edge backwards.
    const auto gauss = gauss_points(2 * space.order());
    const int n = static_cast<int>(gauss.size());
    const Eigen::Vector2d corners[3]{{0, 0}, {1, 0}, {0, 1}};
    std::vector<Tabulation> tables;
    for (int e = 0; e < 3; ++e) {
        std::vector<QuadraturePoint> points;
        for (const auto& [s, weight] : gauss) {
            const Eigen::Vector2d x = (1 - s) * corners[e] + s * corners[(e + 1) % 3];
            points.push_back({x[0], x[1], weight});
        }
        tables.emplace_back(space.order(), points);
    }

    struct Side {
        int cell, edge;
    };
    std::map<std::array<int, 2>, std::vector<Side>> edges;  // by the first and the last node inside
    const int inside = space.order() - 1;
    for (int cell = 0; cell < space.cells(); ++cell)
        for (int e = 0; e < 3; ++e) {
            const int first = space.node(cell, 3 + e * inside), last = space.node(cell, 2 + (e + 1) * inside);
            edges[{std::min(first, last), std::max(first, last)}].push_back({cell, e});
        }
    for (const auto& [key, sides] : edges) {
        const Side &here = sides.at(0), &there = sides.at(1);
        const Tabulation& table = tables[here.edge];
        const CellColumns<3> X = cell_nodes(mesh, here.cell), Y = cell_nodes(mesh, there.cell);
        const Eigen::Vector2d along = corners[(here.edge + 1) % 3] - corners[here.edge];
        for (int q = 0; q < n; ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const Eigen::Vector3d tangent = p.tangent[0] * along[0] + p.tangent[1] * along[1];
            const Eigen::Vector3d jump = tangent_point(Y, tables[there.edge], n - 1 - q).normal - p.normal;
            const Eigen::Vector3d across = tangent.cross(2 * p.normal + jump).normalized();
            const double angle = -std::copysign(2 * std::asin(jump.norm() / 2), jump.dot(across));
            const Eigen::Matrix<double, 6, 1> kink =
                (table.weight[q] * tangent.norm() * angle) * packed_tensor(across * across.transpose());
            for (int a = 0; a < space.width(); ++a) total.col(space.node(here.cell, a)) += kink * table.value(a, q);
        }
    }
}

CurvatureField lifted(const SurfaceSpace& space, const CurvedMesh& mesh) {
    const Tabulation& table = space.tabulation();
    const Projection project(space, mesh);
    TensorField B = load<6>(space, mesh, [&](int, const CellColumns<3>& X, int q, CellColumns<6>& out) {
        const SurfacePoint<double> p = curved_point(X, table, q);
        out.noalias() += (table.weight[q] * p.area * packed_tensor(p.B)) * table.value.col(q).transpose();
    });
    add_kinks(space, mesh, B);
    CurvatureField field{projected_normal(space, mesh, project), project(B), Eigen::VectorXd(space.size()),
                         Eigen::VectorXd(space.size())};
    for (int i = 0; i < space.size(); ++i) {
        const Eigen::Matrix3d Bi = tensor(field.B.col(i));
        field.H[i] = Bi.trace();
        field.K[i] = K_of(field.H[i], Bi);
    }
    return field;
}

}  // namespace

CurvatureField recover(const SurfaceSpace& space, const CurvedMesh& mesh, Recovery recovery) {
    switch (recovery) {
        case Recovery::elementwise:
            return elementwise(space, mesh);
        case Recovery::normal:
            return from_normal(space, mesh);
        case Recovery::weak:
            return weak(space, mesh);
        case Recovery::lifted:
            return lifted(space, mesh);
        case Recovery::patch_nodal:
            return PatchRecovery(mesh).nodal(mesh);
        case Recovery::exact:
            throw std::invalid_argument("exact curvatures need an analytic surface, not only the nodes of a mesh");
        default:
            return PatchRecovery(mesh).projected(space, mesh);
    }
}

CurvatureGradients smooth(const SurfaceSpace& space, const CurvedMesh& mesh, double eps, CurvatureField& field) {
    if (!(eps >= 0))
        throw std::invalid_argument(
            fmt::format("the smoothing parameter eps of curvatures must be >= 0, not {:g}", eps));
    const Tabulation& table = space.tabulation();
    const auto rough = load<6>(space, mesh, [&](int cell, const CellColumns<3>& X, int q, CellColumns<6>& out) {
        const SurfacePoint<double> p = tangent_point(X, table, q);
        const CellColumns<3> grad = gradients(p, table, q);
        Eigen::Matrix<double, 6, 1> both;
        both << grad * space.gather(field.H, cell), grad * space.gather(field.K, cell);
        out.noalias() += (table.weight[q] * p.area * both) * table.value.col(q).transpose();
    });
    const Eigen::SparseMatrix<double> M = mass_matrix(space, mesh);
    SparseCholesky step;
    step.factor(M + eps * stiffness_matrix(space, mesh));
    field.H = step.solve(M * field.H);
    field.K = step.solve(M * field.K);
    const Eigen::Matrix<double, 6, Eigen::Dynamic> smoothed = step.solve(rough.transpose().eval()).transpose();
    return {smoothed.topRows<3>(), smoothed.bottomRows<3>()};
}

}  // namespace tubule::surface3d
