// Base triangulations of surfaces around the z axis with elements of wanted sizes: small where curvature varies within
// a short distance, as at a neck or where a cap meets a cylinder.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "common/geometry/surface_point.hpp"
#include "common/shapes/base_surface.hpp"
#include "surface3d/mesh/base_meshes.hpp"

namespace tubule::surface3d {

// The data that determine sizes, at evenly spaced parameters 0 ... 1: lengths on the surface for a step of the
// parameter and around the axis, and in column i of `defect` the errors of the shape operator, root mean square, that
// elements of edge spans[i] would make: of its best approximation (along or around, whichever is more) and of
// PatchRecovery, together.
struct Resolution {
    std::vector<double> speed, around, spans;
    Eigen::MatrixXd defect;
};

// The surface, as a function of a point of the profile's surface and two directions there (point_of_map).
using ExactPoint =
    std::function<SurfacePoint<double>(const Eigen::Vector3d& p, const Eigen::Vector3d& e1, const Eigen::Vector3d& e2)>;

// For elements of this order, the worst of 8 meridians. `point` is called by several threads at once.
Resolution measure_resolution(const ExactPoint& point, const Curve& profile, int order);

// Measures the surface map(profile); `map` as for mapped_mesh.
template <class Map>
Resolution resolution_of(const Map& map, const Curve& profile, int order) {
    return measure_resolution(
        [&](const auto& p, const auto& e1, const auto& e2) { return point_of_map<double>(map, p, e1, e2); }, profile,
        order);
}

// About this many triangles, of equal size, or each with about the same part of the square of the defect. Neighbouring
// sizes differ by no more than a third of a size per size.
TriangleMesh uniform_rings(const Resolution& resolution, const Curve& profile, int triangles);
TriangleMesh graded_rings(const Resolution& resolution, const Curve& profile, int triangles);

}  // namespace tubule::surface3d
