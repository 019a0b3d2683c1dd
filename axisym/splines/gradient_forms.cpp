#include "axisym/splines/gradient_forms.hpp"

#include <algorithm>

#include "axisym/splines/pack.hpp"
#include "common/geometry/jet.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

namespace stdx = std::experimental;
constexpr int lanes = SplineSpace::lanes;
constexpr int wide = SplineSpace::max_width;

// The variables r, r', r'', r''' and, of curves, z', z'', z''': of a field those from this derivative on, from this
// number on.
constexpr int first_derivative[2] = {0, 1}, first_of[2] = {0, 4};

const SplineSpace& field_of(const CurveSpace& space, int i) {
    return space.field(i);
}
const SplineSpace& field_of(const SplineSpace& space, int) {
    return space;
}
double rise(const CurveSpace& space, const double* x) {
    return space.rise(x);
}
double rise(const SplineSpace&, const double*) {
    return 1;  // z = s
}
int images_of(const CurveSpace& space) {
    return space.images();
}
int images_of(const SplineSpace& space) {
    return space.cell().images();
}

}  // namespace

template <class Space>
GradientForms<Space>::GradientForms(const Space& space)
    : space_(space), images_(images_of(space)), third_(field_of(space, 0)) {}

template <class Space>
struct GradientForms<Space>::Local {
    Pack v[2][4];  // derivatives of r and z

    Local(const Space& space, const Third& third, int e, int g, const double* x) {
        for (Pack& value : v[0]) value = Pack(0.0);
        for (Pack& value : v[1]) value = Pack(0.0);
        v[1][1] = Pack(rise(space, x));
        for (int i = 0; i < fields; ++i) {
            const SplineSpace& field = field_of(space, i);
            const auto& basis = field.basis(e, g);
            for (int a = 0; a < field.width(); ++a) {
                const double c = field.signs(e)[a] * x[field.dofs(e)[a]];
                for (int d = first_derivative[i]; d < 4; ++d)
                    v[i][d] += c * load(d < 3 ? basis.by_point[d][a] : third.by_point[a]);
            }
            x += field.size();
        }
    }

    // |grad H|^2 dS/ds of a whole turn, in the first of the variables.
    // With the equation of Codazzi kappa_theta' = (r'/r) (kappa_s - kappa_theta).
    template <int Order, int n = variables>
    auto density() const {
        using J = Jet<Pack, n, Order>;
        const auto z = [&](int d) {
            if constexpr (n > 4)
                return J::variable(v[1][d], 3 + d);
            else
                return d == 1 ? 1.0 : 0.0;
        };
        const J r0 = J::variable(v[0][0], 0), dr = J::variable(v[0][1], 1), ddr = J::variable(v[0][2], 2),
                dddr = J::variable(v[0][3], 3);
        const auto dz = z(1), ddz = z(2), dddz = z(3);
        const J ig = inverse_sqrt(dr * dr + dz * dz), ig2 = ig * ig, ig3 = ig2 * ig, ir = inverse(r0);
        const J kappa_s = (ddr * dz - dr * ddz) * ig3, kappa_theta = -(dz * ig * ir);
        const J H_s = (dddr * dz - dr * dddz) * ig3 - 3.0 * (kappa_s * ((dr * ddr + dz * ddz) * ig2)) +
                      (dr * ir) * (kappa_s - kappa_theta);
        return (2 * pi) * (r0 * ig * (H_s * H_s));
    }
};

template <class Space>
template <class Visit>
void GradientForms<Space>::each_group(const double* x, const Visit& visit) const {
    const SplineSpace& splines = field_of(space_, 0);
    for (int e = 0; e < splines.elements(); ++e)
        for (int g = 0; g < splines.groups(); ++g)
            visit(e, splines.basis(e, g), third_.at(e, g), Local(space_, third_.at(e, g), e, g, x));
}

template <class Space>
double GradientForms<Space>::value(const double* x, std::vector<double>* stiffness) const {
    Pack sum{0.0};
    if (stiffness) stiffness->assign(field_of(space_, 0).elements(), 0.0);
    each_group(x, [&](int e, const auto& basis, const Third&, const Local& at) {
        const Pack weight = images_ * load(basis.weight);
        sum += weight * at.template density<1>().v;
        if (!stiffness) return;
        const Pack g2 = at.v[0][1] * at.v[0][1] + at.v[1][1] * at.v[1][1], power = is_curve ? g2 * g2 : g2 * g2 * g2;
        (*stiffness)[e] += stdx::reduce(4 * pi * weight * at.v[0][0] / (power * stdx::sqrt(g2)));
    });
    return stdx::reduce(sum);
}

