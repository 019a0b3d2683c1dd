#include "surface3d/run/mesh_record.hpp"

namespace tubule::surface3d {

SurfaceCells cells_of(const CurvedMesh& mesh) {
    return {mesh.order, mesh.nodes.size(), mesh.cells, mesh.period, mesh.shifts};
}

CurvedMesh curved_mesh(const SurfaceCells& cells, const Array& points) {
    CurvedMesh mesh{cells.order, {}, cells.cells, cells.period, cells.shifts};
    for (std::size_t i = 0; i < cells.nodes; ++i)
        mesh.nodes.emplace_back(points.data[3 * i], points.data[3 * i + 1], points.data[3 * i + 2]);
    return mesh;
}

}  // namespace tubule::surface3d
