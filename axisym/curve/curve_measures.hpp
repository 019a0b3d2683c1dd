// Measures of a profile curve, and whether it intersects itself.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "axisym/splines/arc_length.hpp"

namespace tubule::axisym {

struct ShapeMeasures {
    double height = 0;          // from pole to pole or from end to end of a patch along the axis, or the period
    double r_middle = 0;        // radius at s = 1/2 of the whole curve: the equator, if symmetric
    double r_max = 0;           // refined between quadrature points
    double pole_curvature = 0;  // kappa at the south pole, of a cap at its pole, negative where convex; else 0
    double asymmetry = 0;       // largest |r(s) - r(1 - s)|, |z(s) + z(1 - s) - 2 z(1/2)| sampled; 0 for halves
};
// Measures the whole curve x, in units of the case.
ShapeMeasures measures(const CurveSpace& space, const Eigen::VectorXd& x);

// Parameters of two points at which the profile crosses itself, or of one (twice) where it is beyond the axis
// or, a half, beyond its plane of symmetry; to the resolution of 8 chords
// per element.
std::optional<std::array<double, 2>> self_intersection(const CurveSpace& space, const Eigen::VectorXd& x);

// The Hausdorff distance of two surfaces of revolution with a common axis: that of their profiles. To about 1e-9 of
// their size for curves that are smooth between seams.
double hausdorff_distance(const Curve& a, const Curve& b);

}  // namespace tubule::axisym
