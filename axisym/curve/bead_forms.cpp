#include "axisym/curve/bead_forms.hpp"

#include <algorithm>
#include <cmath>

#include "axisym/curve/potential_forms.hpp"

namespace tubule::axisym {

BeadSurface BeadForms::on(const double* x) const {
    return {[this, x](const Formula& density, double P) { return observe_potential(space_, density, {}, x, P).energy; },
            [this, x](const Formula& density, double P) {
                Eigen::VectorXd out = Eigen::VectorXd::Zero(space_.size());
                add_potential_gradient(space_, density, 1, x, out.data(), P);
                return out;
            }};
}

BeadNumbers BeadForms::numbers(const double* x, double force) const {
    const Eigen::VectorXd curve = Eigen::Map<const Eigen::VectorXd>(x, space_.size());
    return equations_.numbers(on(x), {-space_.evaluate(curve, 0).z, space_.evaluate(curve, 1).z}, force);
}

void BeadForms::add_force(const double* x, const BeadNumbers& at, double* out) const {
    for (int k = 0; k < 2; ++k)
        if (equations_.has_bead(k))
            add_potential_gradient(space_, equations_.density(k), at[2 * k + 1], x, out, at[2 * k]);
}

void BeadForms::add_hessian(const double* x, const BeadNumbers& at, const std::vector<int>& slots,
                            double* values) const {
    for (int k = 0; k < 2; ++k)
        if (equations_.has_bead(k))
            add_potential_hessian(space_, equations_.density(k), at[2 * k + 1], x, slots, values, at[2 * k]);
}

double BeadForms::coarseness(const double* x) const {
    constexpr double near = 2;  // widths
    const double width = equations_.width();
    const std::vector<double>& breaks = space_.splines().breaks();
    const Eigen::VectorXd curve = Eigen::Map<const Eigen::VectorXd>(x, space_.size());
    const int n = static_cast<int>(breaks.size()) - 1;
    double longest = 0;
    for (int k = equations_.has_bead(0) ? 0 : 1; k < 2; ++k) {
        const CurveSample pole = space_.evaluate(curve, k);
        for (int i = 0; i < n; ++i) {
            const int e = k == 0 ? i : n - 1 - i;
            const CurveSample at = space_.evaluate(curve, breaks[k == 0 ? e : e + 1]);
            if (std::hypot(at.r, at.z - pole.z) > near * width) break;
            longest = std::max(longest, std::hypot(at.r1, at.z1) * (breaks[e + 1] - breaks[e]));
        }
    }
    return longest / width;
}

std::vector<double> refined_at_beads(Topology topology, const std::vector<double>& breaks, double width,
                                     double length) {
    constexpr double at_bead = 1.0 / 3, growth = 0.2;  // size over the width; its growth with the distance
    std::vector<double> out{breaks.front()};
    for (std::size_t e = 0; e + 1 < breaks.size(); ++e) {
        const double to = breaks[e + 1], left = to - out.back();
        // Allowed at the end that is nearer to a pole: sizes are halved until they fit.
        std::vector<double> ends{to};
        while (!ends.empty()) {
            const double from = out.back(), to_end = 1 - ends.back(),
                         distance = topology == Topology::cell ? std::min(from, to_end) : to_end;
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
