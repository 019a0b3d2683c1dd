// The profile that an axisymmetric frame holds.
#pragma once

#include <optional>
#include <vector>

#include "common/result/record.hpp"
#include "common/shapes/perturbed_curve.hpp"

namespace tubule {

// Points in order along the profile, from pole to pole, over a period of this length, or once around (length 0).
struct ProfilePoints {
    std::vector<double> r, z;
    double length = 0;
};

// Both throw std::invalid_argument, worded to follow the name of the frame or its file, for a frame that holds no
// profile or a damaged one.
ProfilePoints profile_points(const Record& frame);
// The spline of a graph; of other kinds the curve through the points.
PerturbedCurve frame_curve(const Record& frame);
// The velocity on that curve, where the frame has one.
std::optional<CurveVelocity> frame_velocity(const Record& frame, const PerturbedCurve& curve);

}  // namespace tubule
