// Taylor slopes: check that a gradient and a Hessian are the derivatives of a value.
// Serves the tests, `tubule run --check-derivatives` and the report of a failed run.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>

namespace tubule {

// One quantity's remainder |q(x + h v) - q(x) - h dq(x) v| falls like h^slope: 2 (or more) for a correct derivative,
// 1 for a wrong one. Steps h go from 1e-1 down to 1e-8 in units of the size of x; the slope is read from the decade
// nearest to zero in which the remainder still stands clear of rounding noise, as there a wrong derivative shows most.
struct TaylorSlope {
    double slope = 0;  // NaN: q is linear up to rounding (pass), or x admits no large enough step (no pass)
    double h_small = 0, h_large = 0;  // range it was read from
    double defect = 0;                // remainder / |h dq v| at h_small: at most this wrong, relatively
    bool pass = false;
};

struct DerivativeCheck {
    TaylorSlope gradient, hessian;  // each the worst of all directions
    bool pass() const { return gradient.pass && hessian.pass; }
    std::string text() const;  // one line for each: verdict, slope, range, defect
};

// value(x), gradient(x) and hessian_times(x, v) may return what is not finite where x is inadmissible: such steps are
// left out. Directions are random, the same at every call. Throws std::invalid_argument when x is empty or the three do
// not fit it, or when they are not finite at x itself.
DerivativeCheck check_derivatives(
    const std::function<double(const Eigen::VectorXd&)>& value,
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& gradient,
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&, const Eigen::VectorXd&)>& hessian_times,
    const Eigen::VectorXd& x, int directions = 3);

}  // namespace tubule
