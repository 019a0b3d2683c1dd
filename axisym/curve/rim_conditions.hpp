// The rings that a patch ends in, as linear conditions on the coefficients of its curve: r and z of the end, and where
// it is clamped the derivative across its tangent.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "axisym/splines/curve_space.hpp"
#include "common/equilibrium/stationary_problem.hpp"

namespace tubule::axisym {

// Where a curve begins and ends; clamped, with its tangents there. None unless it is that of a patch.
std::vector<Ring> rings_of(const Curve& curve, Rim rim);
std::vector<Ring> rings_of(const CurveSpace& space, const Eigen::VectorXd& x, Rim rim);

// A column for each condition, with as many rows as the space has coefficients: those of the first ring, then those of
// the second. The curve x meets them where the products with x are the values.
Eigen::MatrixXd rim_functionals(const CurveSpace& space, const std::vector<Ring>& rings);
Eigen::VectorXd rim_values(const std::vector<Ring>& rings);
// The index of the condition for the height of the last ring.
int condition_of_height(const std::vector<Ring>& rings);

// The parameter of the curve at this ring.
inline double rim_parameter(std::size_t ring) {
    return ring == 0 ? 0 : 1;
}

}  // namespace tubule::axisym
