#include "surface3d/motion/extent.hpp"

namespace tubule::surface3d {
namespace {

// `of_cell(cell)` gives what a cell has at its points: at_point(p, q).
template <class OfCell>
Extent sum_over(const SurfaceSpace& space, const CurvedMesh& mesh, OfCell&& of_cell) {
    Eigen::Matrix2Xd sums(2, space.cells());  // so that the sum does not depend on the number of threads
    const Tabulation& table = space.tabulation();
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        const auto at_point = of_cell(cell);
        Eigen::Vector2d sum = Eigen::Vector2d::Zero();
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            sum += table.weight[q] * p.area * at_point(p, q);
        }
        sums.col(cell) = sum;
    });
    const Eigen::Vector2d total = sums.rowwise().sum();
    return {total[0], total[1], 0};
}

}  // namespace

Extent extent(const SurfaceSpace& space, const CurvedMesh& mesh) {
    Extent out = sum_over(space, mesh, [](int) {
        return [](const SurfacePoint<double>& p, int) {
            return Eigen::Vector2d(1, p.x.head<2>().dot(p.normal.head<2>()) / 2);  // the flux of (x, y, 0)/2
        };
    });
    out.length = mesh.period;
    return out;
}

Extent stretch_rate(const SurfaceSpace& space, const CurvedMesh& mesh) {
    Extent out = sum_over(space, mesh, [](int) {
        return [](const SurfacePoint<double>& p, int) {
            return Eigen::Vector2d(1 - p.normal.z() * p.normal.z(), p.x.head<2>().dot(p.normal.head<2>()) / 2);
        };
    });
    out.length = mesh.period;
    return out;
}

Extent extent_rate(const SurfaceSpace& space, const CurvedMesh& mesh, const VectorField& d) {
    const Tabulation& table = space.tabulation();
    return sum_over(space, mesh, [&](int cell) {
        return [&table, D = space.gather(d, cell)](const SurfacePoint<double>& p, int q) {
            const double divergence = gradients(p, table, q).cwiseProduct(D).sum();
            return Eigen::Vector2d(divergence, (D * table.value.col(q)).dot(p.normal));
        };
    });
}

double integral(const SurfaceSpace& space, const CurvedMesh& mesh, const Eigen::VectorXd& values) {
    const Tabulation& table = space.tabulation();
    return sum_over(space, mesh,
                    [&](int cell) {
                        return [&table, nodal = space.gather(values, cell)](const SurfacePoint<double>&, int q) {
                            return Eigen::Vector2d(nodal.dot(table.value.col(q)), 0);
                        };
                    })
        .area;
}

}  // namespace tubule::surface3d
