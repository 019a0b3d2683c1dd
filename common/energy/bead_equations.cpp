#include "common/energy/bead_equations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/geometry/profile_point.hpp"

namespace tubule {
namespace {

constexpr int of_P = 0, of_q = 1;  // in the numbers of each bead

// G is the integral of g zeta/(2 pi w^2 exp(-1/2)), with zeta outward from the bead and a Gaussian weight g whose
// centre is w beyond it: on a flat membrane at z G = z - P. The derivatives by zeta follow from g' = -u g.
struct Texts {
    std::string g, zeta, u;
    Texts(double width, bool in_space, int bead, const std::string& P)
        : zeta(fmt::format("({}z - ({}))", bead == 0 ? "-" : "", P)),
          u(fmt::format("(({} - {:.17g})/{:.17g})", zeta, width, width * width)) {
        g = fmt::format("{:.17g}*exp(-({} + ({} - {:.17g})^2)/{:.17g})", std::exp(0.5) / (2 * pi * width * width),
                        in_space ? "x^2 + y^2" : "r^2", zeta, width, 2 * width * width);
    }
};

}  // namespace

BeadEquations::BeadEquations(double width, std::span<const std::string_view> variables, std::optional<double> foot)
    : width_(width), in_space_(variables.size() == in_space.size()), foot_(foot) {
    for (int bead = 0; bead < 2; ++bead) {
        const Texts t(width, in_space_, bead, "P");
        const auto density = [&](const std::string& factor) { return parse_formula(t.g + "*" + factor, variables); };
        beads_[bead] = {density(t.zeta), density(fmt::format("({}*{} - 1)", t.zeta, t.u)),
                        density(fmt::format("({0}^2*{1} - 2*{0} - {1}/{2:.17g})", t.u, t.zeta, width * width))};
    }
}

std::string BeadEquations::force_density(const BeadNumbers& at) const {
    std::string out;
    for (int k = 0; k < 2; ++k) {
        const Texts t(width_, in_space_, k, fmt::format("{:.17g}", at[2 * k + of_P]));
        out += fmt::format("{}({:.17g})*{}*{}", k == 0 ? "" : " + ", at[2 * k + of_q], t.g, t.zeta);
    }
    return out;
}

BeadNumbers BeadEquations::residual(const BeadSurface& on, const BeadLoad& load, const BeadNumbers& at) const {
    BeadNumbers F;
    double forces[2];
    for (int k = first(); k < 2; ++k) {
        F[2 * k] = on.integral(beads_[k].G, at[2 * k + of_P]);
        forces[k] = at[2 * k + of_q] * on.integral(beads_[k].by_P, at[2 * k + of_P]);
    }
    if (foot_) {
        F << at[of_P] + *foot_, at[of_q], F[2], load.distance ? distance(at) - *load.distance : forces[1] - load.force;
        return F;
    }
    F[1] = load.distance ? distance(at) - *load.distance : forces[0] - load.force;
    F[3] = load.distance ? forces[0] - forces[1] : forces[1] - load.force;
    return F;
}

BeadEquations::Slopes BeadEquations::slopes(const BeadSurface& on, const BeadLoad& load, const BeadNumbers& at) const {
    Slopes out{{}, {}, Eigen::Matrix4d::Zero()};
    Eigen::MatrixXd force_by_shape;
    Eigen::Matrix<double, 2, 4> force_by_numbers = Eigen::Matrix<double, 2, 4>::Zero();
    for (int k = first(); k < 2; ++k) {
        const int P = 2 * k + of_P, q = 2 * k + of_q;
        const Eigen::VectorXd G_slope = on.slope(beads_[k].G, at[P]), with_P = on.slope(beads_[k].by_P, at[P]);
        if (k == first()) {
            out.force_by_numbers.setZero(G_slope.size(), 4), out.equations_by_shape.setZero(4, G_slope.size());
            force_by_shape.setZero(2, G_slope.size());
        }
        const auto [by_P, by_PP] = slopes_in_P(on, k, at[P]);
        out.force_by_numbers.col(P) = at[q] * with_P, out.force_by_numbers.col(q) = G_slope;
        out.equations_by_shape.row(2 * k) = G_slope;
        out.equations_by_numbers(2 * k, P) = by_P;
        force_by_shape.row(k) = at[q] * with_P;
        force_by_numbers(k, P) = at[q] * by_PP, force_by_numbers(k, q) = by_P;
    }
    if (foot_) {
        out.equations_by_numbers(0, 0) = out.equations_by_numbers(1, 1) = 1;
        if (load.distance) {
            out.equations_by_numbers(3, 0) = out.equations_by_numbers(3, 2) = 1;
        } else {
            out.equations_by_shape.row(3) = force_by_shape.row(1);
            out.equations_by_numbers.row(3) = force_by_numbers.row(1);
        }
        return out;
    }
    if (load.distance) {
        out.equations_by_numbers(1, 0) = out.equations_by_numbers(1, 2) = 1;
        out.equations_by_shape.row(3) = force_by_shape.row(0) - force_by_shape.row(1);
        out.equations_by_numbers.row(3) = force_by_numbers.row(0) - force_by_numbers.row(1);
        return out;
    }
    for (int k = 0; k < 2; ++k) {
        out.equations_by_shape.row(2 * k + 1) = force_by_shape.row(k);
        out.equations_by_numbers.row(2 * k + 1) = force_by_numbers.row(k);
    }
    return out;
}

double BeadEquations::lagrangian(const BeadSurface& on, const BeadLoad& load, const BeadNumbers& at) const {
    double out = 0;
    for (int k = first(); k < 2; ++k) out += at[2 * k + of_q] * on.integral(beads_[k].G, at[2 * k + of_P]);
    return load.distance ? out - force(on, at) * (distance(at) - *load.distance) : out;
}

// Newton's method from the poles, in steps of a width at most; the mean of a bead that is far off shows the side.
BeadNumbers BeadEquations::numbers(const BeadSurface& on, const std::array<double, 2>& poles, double force) const {
    constexpr int most = 60;
    BeadNumbers out;
    if (foot_) out.head<2>() << -*foot_, 0;
    for (int k = first(); k < 2; ++k) {
        double P = poles[k], last = HUGE_VAL;
        bool found = false;
        for (int i = 0; i < most && !found && std::isfinite(P); ++i) {
            const double G = on.integral(beads_[k].G, P), by_P = on.integral(beads_[k].by_P, P);
            const double step = by_P < 0 ? std::clamp(-G / by_P, -width_, width_) : std::copysign(width_ / 2, G);
            found = by_P < 0 && (std::abs(step) < 1e-14 * width_ || (std::abs(step) < 1e-9 * width_ && !(step < last)));
            P += step, last = std::abs(step);
        }
        if (!found) P = std::numeric_limits<double>::quiet_NaN();
        out[2 * k + of_P] = P, out[2 * k + of_q] = force / on.integral(beads_[k].by_P, P);
    }
    return out;
}

double BeadEquations::force(const BeadSurface& on, const BeadNumbers& at) const {
    const int k = first();
    return at[2 * k + of_q] * on.integral(beads_[k].by_P, at[2 * k + of_P]);
}

Eigen::VectorXd BeadEquations::distance_slope(const BeadSurface& on, const BeadNumbers& at) const {
    Eigen::VectorXd out;
    for (int k = first(); k < 2; ++k) {
        const double P = at[2 * k + of_P];
        const Eigen::VectorXd one = -on.slope(beads_[k].G, P) / on.integral(beads_[k].by_P, P);
        out = k == first() ? one : Eigen::VectorXd(out + one);
    }
    return out;
}

// Each bead has q (2 d(dG/dP) dP + d^2G/dP^2 dP^2), the product written as a difference of two squares.
BeadEquations::Following BeadEquations::following(const BeadSurface& on, const BeadNumbers& at) const {
    Following out;
    for (int k = first(); k < 2; ++k) {
        const double P = at[2 * k + of_P], q = at[2 * k + of_q];
        const auto [by_P, by_PP] = slopes_in_P(on, k, P);
        const Eigen::VectorXd follows = -on.slope(beads_[k].G, P) / by_P, with = on.slope(beads_[k].by_P, P);
        if (k == first()) out.columns.resize(follows.size(), 0);
        if (q == 0) continue;
        const double alike = std::sqrt(with.norm() / follows.norm());
        const Eigen::Index n = out.columns.cols();
        out.columns.conservativeResize(follows.size(), n + 3), out.weights.conservativeResize(n + 3);
        out.columns.col(n) = with / alike + alike * follows, out.columns.col(n + 1) = with / alike - alike * follows;
        out.columns.col(n + 2) = follows;
        out.weights.tail<3>() << q / 2, -q / 2, q * by_PP;
    }
    return out;
}

}  // namespace tubule
