#include "axisym/curve/bead_forms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "axisym/curve/curve_start.hpp"
#include "axisym/curve/potential_forms.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

constexpr std::array<std::string_view, 3> variables{"r", "z", "P"};
constexpr int of_P = 0, of_q = 1;  // in the numbers of each bead

}  // namespace

// The density of G is g zeta/(2 pi w^2 exp(-1/2)), with zeta = z - P outward and a Gaussian weight g whose centre is w
// beyond the bead: on a flat membrane G = -(P - z), and dG/dP = -1. Its derivatives by zeta follow from g' = -u g.
BeadForms::BeadForms(const CurveSpace& space, double width) : space_(space), width_(width) {
    for (int bead = 0; bead < 2; ++bead) {
        const std::string zeta = bead == 0 ? "(-z - P)" : "(z - P)",
                          u = fmt::format("(({} - {:.17g})/{:.17g})", zeta, width, width * width),
                          g = fmt::format("{:.17g}*exp(-(r^2 + ({} - {:.17g})^2)/{:.17g})",
                                          std::exp(0.5) / (2 * pi * width * width), zeta, width, 2 * width * width);
        const auto density = [&](const std::string& factor) { return parse_formula(g + "*" + factor, variables); };
        beads_[bead] = {density(zeta), density(fmt::format("({}*{} - 1)", zeta, u)),
                        density(fmt::format("({0}^2*{1} - 2*{0} - {1}/{2:.17g})", u, zeta, width * width))};
    }
}

double BeadForms::integral(const Formula& density, double P, const double* x) const {
    return observe_potential(space_, density, {}, x, P).energy;
}

Eigen::VectorXd BeadForms::slope(const Formula& density, double P, const double* x) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(space_.size());
    add_potential_gradient(space_, density, 1, x, out.data(), P);
    return out;
}

BeadNumbers BeadForms::residual(const BeadLoad& load, const double* x, const BeadNumbers& at) const {
    BeadNumbers F;
    double forces[2];
    for (int k = 0; k < 2; ++k) {
        F[2 * k] = integral(beads_[k].G, at[2 * k + of_P], x);
        forces[k] = at[2 * k + of_q] * integral(beads_[k].by_P, at[2 * k + of_P], x);
    }
    F[1] = load.distance ? distance(at) - *load.distance : forces[0] - load.force;
    F[3] = load.distance ? forces[0] - forces[1] : forces[1] - load.force;
    return F;
}

void BeadForms::add_force(const double* x, const BeadNumbers& at, double* out) const {
    for (int k = 0; k < 2; ++k) add_potential_gradient(space_, beads_[k].G, at[2 * k + of_q], x, out, at[2 * k + of_P]);
}

void BeadForms::add_hessian(const double* x, const BeadNumbers& at, const std::vector<int>& slots,
                            double* values) const {
    for (int k = 0; k < 2; ++k)
        add_potential_hessian(space_, beads_[k].G, at[2 * k + of_q], x, slots, values, at[2 * k + of_P]);
}

BeadForms::Slopes BeadForms::slopes(const BeadLoad& load, const double* x, const BeadNumbers& at) const {
    const int n = space_.size();
    Slopes out{Eigen::MatrixXd::Zero(n, 4), Eigen::MatrixXd::Zero(4, n), Eigen::Matrix4d::Zero()};
    Eigen::MatrixXd force_by_curve(2, n);
    Eigen::Matrix<double, 2, 4> force_by_numbers = Eigen::Matrix<double, 2, 4>::Zero();
    for (int k = 0; k < 2; ++k) {
        const Bead& bead = beads_[k];
        const int P = 2 * k + of_P, q = 2 * k + of_q;
        const Eigen::VectorXd by_x = slope(bead.G, at[P], x), by_x_P = slope(bead.by_P, at[P], x);
        const double by_P = integral(bead.by_P, at[P], x);
        out.force_by_numbers.col(P) = at[q] * by_x_P, out.force_by_numbers.col(q) = by_x;
        out.equations_by_curve.row(2 * k) = by_x;
        out.equations_by_numbers(2 * k, P) = by_P;
        force_by_curve.row(k) = at[q] * by_x_P;
        force_by_numbers(k, P) = at[q] * integral(bead.by_PP, at[P], x), force_by_numbers(k, q) = by_P;
    }
    if (load.distance) {
        out.equations_by_numbers(1, 0) = out.equations_by_numbers(1, 2) = 1;
        out.equations_by_curve.row(3) = force_by_curve.row(0) - force_by_curve.row(1);
        out.equations_by_numbers.row(3) = force_by_numbers.row(0) - force_by_numbers.row(1);
    } else {
        for (int k = 0; k < 2; ++k) {
            out.equations_by_curve.row(2 * k + 1) = force_by_curve.row(k);
            out.equations_by_numbers.row(2 * k + 1) = force_by_numbers.row(k);
        }
    }
    return out;
}

