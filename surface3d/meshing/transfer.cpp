#include "surface3d/meshing/transfer.hpp"

#include <fmt/format.h>

#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse.hpp"
#include "surface3d/fem/surface_space.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/meshing/remesh_sizes.hpp"

namespace tubule::surface3d {
namespace {

constexpr double near = 0.25;  // of the width of a triangle: two meshes of one surface are nearer to each other

// One cell that has each node, and the node's number in it.
struct CellNode {
    int cell = 0, a = 0;
};
std::vector<CellNode> cells_of_nodes(const CurvedMesh& mesh) {
    std::vector<CellNode> out(mesh.size());
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int a = 0; a < mesh.nodes_per_cell(); ++a) out[mesh.node(cell, a)] = {cell, a};
    return out;
}

}  // namespace

std::vector<MeshPoint> places_of_nodes(const CurvedMesh& nodes, const CurvedMesh& on) {
    const ClosestPoint closest(on);
    const std::vector<CellNode> seen = cells_of_nodes(nodes);
    const Tabulation table = at_nodes(nodes.order, nodes.order);
    std::vector<MeshPoint> out(nodes.size());
    SharedPause pause;
    parallel_for(out.size(), [&](std::size_t i) {
        if (pause.look(i)) return;
        const auto [cell, a] = seen[i];
        const CellColumns<3> X = cell_nodes(nodes, cell);
        const SurfacePoint<double> p = tangent_point(X, table, a);
        out[i] = closest(nodes.nodes[i], p.normal);
        if (!(out[i].distance < near * triangle_width(p))) out[i].cell = -1;
    });
    pause.check();
    for (std::size_t i = 0; i < out.size(); ++i)
        if (out[i].cell < 0)
            throw SolveError(fmt::format("a node at {} has no place on a mesh of {} triangles",
                                         words_of_place(nodes.nodes[i]), on.triangles()));
    return out;
}

Eigen::MatrixXd values_at(const std::vector<MeshPoint>& places, const CurvedMesh& mesh, const Eigen::MatrixXd& nodal) {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(nodal.rows(), static_cast<Eigen::Index>(places.size()));
    for (std::size_t i = 0; i < places.size(); ++i) {
        const Eigen::VectorXd phi = functions_at(mesh.order, places[i].at);
        for (int a = 0; a < mesh.nodes_per_cell(); ++a) out.col(i) += phi[a] * nodal.col(mesh.node(places[i].cell, a));
    }
    return out;
}

CurvedMesh moved_to(const std::vector<MeshPoint>& places, const CurvedMesh& mesh, CurvedMesh to) {
    to.period = mesh.period;
    for (std::size_t i = 0; i < places.size(); ++i) {
        const Eigen::VectorXd phi = functions_at(mesh.order, places[i].at);
        to.nodes[i] = places[i].periods * mesh.period * Eigen::Vector3d::UnitZ();
        for (int a = 0; a < mesh.nodes_per_cell(); ++a) to.nodes[i] += phi[a] * mesh.position(places[i].cell, a);
    }
    return to;
}

}  // namespace tubule::surface3d
