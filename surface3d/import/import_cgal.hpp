// What CGAL does for meshes from files. The only header of a file that includes it; without CGAL the build takes
// import_without_cgal.cpp instead, whose functions throw std::logic_error.
#pragma once

#include <cstddef>

#include "surface3d/mesh/triangle_mesh.hpp"

namespace tubule::surface3d::cgal {

// Whether this build has CGAL; the other functions need it.
bool available();

// Triangles of nearly equal edges of this length instead of those of a manifold, oriented mesh, with vertices on its
// triangles. Features smaller than the edges are lost, creases are cut off. Polygon_mesh_processing's
// isotropic_remeshing, after triangles without area have been removed.
TriangleMesh isotropic(const TriangleMesh& mesh, double edge);

struct FilledHoles {
    TriangleMesh mesh;
    std::size_t holes = 0;
    double longest = 0;           // boundary of a hole
    Eigen::Vector3d at{0, 0, 0};  // a point of that boundary
    std::size_t left = 0;         // holes that could not be filled
};
// Closes every boundary of a manifold, oriented mesh with triangles as small as those around it, joined smoothly.
FilledHoles fill_holes(const TriangleMesh& mesh);

// A closed manifold around all triangles, whatever they are, at the distance `offset`: where a ball of radius `alpha`
// fits in from outside, it follows them (Portaneri et al., "Alpha wrapping with an offset", 2022).
TriangleMesh wrap(const TriangleMesh& mesh, double alpha, double offset);

}  // namespace tubule::surface3d::cgal
