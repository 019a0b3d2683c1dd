// The gradient term of a graph, G = INT |grad H|^2 dS, theory.md (2.25), and its derivatives in the coefficients, to be
// added to those of Forms: GradientForms for the curve z = s.
#pragma once

#include <vector>

#include "axisym/splines/spline_space.hpp"

namespace tubule::axisym {

class GraphGradients {
public:
    // Keeps the space, which must outlive it. Throws std::invalid_argument where its smoothness is 1.
    explicit GraphGradients(const SplineSpace& space);

    // Over the whole period. `stiffness`, if given, receives for each element 2 INT dS/g^8 times `weight`: what an
    // error of r''' costs, as its part along the normal is 1/g of it.
    double value(const double* x) const;
    std::vector<double> stiffness(double weight, const double* x) const;
    // The gradient, added to space.size() numbers.
    void add_gradient(double weight, const double* x, double* out) const;
    // The Hessian, added to the values of a matrix; `slots` are the places of each element's local matrix, as in Forms.
    void add_hessian(double weight, const double* x, const std::vector<int>& slots, double* values) const;
    // The derivative along a stretch of z, which keeps r.
    double stretch_slope(const double* x) const;

private:
    struct Third {  // third derivatives of the active splines at a group of points, as in SplineSpace::Basis
        alignas(32) double by_point[SplineSpace::max_width][SplineSpace::lanes];
        alignas(32) double by_spline[SplineSpace::lanes][SplineSpace::max_width];
    };
    template <class Visit>
    void each_group(const double* x, const Visit& visit) const;

    const SplineSpace& space_;
    double images_;
    std::vector<Third> third_;
};

}  // namespace tubule::axisym
