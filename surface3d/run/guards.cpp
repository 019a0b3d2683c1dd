#include "surface3d/run/guards.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "common/geometry/profile_point.hpp"
#include "surface3d/mesh/self_intersection.hpp"

namespace tubule::surface3d {

std::optional<StopReport> find_fold(const MeshQuality& quality) {
    if (quality.worst > 0) return std::nullopt;
    const Eigen::Vector3d& x = quality.where;
    return StopReport{
        Stop::mesh_lost, 0,
        fmt::format("triangle {} folds at ({:.6g}, {:.6g}, {:.6g})", quality.worst_cell, x[0], x[1], x[2]),
        "use more elements, or discretisation.mesh = \"graded\""};
}

std::optional<StopReport> find_impossible_curvature(const Observables& o, const CurvedMesh& mesh, double allowed) {
    const std::string advice = "use more elements, or another discretisation.recovery";
    if (mesh.period == 0 && !(o.integral_H2 >= (1 - allowed) * willmore_bound))
        return StopReport{Stop::resolution_lost, 0,
                          fmt::format("INT H^2 = {:.6g} is below 16 pi = {:.6g}, which no closed surface can have",
                                      o.integral_H2, willmore_bound),
                          advice};
    const double defect = gauss_bonnet_defect(o, mesh);
    const int surplus = mesh.period == 0 ? std::abs(euler_characteristic(mesh)) : 0;
    if (!(std::abs(defect) <= allowed * 2 * pi * std::max(2, surplus)))
        return StopReport{Stop::resolution_lost, 0,
                          fmt::format("INT K = {:.6g} differs by {:.3g} from 2 pi times the Euler characteristic {}",
                                      o.integral_K, defect, euler_characteristic(mesh)),
                          advice};
    return std::nullopt;
}

namespace {

// The triangles between neighbouring nodes of a cell, counter-clockwise.
std::vector<std::array<int, 3>> lattice_triangles(int order) {
    const auto nodes = lattice(order);
    const auto at = [&](int j, int l) {
        return static_cast<int>(std::find(nodes.begin(), nodes.end(), std::array<int, 3>{order - j - l, j, l}) -
                                nodes.begin());
    };
    std::vector<std::array<int, 3>> out;
    for (int j = 0; j < order; ++j)
        for (int l = 0; j + l < order; ++l) {
            out.push_back({at(j, l), at(j + 1, l), at(j, l + 1)});
            if (j + l + 1 < order) out.push_back({at(j + 1, l), at(j + 1, l + 1), at(j, l + 1)});
        }
    return out;
}

// The number of periods of a tube among which are all triangles that may meet.
int images(const CurvedMesh& mesh) {
    if (mesh.period == 0) return 1;
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int a = 0; a < mesh.nodes_per_cell(); ++a) {
            const double z = mesh.position(cell, a).z();
            low = std::min(low, z), high = std::max(high, z);
        }
    return 1 + static_cast<int>((high - low) / mesh.period);
}

// The flat triangles between the nodes; of a tube, which is cut open, `images` periods.
TriangleMesh flattened(const CurvedMesh& mesh, int images) {
    TriangleMesh flat;
    std::map<std::array<int, 2>, int> number;  // of a node, in the period where a cell sees it
    const auto small = lattice_triangles(mesh.order);
    for (int image = 0; image < images; ++image)
        for (int cell = 0; cell < mesh.triangles(); ++cell)
            for (const auto& corners : small) {
                std::array<int, 3> triangle;
                for (int c = 0; c < 3; ++c) {
                    const int seen = mesh.period > 0 ? mesh.shifts[cell * mesh.nodes_per_cell() + corners[c]] : 0;
                    const auto [found, is_new] = number.try_emplace({mesh.node(cell, corners[c]), seen + image},
                                                                    static_cast<int>(flat.points.size()));
                    const Eigen::Vector3d up = image * mesh.period * Eigen::Vector3d::UnitZ();
                    if (is_new) flat.points.push_back(mesh.position(cell, corners[c]) + up);
                    triangle[c] = found->second;
                }
                flat.triangles.push_back(triangle);
            }
    return flat;
}

}  // namespace

std::optional<StopReport> find_self_intersection(const CurvedMesh& mesh) {
    const TriangleMesh flat = flattened(mesh, images(mesh));
    const auto pair = first_intersection(flat);
    if (!pair) return std::nullopt;
    const Eigen::Vector3d x = flat.corner(static_cast<int>(pair->first), 0);
    return StopReport{Stop::self_intersection, 0,
                      fmt::format("the surface intersects itself near ({:.4g}, {:.4g}, {:.4g})", x[0], x[1], x[2]),
                      "contact is not modelled: later results are invalid"};
}

}  // namespace tubule::surface3d
