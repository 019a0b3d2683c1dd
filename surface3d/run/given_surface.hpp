// Surfaces that a case brings as triangles, made larger and disturbed as it says.
#pragma once

#include "common/shapes/disturbed_shape.hpp"
#include "surface3d/mesh/curved_mesh.hpp"

namespace tubule::surface3d {

double area_of(const CurvedMesh& mesh);

CurvedMesh scaled(CurvedMesh mesh, double factor);

// Each node moved along the normal: of a sphere by the height in its direction from the centroid of the surface, of a
// tube by that at its height and angle.
CurvedMesh displaced(CurvedMesh mesh, const DisturbedShape& modes);

}  // namespace tubule::surface3d
