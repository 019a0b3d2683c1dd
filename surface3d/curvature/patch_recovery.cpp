#include <algorithm>
#include <optional>
#include <set>

#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
#include "surface3d/curvature/curvature.hpp"
#include "surface3d/fem/projection.hpp"

namespace tubule::surface3d {
namespace {

// Normal, B, H and K of a point as one column, and nodal columns as fields.
using Column11 = Eigen::Matrix<double, 11, 1>;
using Columns11 = Eigen::Matrix<double, 11, Eigen::Dynamic>;

Column11 column_of(const SurfacePoint<double>& p) {
    Column11 out;
    out.head<3>() = p.normal;
    out.segment<6>(3) = packed_tensor(p.B);
    out[9] = p.H, out[10] = p.K;
    return out;
}

CurvatureField field_of(const Columns11& values) {
    return {values.topRows<3>().colwise().normalized(), values.middleRows<6>(3), values.row(9).transpose(),
            values.row(10).transpose()};
}

}  // namespace

PatchRecovery::PatchRecovery(const CurvedMesh& mesh)
    : degree_(2 * mesh.order),
      corner_table_(mesh.order, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}),
      patch_of_(mesh.size(), -1),
      shares_(mesh.size()) {
    const int width = mesh.nodes_per_cell();
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int c = 0; c < 3; ++c) {
            int& patch = patch_of_[mesh.node(cell, c)];
            if (patch < 0) {
                patch = static_cast<int>(patches_.size());
                patches_.push_back({mesh.node(cell, c), {}, {}});
            }
            patches_[patch].corners.push_back({cell, c});
        }

    // Nodes of the triangles around, then of those around their corners, until there are more than coefficients.
    SharedPause pause;
    for (Patch& patch : patches_) {
        if (pause.look(&patch - patches_.data())) break;
        std::set<std::array<int, 2>> cells, members;  // (cell, shift), (node, shift)
        std::vector<std::array<int, 2>> front{{patch.vertex, 0}};
        while (static_cast<int>(members.size()) <= graph_coefficients(degree_) && !front.empty()) {
            std::vector<std::array<int, 2>> next;
            for (const auto& [vertex, vertex_shift] : front)
                for (const auto& [cell, c] : patches_[patch_of_[vertex]].corners) {
                    const int cell_shift = vertex_shift - shift(mesh, cell, c);
                    if (!cells.insert({cell, cell_shift}).second) continue;
                    for (int a = 0; a < width; ++a) {
                        const std::array<int, 2> member{mesh.node(cell, a), cell_shift + shift(mesh, cell, a)};
                        if (members.insert(member).second && a < 3) next.push_back(member);
                    }
                }
            front = next;
        }
        for (const auto& [node, by] : members) patch.members.push_back({node, by});
        most_members_ = std::max(most_members_, static_cast<int>(patch.members.size()));
    }

    pause.check();
    const auto nodes = lattice(mesh.order);
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int a = 0; a < width; ++a) {
            auto& shares = shares_[mesh.node(cell, a)];
            if (!shares.empty()) continue;
            for (int c = 0; c < 3; ++c)
                if (nodes[a][c] > 0)
                    shares.push_back({patch_of_[mesh.node(cell, c)], shift(mesh, cell, a) - shift(mesh, cell, c),
                                      static_cast<double>(nodes[a][c]) / mesh.order});
        }
}

std::vector<PolynomialGraph> PatchRecovery::fit(const CurvedMesh& mesh) const {
    std::vector<PolynomialGraph> graphs(patches_.size());
    SharedPause pause;
    struct Own {  // of a thread
        GraphFit fit;
        Eigen::Matrix3Xd points;
    };
    std::vector<std::optional<Own>> all(loop_threads());
    parallel_for(patches_.size(), [&](std::size_t i, int thread) {
        if (pause.look(i)) return;
        if (!all[thread]) all[thread].emplace(Own{{degree_, most_members_}, Eigen::Matrix3Xd(3, most_members_)});
        auto& [fit, points] = *all[thread];
        const Patch& patch = patches_[i];
        Eigen::Vector3d normal = Eigen::Vector3d::Zero();
        for (const auto& [cell, c] : patch.corners)
            normal += tangent_point(cell_nodes(mesh, cell), corner_table_, c).normal;
        const int n = static_cast<int>(patch.members.size());
        for (int r = 0; r < n; ++r) {
            const auto& [node, by] = patch.members[r];
            points.col(r) = mesh.nodes[node] + by * mesh.period * Eigen::Vector3d::UnitZ();
        }
        graphs[i] = fit(mesh.nodes[patch.vertex], normal.normalized(), points.leftCols(n));
    });
    pause.check();
    return graphs;
}

Eigen::Vector3d PatchRecovery::position(const std::vector<PolynomialGraph>& graphs, const CurvedMesh& mesh, int cell,
                                        const Eigen::Vector2d& at, const Eigen::Vector3d& x) const {
    const double weight[3] = {1 - at[0] - at[1], at[0], at[1]};
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (int c = 0; c < 3; ++c) {
        const Eigen::Vector3d up = shift(mesh, cell, c) * mesh.period * Eigen::Vector3d::UnitZ();
        mean += weight[c] * (graphs[patch_of_[mesh.node(cell, c)]].at(x - up).x + up);
    }
    return mean;
}

CurvatureField PatchRecovery::nodal(const CurvedMesh& mesh) const {
    const std::vector<PolynomialGraph> graphs = fit(mesh);
    Columns11 values(11, mesh.size());
    parallel_for(mesh.nodes.size(), [&](std::size_t node) {
        Column11 mean = Column11::Zero();
        for (const auto& [patch, by, weight] : shares_[node]) {
            const Eigen::Vector3d x = mesh.nodes[node] + by * mesh.period * Eigen::Vector3d::UnitZ();
            mean += weight * column_of(graphs[patch].at(x));
        }
        values.col(node) = mean;
    });
    return field_of(values);
}

CurvatureField PatchRecovery::projected(const SurfaceSpace& space, const CurvedMesh& mesh) const {
    return projected(space, mesh, Projection(space, mesh));
}

CurvatureField PatchRecovery::projected(const SurfaceSpace& space, const CurvedMesh& mesh,
                                        const Projection& project) const {
    const std::vector<PolynomialGraph> graphs = fit(mesh);
    const Tabulation& table = space.tabulation();
    return field_of(project(load<11>(space, mesh, [&](int cell, const CellColumns<3>& X, int q, CellColumns<11>& out) {
        const SurfacePoint<double> p = tangent_point(X, table, q);
        const Eigen::Vector2d at = table.point.col(q);
        const double weight[3] = {1 - at[0] - at[1], at[0], at[1]};
        Column11 mean = Column11::Zero();
        for (int c = 0; c < 3; ++c) {
            const Eigen::Vector3d x = p.x - shift(mesh, cell, c) * mesh.period * Eigen::Vector3d::UnitZ();
            mean += weight[c] * column_of(graphs[patch_of_[mesh.node(cell, c)]].at(x));
        }
        out.noalias() += (table.weight[q] * p.area * mean) * table.value.col(q).transpose();
    })));
}

}  // namespace tubule::surface3d
