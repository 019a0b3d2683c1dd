#include "axisym/curve/gradient_forms.hpp"

#include <algorithm>

#include "axisym/curve/curve_local.hpp"
#include "axisym/splines/pack.hpp"
#include "common/geometry/jet.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

namespace stdx = std::experimental;
constexpr int lanes = SplineSpace::lanes;
constexpr int wide = SplineSpace::max_width;
// The variables r, r', r'', r''', z', z'', z'''; derivatives that r and z enter with begin as in CurveForms.
constexpr int variables = 7, first_of[2] = {0, 4};

}  // namespace

struct GradientForms::Local : CurveLocal {
    Pack r3{0.0}, z3{0.0};
    Local(const CurveSpace& space, const Third& third, int e, int g, const double* x) : CurveLocal(space, e, g, x) {
        const double* z = x + space.r().size();
        for (int a = 0; a < space.splines().width(); ++a) {
            r3 += space.r().signs(e)[a] * x[space.r().dofs(e)[a]] * load(third.by_point[a]);
            z3 += space.z().signs(e)[a] * z[space.z().dofs(e)[a]] * load(third.by_point[a]);
        }
    }

    // |grad H|^2 dS/ds of a whole turn. With the equation of Codazzi kappa_theta' = (r'/r) (kappa_s - kappa_theta).
    template <int Order>
    auto density() const {
        using J = Jet<Pack, variables, Order>;
        const J r0 = J::variable(r, 0), dr = J::variable(r1, 1), ddr = J::variable(r2, 2), dddr = J::variable(r3, 3),
                dz = J::variable(z1, 4), ddz = J::variable(z2, 5), dddz = J::variable(z3, 6);
        const J ig = inverse_sqrt(dr * dr + dz * dz), ig2 = ig * ig, ig3 = ig2 * ig, ir = inverse(r0);
        const J kappa_s = (ddr * dz - dr * ddz) * ig3, kappa_theta = -(dz * ig * ir);
        const J H_s = (dddr * dz - dr * dddz) * ig3 - 3.0 * (kappa_s * ((dr * ddr + dz * ddz) * ig2)) +
                      (dr * ir) * (kappa_s - kappa_theta);
        return (2 * pi) * (r0 * ig * (H_s * H_s));
    }
};

template <class Visit>
void GradientForms::each_group(const double* x, const Visit& visit) const {
    const SplineSpace& splines = space_.splines();
    for (int e = 0; e < splines.elements(); ++e)
        for (int g = 0; g < splines.groups(); ++g) {
            const Third& third = third_.at(e, g);
            visit(e, splines.basis(e, g), third, Local(space_, third, e, g, x));
        }
}

double GradientForms::value(const double* x, std::vector<double>* stiffness) const {
    Pack sum{0.0};
    if (stiffness) stiffness->assign(space_.splines().elements(), 0.0);
    each_group(x, [&](int e, const auto& basis, const Third&, const Local& at) {
        const Pack weight = space_.images() * load(basis.weight), g2 = at.r1 * at.r1 + at.z1 * at.z1;
        sum += weight * at.template density<1>().v;
        if (stiffness) (*stiffness)[e] += stdx::reduce(4 * pi * weight * at.r * stdx::sqrt(g2) / (g2 * g2 * g2));
    });
    return stdx::reduce(sum);
}

void GradientForms::add_gradient(double weight, const double* x, double* out) const {
    const int w = space_.splines().width();
    Pack rise{0.0};
    each_group(x, [&](int e, const auto& basis, const Third& third, const Local& at) {
        const auto density = at.template density<1>();
        const Pack factor = weight * space_.images() * load(basis.weight);
        alignas(32) double c[variables][lanes];
        for (int i = 0; i < variables; ++i) store(factor * density.d[i], c[i]);
        rise += factor * density.d[first_of[1]];
        for (int field = 0; field < 2; ++field) {
            Pack sums[2] = {Pack(0.0), Pack(0.0)};  // halves of the splines
            for (int q = 0; q < lanes; ++q)
                for (int d = first_derivative[field]; d < 4; ++d) {
                    const double* s = d < 3 ? basis.by_spline[q][d] : third.by_spline[q];
                    const double value = c[first_of[field] + d - first_derivative[field]][q];
                    for (int half = 0; half * lanes < w; ++half) sums[half] += value * load(s + half * lanes);
                }
            alignas(32) double local[wide];
            store(sums[0], local), store(sums[1], local + lanes);
            const SplineSpace& f = field == 0 ? space_.r() : space_.z();
            double* to = field == 0 ? out : out + space_.r().size();
            for (int a = 0; a < w; ++a) to[f.dofs(e)[a]] += f.signs(e)[a] * local[a];
        }
    });
    if (space_.free_period()) out[space_.shape_size()] += stdx::reduce(rise);
}

