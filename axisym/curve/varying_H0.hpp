// A spontaneous curvature that varies along a profile, at its quadrature points: fixed to the parameter, or given by
// the area below a point.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "axisym/splines/curve_space.hpp"
#include "axisym/splines/pack.hpp"
#include "common/energy/bending.hpp"

namespace tubule::axisym {

// A pack for each group of points of each element, in their order.
struct VaryingH0 {
    std::vector<Pack> value;
    std::vector<Pack> slope;    // dH0/ds, where H0 is fixed to the parameter
    std::vector<Pack> tension;  // else what a change of area costs beside f, theory.md (4.16)

    bool empty() const { return value.empty(); }
};

// M(i, j): the integral over [0, x_i] of what interpolates weight_j times a value at the Gauss points x_j of [0, 1].
Eigen::MatrixXd partial_sums(int points);

// H0 at the parameters, as the formula has it on the curve x. Throws std::invalid_argument where that is no number.
VaryingH0 fix_H0(const CurveSpace& space, const Formula& formula, const Eigen::VectorXd& x);

// The functional INT f(H, K; H0(alpha)) dS, where alpha is the part of the whole area that is below a point: the
// formula's `area`.
class H0ByArea {
public:
    H0ByArea(const CurveSpace& space, const Bending& bending, const double* x);
    const VaryingH0& at_points() const { return H0_; }
    // What the second variation has beyond that of f(H, K; H0) + tension at fixed H0 and tension.
    Eigen::MatrixXd hessian_beyond() const;

private:
    const CurveSpace& space_;
    const Bending& bending_;
    const double* x_;
    VaryingH0 H0_;
    double area_ = 0;                                // of what is solved for
    std::vector<double> weight_, label_, in_, in2_;  // of each point: its area, alpha, dH0/dalpha, d2H0/dalpha2
    std::vector<SlopeInH0<Pack>> f0_;
};

// The formula's `area` at these parameters, ascending, of any curve.
std::vector<double> area_below(const CurveSpace& space, const Eigen::VectorXd& x, const std::vector<double>& s);

}  // namespace tubule::axisym
