// The gradient term INT |grad H|^2 dS under displacements w(s) cos(m theta) of a profile along a field n: first and
// second variation at each quadrature point, as forms in w, w_s, w_ss and w_sss.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "axisym/splines/pack.hpp"

namespace tubule::axisym {

class GradientModes {
public:
    // Each argument: value and first to third derivative in s of the profile and of n at a group of points.
    using Derivatives = std::array<Pack, 4>;
    void add_group(const Derivatives& r, const Derivatives& z, const Derivatives& n_r, const Derivatives& n_z);

    // The variations at the point with this number, in the order of the groups, per ds and dtheta. The first is that of
    // m = 0; the second is averaged over theta like cos^2(m theta).
    const std::array<double, 4>& first_variation(std::size_t point) const { return points_[point].first; }
    Eigen::Matrix4d second_variation(std::size_t point, int m) const;

private:
    static constexpr int variables = 10;  // w and its derivatives in s and theta up to the third
    struct Point {
        std::array<double, 4> first;
        std::array<double, variables*(variables + 1) / 2> Q;  // packed
    };
    std::vector<Point> points_;
};

}  // namespace tubule::axisym
