// Distances between two curved surfaces.
#pragma once

#include <Eigen/Core>

#include "tools/compare/surfaces.hpp"

namespace tubule::compare {

// x -> rotation x + shift.
struct RigidMotion {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();

    Eigen::Vector3d operator()(const Eigen::Vector3d& x) const { return rotation * x + shift; }
    RigidMotion inverse() const { return {rotation.transpose(), -(rotation.transpose() * shift)}; }
};

// Distances of the points of each surface from the other surface, in both directions.
struct Distance {
    double hausdorff = 0;                             // the largest distance of such a point
    double l2 = 0;                                    // root of the mean of both mean squares
    Eigen::Vector3d where = Eigen::Vector3d::Zero();  // the point that is farthest from the other surface
    double size = 0;                                  // radius of the sphere, or the tube, that has the area of `a`
};

// Between `a` and `b` after `motion`. Nearest points are exact to rounding. The mean squares are by quadrature on every
// element; the largest distance is over its points and nodes; in the 32 farthest triangles a larger one is
// searched for in between. Throws std::invalid_argument if one is closed and the other one a tube, or their periods
// differ.
Distance distance(const Surface& a, const Surface& b, const RigidMotion& motion = {});

}  // namespace tubule::compare
