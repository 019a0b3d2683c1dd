#include "surface3d/run/mesh_record.hpp"

#include <stdexcept>

namespace tubule::surface3d {

SurfaceCells cells_of(const CurvedMesh& mesh) {
    return {mesh.order, mesh.nodes.size(), mesh.cells, mesh.period, mesh.shifts};
}

CurvedMesh frame_surface(const Record& frame, const SurfaceCells& cells) {
    const Array* points = find_array(frame, "points");
    if (!points || points->data.size() < 3 * cells.nodes)
        throw std::invalid_argument("the frame has no points on its mesh");
    CurvedMesh mesh{cells.order, {}, cells.cells, cells.period, cells.shifts};
    for (std::size_t i = 0; i < cells.nodes; ++i)
        mesh.nodes.emplace_back(Eigen::Map<const Eigen::Vector3d>(&points->data[3 * i]));
    return mesh;
}

}  // namespace tubule::surface3d
