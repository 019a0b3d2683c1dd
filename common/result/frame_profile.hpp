// The profile that an axisymmetric frame holds.
#pragma once

#include <variant>
#include <vector>

#include "common/result/record.hpp"
#include "common/shapes/revolution.hpp"

namespace tubule {

// Points in order along the profile, from pole to pole, over a period of this length, or once around (length 0).
struct ProfilePoints {
    std::vector<double> r, z;
    double length = 0;
};

// All of these throw std::invalid_argument, worded to follow the name of the frame or its file, for a frame that holds
// no profile or a damaged one.
ProfilePoints profile_points(const Record& frame);
// The spline of a graph; of other kinds the points.
std::variant<Revolution, ProfilePoints> profile_of(const Record& frame);
ProfilePoints points_of(const Revolution& graph);

}  // namespace tubule
