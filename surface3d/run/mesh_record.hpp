// Curved meshes and data of their nodes as records of the result file.
#pragma once

#include <string>

#include "common/result/result.hpp"
#include "surface3d/mesh/curved_mesh.hpp"

namespace tubule::surface3d {

SurfaceCells cells_of(const CurvedMesh& mesh);
CurvedMesh curved_mesh(const SurfaceCells& cells, const Array& points);

// One column a node.
template <class Columns>
Array array(const std::string& name, const Columns& nodal) {
    Array out{name, {static_cast<std::size_t>(nodal.cols())}, {nodal.data(), nodal.data() + nodal.size()}};
    if (nodal.rows() > 1) out.shape.push_back(nodal.rows());
    return out;
}

}  // namespace tubule::surface3d