// Newton's method from the poles, in steps of a width at most; the mean of a bead that is far off shows the side.
BeadNumbers BeadForms::numbers(const double* x, double force) const {
    constexpr int most = 60;
    BeadNumbers out;
    const Eigen::VectorXd curve = Eigen::Map<const Eigen::VectorXd>(x, space_.size());
    for (int k = 0; k < 2; ++k) {
        double P = k == 0 ? -space_.evaluate(curve, 0).z : space_.evaluate(curve, 1).z, last = HUGE_VAL;
        bool found = false;
        for (int i = 0; i < most && !found && std::isfinite(P); ++i) {
            const double G = integral(beads_[k].G, P, x), by_P = integral(beads_[k].by_P, P, x);
            const double step = by_P < 0 ? std::clamp(-G / by_P, -width_, width_) : std::copysign(width_ / 2, G);
            found = by_P < 0 && (std::abs(step) < 1e-14 * width_ || (std::abs(step) < 1e-9 * width_ && !(step < last)));
            P += step, last = std::abs(step);
        }
        if (!found) P = std::numeric_limits<double>::quiet_NaN();
        out[2 * k + of_P] = P, out[2 * k + of_q] = force / integral(beads_[k].by_P, P, x);
    }
    return out;
}

double BeadForms::distance(const double* x) const {
    return distance(numbers(x, 0));
}

double BeadForms::force(const double* x, const BeadNumbers& at) const {
    return at[of_q] * integral(beads_[0].by_P, at[of_P], x);
}

Eigen::VectorXd BeadForms::distance_slope(const double* x, const BeadNumbers& at) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(space_.size());
    for (int k = 0; k < 2; ++k) {
        const double P = at[2 * k + of_P];
        out -= slope(beads_[k].G, P, x) / integral(beads_[k].by_P, P, x);
    }
    return out;
}

Eigen::MatrixXd BeadForms::following_hessian(const double* x, const BeadNumbers& at) const {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(space_.size(), space_.size());
    for (int k = 0; k < 2; ++k) {
        const double P = at[2 * k + of_P], q = at[2 * k + of_q];
        const Eigen::VectorXd follows = -slope(beads_[k].G, P, x) / integral(beads_[k].by_P, P, x),
                              with = q * slope(beads_[k].by_P, P, x);
        out += with * follows.transpose() + follows * with.transpose() +
               q * integral(beads_[k].by_PP, P, x) * follows * follows.transpose();
    }
    return out;
}

double BeadForms::coarseness(const double* x) const {
    constexpr double near = 2;  // widths
    const std::vector<double>& breaks = space_.splines().breaks();
    const Eigen::VectorXd curve = Eigen::Map<const Eigen::VectorXd>(x, space_.size());
    const int n = static_cast<int>(breaks.size()) - 1;
    double longest = 0;
    for (int k = 0; k < 2; ++k) {
        const CurveSample pole = space_.evaluate(curve, k);
        for (int i = 0; i < n; ++i) {
            const int e = k == 0 ? i : n - 1 - i;
            const CurveSample at = space_.evaluate(curve, breaks[k == 0 ? e : e + 1]);
            if (std::hypot(at.r, at.z - pole.z) > near * width_) break;
            longest = std::max(longest, std::hypot(at.r1, at.z1) * (breaks[e + 1] - breaks[e]));
        }
    }
    return longest / width_;
}

std::vector<double> refined_at_beads(const std::vector<double>& breaks, double width, double length) {
    constexpr double at_bead = 1.0 / 3, growth = 0.2;  // size over the width; its growth with the distance
    std::vector<double> out{breaks.front()};
    for (std::size_t e = 0; e + 1 < breaks.size(); ++e) {
        const double to = breaks[e + 1], left = to - out.back();
        // Allowed at the end that is nearer to a pole: sizes are halved until they fit.
        std::vector<double> ends{to};
        while (!ends.empty()) {
            const double from = out.back(), distance = std::min(from, 1 - ends.back());
            if (ends.back() - from <= at_bead * width / length + growth * distance ||
                ends.back() - from < 1e-6 * left) {
                out.push_back(ends.back());
                ends.pop_back();
            } else {
                ends.push_back((from + ends.back()) / 2);
            }
        }
    }
    return out;
}

}  // namespace tubule::axisym
