#include "surface3d/guards.hpp"

#include <fmt/format.h>

#include "common/geometry/profile_point.hpp"

namespace tubule::surface3d {

namespace {

constexpr double tolerance = 0.01;

}  // namespace

std::optional<StopReport> find_fold(const SurfaceSpace& space, const CurvedMesh& mesh) {
    const Tabulation& table = space.tabulation();
    const Tabulation centre(space.order(), {{1.0 / 3, 1.0 / 3, 0.5}});
    for (int cell = 0; cell < space.cells(); ++cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        const Eigen::Vector3d normal = tangent_point(X, centre, 0).normal;
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            if (p.normal.dot(normal) > 0) continue;  // also false for a cell without area
            return StopReport{
                Stop::mesh_lost, 0,
                fmt::format("triangle {} folds at ({:.6g}, {:.6g}, {:.6g})", cell, p.x[0], p.x[1], p.x[2]),
                "use more elements, or discretisation.mesh = \"graded\""};
        }
    }
    return std::nullopt;
}

std::optional<StopReport> find_impossible_curvature(const Observables& o, const CurvedMesh& mesh) {
    const std::string advice = "use more elements, or another discretisation.recovery";
    if (mesh.period == 0 && o.integral_H2 < (1 - tolerance) * willmore_bound)
        return StopReport{Stop::resolution_lost, 0,
                          fmt::format("INT H^2 = {:.6g} is below 16 pi = {:.6g}, which no closed surface can have",
                                      o.integral_H2, willmore_bound),
                          advice};
    const double defect = gauss_bonnet_defect(o, mesh);
    if (!(std::abs(defect) <= tolerance * 4 * pi))
        return StopReport{Stop::resolution_lost, 0,
                          fmt::format("INT K = {:.6g} is off by {:.3g} from 2 pi times the Euler characteristic {}",
                                      o.integral_K, defect, euler_characteristic(mesh)),
                          advice};
    return std::nullopt;
}

}  // namespace tubule::surface3d
