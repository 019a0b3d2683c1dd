// The gradient energy INT |grad H|^2 dS of a graph, theory.md (2.25), with its first and second derivatives in the
// coefficients; Forms adds them, times kg. GradientForms is the same for curves.
#pragma once

#include <vector>

#include "axisym/splines/third_derivatives.hpp"

namespace tubule::axisym {

class GraphGradients {
public:
    // Keeps the space, which must outlive it. Throws std::invalid_argument where its smoothness is 1.
    explicit GraphGradients(const SplineSpace& space) : space_(space), images_(space.cell().images()), third_(space) {}

    // Over the whole period.
    double value(const double* x) const;
    // Returns `weight` 2 INT dS/g^8 for each element: half of it times the square of an error of r''' is the energy
    // that this error costs (its normal part is 1/g of it).
    std::vector<double> stiffness(double weight, const double* x) const;
    // The gradient, added to space.size() numbers.
    void add_gradient(double weight, const double* x, double* out) const;
    // The Hessian, added to the values of a matrix; `slots` are the places of each element's local matrix, as in Forms.
    void add_hessian(double weight, const double* x, const std::vector<int>& slots, double* values) const;
    // The derivative along a stretch of z, which keeps r.
    double stretch_slope(const double* x) const;

private:
    template <class Visit>
    void each_group(const double* x, const Visit& visit) const;

    const SplineSpace& space_;
    double images_;
    ThirdDerivatives third_;
};

}  // namespace tubule::axisym
