// The gradient energy INT |grad H|^2 dS of a profile, theory.md (2.25), with its first and second derivatives in the
// coefficients; CurveForms and Forms add them, times kg. The curvature must be continuous: splines of smoothness 2 at
// least.
#pragma once

#include <Eigen/Core>
#include <type_traits>
#include <vector>

#include "axisym/splines/curve_space.hpp"
#include "axisym/splines/third_derivatives.hpp"

namespace tubule::axisym {

// For curves with the fields r and z of a CurveSpace, or graphs r(z) of a SplineSpace.
template <class Space>
class GradientForms {
public:
    // Keeps the space, which must outlive it. Throws std::invalid_argument where its smoothness is 1.
    explicit GradientForms(const Space& space);

    // Integrates over the whole cell or period. `stiffness`, if given, receives for each element 2 INT dS/g^6, of a
    // graph 2 INT dS/g^8: half of it times the square of an error of the third normal derivative, of a graph of r''',
    // is the energy that this error costs.
    double value(const double* x, std::vector<double>* stiffness = nullptr) const;
    // The gradient, added to space.size() numbers.
    void add_gradient(double weight, const double* x, double* out) const;
    // The Hessian but for a free rise, added to the values of a matrix; `slots` are the places of each element's local
    // matrix, as in CurveForms and Forms.
    void add_hessian(double weight, const double* x, const std::vector<int>& slots, double* values) const;
    // The second derivatives with one in the rise: add(number of the other coefficient, value).
    template <class Add>
    void each_by_rise(double weight, const double* x, const Add& add) const {
        const Eigen::VectorXd row = by_rise(weight, x);
        for (Eigen::Index i = 0; i < row.size(); ++i) add(static_cast<int>(i), row[i]);
    }
    // The derivative along the displacement z e_z, as CurveForms::stretch_slope().
    double stretch_slope(const double* x) const;

private:
    static constexpr bool is_curve = std::is_same_v<Space, CurveSpace>;
    static constexpr int fields = is_curve ? 2 : 1, variables = is_curve ? 7 : 4;
    using Third = ThirdDerivatives::Group;
    struct Local;
    Eigen::VectorXd by_rise(double weight, const double* x) const requires(is_curve);
    template <class Visit>
    void each_group(const double* x, const Visit& visit) const;

    const Space& space_;
    int images_;
    ThirdDerivatives third_;
};

extern template class GradientForms<CurveSpace>;
extern template class GradientForms<SplineSpace>;

}  // namespace tubule::axisym