template <class Space>
void GradientForms<Space>::add_gradient(double weight, const double* x, double* out) const {
    const int w = field_of(space_, 0).width();
    Pack rise{0.0};
    each_group(x, [&](int e, const auto& basis, const Third& third, const Local& at) {
        const auto density = at.template density<1>();
        const Pack factor = weight * images_ * load(basis.weight);
        alignas(32) double c[variables][lanes];
        for (int i = 0; i < variables; ++i) store(factor * density.d[i], c[i]);
        if constexpr (is_curve) rise += factor * density.d[first_of[1]];
        for (int field = 0; field < fields; ++field) {
            Pack sums[2] = {Pack(0.0), Pack(0.0)};  // halves of the splines
            for (int q = 0; q < lanes; ++q)
                for (int d = first_derivative[field]; d < 4; ++d) {
                    const double* s = d < 3 ? basis.by_spline[q][d] : third.by_spline[q];
                    const double value = c[first_of[field] + d - first_derivative[field]][q];
                    for (int half = 0; half * lanes < w; ++half) sums[half] += value * load(s + half * lanes);
                }
            alignas(32) double local[wide];
            store(sums[0], local), store(sums[1], local + lanes);
            field_of(space_, field).add(e, local, out + field * field_of(space_, 0).size());
        }
    });
    if constexpr (is_curve)
        if (space_.free_period()) out[space_.shape_size()] += stdx::reduce(rise);
}

template <class Space>
void GradientForms<Space>::add_hessian(double weight, const double* x, const std::vector<int>& slots,
                                       double* values) const {
    const int w = field_of(space_, 0).width();
    each_group(x, [&](int e, const auto& basis, const Third& third, const Local& at) {
        const auto density = at.template density<2>();
        const Pack factor = weight * images_ * load(basis.weight);
        alignas(32) double c[variables][variables][lanes];
        for (int i = 0; i < variables; ++i)
            for (int j = 0; j < variables; ++j) store(factor * density.dd[packed<variables>(i, j)], c[i][j]);
        const int* slot = &slots[static_cast<std::size_t>(e) * fields * fields * w * w];
        for (int field = 0; field < fields; ++field)
            for (int of = 0; of < fields; ++of)
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
                    const double* sign = field_of(space_, field).signs(e);
                    const double* signs = field_of(space_, of).signs(e);
                    for (int b = 0; b < w; ++b)
                        for (int a = half * lanes; a < std::min(w, (half + 1) * lanes); ++a)
                            values[slot[(field * w + b) * fields * w + of * w + a]] +=
                                sign[b] * signs[a] * columns[b][a - half * lanes];
                }
    });
}

template <class Space>
Eigen::VectorXd GradientForms<Space>::by_rise(double weight, const double* x) const requires(is_curve) {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(space_.size());
    const int z1 = first_of[1];
    each_group(x, [&](int e, const auto& basis, const Third& third, const Local& at) {
        const auto density = at.template density<2>();
        const Pack factor = weight * images_ * load(basis.weight);
        out[space_.shape_size()] += stdx::reduce(factor * density.dd[packed<variables>(z1, z1)]);
        for (int field = 0; field < fields; ++field)
            for (int d = first_derivative[field]; d < 4; ++d) {
                const int i = first_of[field] + d - first_derivative[field];
                const Pack c = factor * density.dd[packed<variables>(z1, i)];
                for (int a = 0; a < field_of(space_, 0).width(); ++a)
                    out[space_.dof(e, field, a)] +=
                        space_.field(field).signs(e)[a] *
                        stdx::reduce(c * load(d < 3 ? basis.by_point[d][a] : third.by_point[a]));
            }
    });
    return out;
}

template <class Space>
double GradientForms<Space>::stretch_slope(const double* x) const {
    Pack sum{0.0};
    each_group(x, [&](int, const auto& basis, const Third&, const Local& at) {
        const auto density = at.template density<1, 7>();
        for (int d = 1; d < 4; ++d) sum += load(basis.weight) * density.d[3 + d] * at.v[1][d];
    });
    return images_ * stdx::reduce(sum);
}

template class GradientForms<CurveSpace>;
template class GradientForms<SplineSpace>;

}  // namespace tubule::axisym