void GradientForms::add_hessian(double weight, const double* x, const std::vector<int>& slots, double* values) const {
    const int w = space_.splines().width();
    each_group(x, [&](int e, const auto& basis, const Third& third, const Local& at) {
        const auto density = at.template density<2>();
        const Pack factor = weight * space_.images() * load(basis.weight);
        alignas(32) double c[variables][variables][lanes];
        for (int i = 0; i < variables; ++i)
            for (int j = 0; j < variables; ++j) store(factor * density.dd[packed<variables>(i, j)], c[i][j]);
        const int* slot = &slots[static_cast<std::size_t>(e) * 4 * w * w];
        for (int field = 0; field < 2; ++field)
            for (int of = 0; of < 2; ++of)
                for (int half = 0; half * lanes < w; ++half) {
                    const int d0 = first_derivative[field], k0 = first_derivative[of];
                    Pack columns[wide];
                    std::fill_n(columns, w, Pack(0.0));
                    for (int q = 0; q < lanes; ++q)
                        for (int d = d0; d < 4; ++d) {
                            Pack rows{0.0};  // contracted with the splines of the rows
                            for (int k = k0; k < 4; ++k)
                                rows += c[first_of[field] + d - d0][first_of[of] + k - k0][q] *
                                        load((k < 3 ? basis.by_spline[q][k] : third.by_spline[q]) + half * lanes);
                            const double* s = d < 3 ? basis.by_spline[q][d] : third.by_spline[q];
                            for (int b = 0; b < w; ++b) columns[b] += s[b] * rows;
                        }
                    const double* sign = (field == 0 ? space_.r() : space_.z()).signs(e);
                    const double* signs = (of == 0 ? space_.r() : space_.z()).signs(e);
                    for (int b = 0; b < w; ++b)
                        for (int a = half * lanes; a < std::min(w, (half + 1) * lanes); ++a)
                            values[slot[(field * w + b) * 2 * w + of * w + a]] +=
                                sign[b] * signs[a] * columns[b][a - half * lanes];
                }
    });
}

Eigen::VectorXd GradientForms::by_rise(double weight, const double* x) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(space_.size());
    const int z1 = first_of[1];
    each_group(x, [&](int e, const auto& basis, const Third& third, const Local& at) {
        const auto density = at.template density<2>();
        const Pack factor = weight * space_.images() * load(basis.weight);
        out[space_.shape_size()] += stdx::reduce(factor * density.dd[packed<variables>(z1, z1)]);
        for (int field = 0; field < 2; ++field) {
            const SplineSpace& f = field == 0 ? space_.r() : space_.z();
            for (int d = first_derivative[field]; d < 4; ++d) {
                const int i = first_of[field] + d - first_derivative[field];
                const Pack c = factor * density.dd[packed<variables>(z1, i)];
                for (int a = 0; a < space_.splines().width(); ++a)
                    out[f.dofs(e)[a] + (field == 0 ? 0 : space_.r().size())] +=
                        f.signs(e)[a] * stdx::reduce(c * load(d < 3 ? basis.by_point[d][a] : third.by_point[a]));
            }
        }
    });
    return out;
}

double GradientForms::stretch_slope(const double* x) const {
    Pack sum{0.0};
    each_group(x, [&](int, const auto& basis, const Third&, const Local& at) {
        const auto density = at.template density<1>();
        const int z1 = first_of[1];
        sum += load(basis.weight) * (density.d[z1] * at.z1 + density.d[z1 + 1] * at.z2 + density.d[z1 + 2] * at.z3);
    });
    return space_.images() * stdx::reduce(sum);
}

}  // namespace tubule::axisym
