// Signs that a mesh is not a valid surface, or that its curvatures are inconsistent with it.
#pragma once

#include <optional>

#include "common/solve/stop.hpp"
#include "surface3d/curvature/bending_force.hpp"
#include "surface3d/fem/mesh_quality.hpp"

namespace tubule::surface3d {

// A cell that folds (mesh_quality).
std::optional<StopReport> find_fold(const MeshQuality& quality);

// Closed surfaces have INT H^2 >= 16 pi (Willmore), and INT K is 2 pi times the Euler characteristic (Gauss-Bonnet):
// a report where one of them is missed by more than `allowed` of 16 pi, or of 4 pi and that multiple of 2 pi.
std::optional<StopReport> find_impossible_curvature(const Observables& o, const CurvedMesh& mesh,
                                                    double allowed = 0.01);

// Triangles that meet where they should not, those of the next periods of a tube included; the curved ones are taken as
// the flat ones between their nodes.
std::optional<StopReport> find_self_intersection(const CurvedMesh& mesh);

}  // namespace tubule::surface3d
