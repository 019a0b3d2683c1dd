#include "common/solve/derivative_check.hpp"

#include <fmt/core.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

namespace tubule {
namespace {

using Vector = Eigen::VectorXd;
using Along = std::function<Vector(double)>;  // h -> q(x + h v)

constexpr int steps_per_decade = 4;
constexpr int decades = 7;              // from 1e-1 down to 1e-8
constexpr double clear_of_noise = 100;  // a remainder counts when it is this much above the noise
constexpr std::size_t least_samples = 3;
constexpr double least_slope = 1.9;

// Size of the rounding errors in q near h = 0, whatever q's derivatives: fourth differences at steps so small that
// q is a straight line up to rounding. Their coefficients amplify independent errors by sqrt(1+16+36+16+1).
double noise(const Along& q) {
    double largest = std::numeric_limits<double>::epsilon() * q(0).norm();
    for (double t : {1e-9, 1.7e-9, 2.9e-9, 5.3e-9}) {
        const double difference = (q(-2 * t) - 4 * q(-t) + 6 * q(0) - 4 * q(t) + q(2 * t)).norm() / std::sqrt(70.0);
        if (std::isfinite(difference)) largest = std::max(largest, difference);
    }
    return largest;
}

struct Sample {
    double h, remainder;
};

double fitted_slope(const Sample* first, int n) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (const Sample* s = first; s != first + n; ++s) {
        const double x = std::log(s->h), y = std::log(s->remainder);
        sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

TaylorSlope slope_of(const Along& q, const Vector& derivative) {
    const Vector q0 = q(0);
    const double noise0 = noise(q);
    std::vector<Sample> clear;  // from small steps to large ones
    std::size_t admissible = 0;
    for (int i = decades * steps_per_decade; i >= 0; --i) {
        const double h = std::pow(10.0, -1 - double(i) / steps_per_decade);
        const double remainder = (q(h) - q0 - h * derivative).norm();
        if (!std::isfinite(remainder)) continue;
        ++admissible;
        const double rounding = std::max(noise0, std::numeric_limits<double>::epsilon() * h * derivative.norm());
        if (remainder > clear_of_noise * rounding) clear.push_back({h, remainder});
    }
    TaylorSlope result;
    // That close to the noise there is nothing to read a slope from, nor room for a wrong derivative.
    if (clear.size() < least_samples) {
        result.slope = std::numeric_limits<double>::quiet_NaN();
        result.pass = admissible >= least_samples;
        return result;
    }
    const int n = std::min<int>(steps_per_decade + 1, static_cast<int>(clear.size()));
    result.slope = fitted_slope(clear.data(), n);
    result.h_small = clear[0].h;
    result.h_large = clear[n - 1].h;
    result.defect = clear[0].remainder / (clear[0].h * derivative.norm());
    result.pass = result.slope > least_slope;
    return result;
}

bool worse(const TaylorSlope& a, const TaylorSlope& b) {
    const auto key = [](const TaylorSlope& t) {
        if (!std::isnan(t.slope)) return t.slope;
        return t.pass ? std::numeric_limits<double>::infinity() : -std::numeric_limits<double>::infinity();
    };
    return key(a) < key(b);
}

// Normally distributed, with the length of x (or 1, when x = 0).
Vector random_direction(const Vector& x, std::mt19937& engine) {
    std::normal_distribution<double> normal;
    Vector v(x.size());
    for (double& component : v) component = normal(engine);
    const double length = x.norm() > 0 ? x.norm() : 1;
    return v * (length / v.norm());
}

std::string line(const char* what, const TaylorSlope& t) {
    if (std::isnan(t.slope))
        return fmt::format(
            "{}: {}\n", what,
            t.pass ? "correct, linear up to rounding" : "NOT CHECKED, the state admits no large enough step");
    return fmt::format("{}: {}, Taylor slope {:.2f} for steps {:.1e} to {:.1e}, remainder {:.1e} of the change\n", what,
                       t.pass ? "right" : "WRONG", t.slope, t.h_small, t.h_large, t.defect);
}

}  // namespace

std::string DerivativeCheck::text() const {
    return line("gradient", gradient) + line("Hessian ", hessian);
}

DerivativeCheck check_derivatives(const std::function<double(const Vector&)>& value,
                                  const std::function<Vector(const Vector&)>& gradient,
                                  const std::function<Vector(const Vector&, const Vector&)>& hessian_times,
                                  const Vector& x, int directions) {
    if (x.size() == 0) throw std::invalid_argument("the derivative check needs a state of size 1 or more");
    const Vector g = gradient(x);
    if (g.size() != x.size())
        throw std::invalid_argument(fmt::format("gradient of size {} for a state of size {}", g.size(), x.size()));
    if (!std::isfinite(value(x)) || !g.allFinite())
        throw std::invalid_argument("the derivative check needs a state with a finite value and gradient");

    DerivativeCheck check;
    std::mt19937 engine(1);
    for (int i = 0; i < directions; ++i) {
        const Vector v = random_direction(x, engine);
        const Vector Hv = hessian_times(x, v);
        if (Hv.size() != x.size() || !Hv.allFinite())
            throw std::invalid_argument("the Hessian in the derivative check does not fit the state or is not finite");
        const Along value_along = [&](double h) { return Vector::Constant(1, value(x + h * v)); };
        const Along gradient_along = [&](double h) { return gradient(x + h * v); };
        const TaylorSlope first = slope_of(value_along, Vector::Constant(1, g.dot(v)));
        const TaylorSlope second = slope_of(gradient_along, Hv);
        if (i == 0 || worse(first, check.gradient)) check.gradient = first;
        if (i == 0 || worse(second, check.hessian)) check.hessian = second;
    }
    return check;
}

}  // namespace tubule
