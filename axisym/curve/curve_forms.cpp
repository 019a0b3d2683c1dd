#include "axisym/curve/curve_forms.hpp"

#include <algorithm>
#include <cmath>

#include "axisym/curve/curve_local.hpp"
#include "axisym/curve/shape_integrals.hpp"
#include "axisym/curve/varying_H0.hpp"
#include "axisym/splines/added_terms.hpp"
#include "axisym/splines/element_pattern.hpp"
#include "axisym/splines/pack.hpp"
#include "common/energy/principal_symbol.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

namespace stdx = std::experimental;
constexpr int lanes = SplineSpace::lanes;
constexpr int wide = SplineSpace::max_width;
using Local = CurveLocal;

// d log g/ds
template <class S>
S stretching(const S& r1, const S& r2, const S& z1, const S& z2) {
    return (r1 * r2 + z1 * z2) * inverse(S(r1 * r1 + z1 * z1));
}

const VaryingH0 varies_nowhere;

Pack H0_of(const Bending& bending, const VaryingH0& H0, int group) {
    return H0.empty() ? Pack(bending.H0) : H0.value[group];
}

// H0 at a group of points: where it varies, else the number.
struct PointH0 {
    Pack value{0.0}, tension{0.0};
    PointH0() = default;
    PointH0(const VaryingH0& H0, int group, double number) : value(number) {
        if (H0.empty()) return;
        value = H0.value[group];
        if (!H0.tension.empty()) tension = H0.tension[group];
    }
};

// The functional per unit of s, with derivatives with respect to (r, r', r'', z', z'').
template <int Order, Added added = Added::any, bool varies = true>
Jet<Pack, 5, Order> functional_density(const Bending& bending, const PointH0& H0, const Weights& w, const Local& at) {
    using J = Jet<Pack, 5, Order>;
    J sum;
    if (w.energy != 0 || w.area != 0 || w.M != 0) {
        const auto p = at.point<Order>();
        const auto of = [&](const CurvatureJet<Pack>& f) {
            return chain(p.H, p.K, w.energy * f.f + w.M * p.H.v, w.energy * f.H + w.M, w.energy * f.K, w.energy * f.HH,
                         w.energy * f.HK, w.energy * f.KK);
        };
        if constexpr (varies) {
            J tension;
            tension.v = w.energy * H0.tension + w.area;
            sum = p.area * (of(density_at<Pack, added>(bending, H0.value, p.H.v, p.K.v)) + tension);
        } else {
            sum = p.area * (of(density<Pack, added>(bending, p.H.v, p.K.v)) + w.area);
        }
    }
    const J r = J::variable(at.r, 0), r1 = J::variable(at.r1, 1), r2 = J::variable(at.r2, 2),
            z1 = J::variable(at.z1, 3), z2 = J::variable(at.z2, 4);
    if (w.volume != 0) sum += (w.volume * pi) * (r * r * z1);
    if (w.gauge != 0) {
        const J q = stretching(r1, r2, z1, z2);
        sum += (w.gauge / 2) * (q * q);
    }
    return sum;
}

// kernel<added, varies>() of this energy.
template <class Kernel>
auto by_energy(const Bending& bending, const Kernel& kernel) {
    if (bending.H0_varies()) return kernel.template operator()<Added::any, true>();
    return by_added(bending, [&]<Added added>() { return kernel.template operator()<added, false>(); });
}

}  // namespace

CurveForms::CurveForms(const CurveSpace& space, const Bending& bending) : space_(space), images_(space.images()) {
    set_bending(bending);
    const auto dofs = [&](int e) {
        std::vector<int> out;
        for (int field = 0; field < 2; ++field)
            for (int a = 0; a < space.splines().width(); ++a)
                out.push_back(space.field(field).signs(e)[a] == 0 ? -1 : space.dof(e, field, a));
        return out;
    };
    const std::vector<int> full = space.free_period() ? std::vector{space.shape_size()} : std::vector<int>{};
    auto [pattern, slots] = element_pattern(space.size(), space.splines().elements(), dofs, full);
    pattern_ = std::move(pattern), slots_ = std::move(slots);
}

void CurveForms::set_bending(const Bending& bending) {
    bending_ = bending, W_ = potential_density(bending.potentials);
    if (bending.kg != 0 && !gradients_) gradients_.emplace(space_);
}

template <int P>
[[gnu::flatten]] bool CurveForms::gradient_kernel(const Weights& weights, const VaryingH0& H0, const double* x,
                                                  double* out) const {
    const auto kernel = [&]<Added added, bool varies>() -> bool {
        const SplineSpace& splines = space_.splines();
        Pack smallest{std::numeric_limits<double>::infinity()}, rise{0.0};
        for (int e = 0; e < splines.elements(); ++e) {
            Pack sums[2][2] = {{Pack(0.0), Pack(0.0)}, {Pack(0.0), Pack(0.0)}};  // [field][half of the splines]
            for (int g = 0; g < splines.groups(); ++g) {
                const auto& basis = splines.basis(e, g);
                const Local at(space_, e, g, x);
                smallest = stdx::min(smallest, at.r);
                const auto density = functional_density<1, added, varies>(
                    bending_, varies ? PointH0(H0, e * splines.groups() + g, 0) : PointH0(), weights, at);
                const Pack weight = images_ * load(basis.weight);
                alignas(32) double c[5][lanes];
                for (int i = 0; i < 5; ++i) store(weight * density.d[i], c[i]);
                rise += weight * density.d[first_variable[1]];
                for (int q = 0; q < lanes; ++q)
                    for (int field = 0; field < 2; ++field)
                        for (int d = first_derivative[field]; d < 3; ++d) {
                            const double value = c[first_variable[field] + d - first_derivative[field]][q];
                            sums[field][0] += value * load(basis.by_spline[q][d]);
                            sums[field][1] += value * load(basis.by_spline[q][d] + lanes);
                        }
            }
            for (int field = 0; field < 2; ++field) {
                alignas(32) double local[wide];
                store(sums[field][0], local);
                store(sums[field][1], local + lanes);
                space_.add(e, field, local, out);
            }
        }
        if (space_.free_period()) out[space_.shape_size()] += stdx::reduce(rise);
        return stdx::hmin(smallest) > 0;
    };
    return by_energy(bending_, kernel);
}

template <int P>
[[gnu::flatten]] void CurveForms::hessian_kernel(const Weights& weights, const VaryingH0& H0, const double* x,
                                                 double* values) const {
    const auto kernel = [&]<Added added, bool varies>() -> void {
        constexpr int w = P + 1;
        const SplineSpace& splines = space_.splines();
        for (int e = 0; e < splines.elements(); ++e) {
            alignas(32) Pack local[2][2][w][2];  // [field of column][field of row][column][half of the rows]
            std::fill_n(&local[0][0][0][0], 8 * w, Pack(0.0));
            for (int g = 0; g < splines.groups(); ++g) {
                const auto& basis = splines.basis(e, g);
                const auto density = functional_density<2, added, varies>(
                    bending_, varies ? PointH0(H0, e * splines.groups() + g, 0) : PointH0(), weights,
                    Local(space_, e, g, x));
                const Pack weight = images_ * load(basis.weight);
                alignas(32) double c[5][5][lanes];
                for (int i = 0; i < 5; ++i)
                    for (int j = 0; j < 5; ++j) store(weight * density.dd[packed<5>(i, j)], c[i][j]);
                for (int q = 0; q < lanes; ++q) {
                    const auto& s = basis.by_spline[q];
                    for (int field = 0; field < 2; ++field)
                        for (int of = 0; of < 2; ++of)
                            for (int half = 0; half * lanes <= P; ++half) {
                                const int d0 = first_derivative[field], i0 = first_variable[field] - d0;
                                const int k0 = first_derivative[of], j0 = first_variable[of] - k0;
                                Pack rows[3];  // c contracted with the splines of the rows
                                for (int d = d0; d < 3; ++d) {
                                    rows[d] = Pack(0.0);
                                    for (int k = k0; k < 3; ++k)
                                        rows[d] += c[i0 + d][j0 + k][q] * load(s[k] + half * lanes);
                                }
                                for (int b = 0; b < w; ++b)
                                    for (int d = d0; d < 3; ++d) local[field][of][b][half] += s[d][b] * rows[d];
                            }
                }
            }
            const int* slot = &slots_[static_cast<std::size_t>(e) * 4 * w * w];
            for (int b = 0; b < 2 * w; ++b)
                for (int of = 0; of < 2; ++of) {
                    alignas(32) double column[wide];
                    store(local[b / w][of][b % w][0], column);
                    store(local[b / w][of][b % w][1], column + lanes);
                    const double sign = space_.field(b / w).signs(e)[b % w];
                    const double* signs = space_.field(of).signs(e);
                    for (int a = 0; a < w; ++a) values[slot[b * 2 * w + of * w + a]] += sign * signs[a] * column[a];
                }
        }
    };
    return by_energy(bending_, kernel);
}

const VaryingH0& CurveForms::fixed_H0() const {
    return fixed_H0_ ? *fixed_H0_ : varies_nowhere;
}

template <class Use>
auto CurveForms::with_H0(const double* x, const Use& use) const {
    if (H0_by_area()) return use(H0ByArea(space_, bending_, x).at_points());
    return use(fixed_H0());
}

void CurveForms::fix_H0(const Eigen::VectorXd& x) {
    fixed_H0_ = std::make_shared<const VaryingH0>(tubule::axisym::fix_H0(space_, *bending_.H0_formula, x));
    fixed_on_ = x;
}

std::vector<double> CurveForms::H0_at(const Eigen::VectorXd& x, const std::vector<double>& s) const {
    if (!bending_.H0_varies()) return std::vector<double>(s.size(), bending_.H0);
    const Eigen::VectorXd& curve = H0_by_area() ? x : fixed_on_;
    std::vector<double> out = area_below(space_, curve, s);
    for (std::size_t i = 0; i < s.size(); ++i) {
        const CurveSample p = space_.evaluate(curve, s[i]);
        const double variables[]{out[i], p.r, p.z};
        out[i] = evaluate(*bending_.H0_formula, variables);
    }
    return out;
}

bool CurveForms::add_gradient(const Weights& weights, const double* x, double* out) const {
    const bool inside = with_H0(x, [&](const VaryingH0& H0) {
        return for_degree(space_.splines().degree(), [&](auto P) { return gradient_kernel<P()>(weights, H0, x, out); });
    });
    if (W_ && weights.energy != 0) add_potential_gradient(space_, *W_, weights.energy, x, out);
    if (const double kg = weights.energy * bending_.kg; kg != 0) gradients_->add_gradient(kg, x, out);
    return inside && ((bending_.terms.empty() && !bending_.H0_varies() && !W_) ||
                      std::all_of(out, out + space_.size(), [](double y) { return std::isfinite(y); }));
}

void CurveForms::add_hessian(const Weights& weights, const double* x, double* values) const {
    with_H0(x, [&](const VaryingH0& H0) {
        for_degree(space_.splines().degree(), [&](auto P) { hessian_kernel<P()>(weights, H0, x, values); });
    });
    if (W_ && weights.energy != 0) add_potential_hessian(space_, *W_, weights.energy, x, slots_, values);
    if (const double kg = weights.energy * bending_.kg; kg != 0) gradients_->add_hessian(kg, x, slots_, values);
    if (!space_.free_period()) return;
    const int rise = space_.shape_size();
    double* column = values + pattern_.outerIndexPtr()[rise];  // all rows, in order
    add_rise_hessian(weights, x, [&](int i, double value) {
        column[i] += value;
        if (i != rise) values[pattern_.outerIndexPtr()[i + 1] - 1] += value;  // the last row of each column
    });
}

// The second derivatives with one in the rise, by the number of the other coefficient.
template <class Add>
void CurveForms::add_rise_hessian(const Weights& weights, const double* x, const Add& add) const {
    if (const double kg = weights.energy * bending_.kg; kg != 0) gradients_->each_by_rise(kg, x, add);
    each_group(space_, x, [&](int e, int i, const auto& basis, const Local& at) {
        const PointH0 H0(fixed_H0(), i, bending_.H0);
        const auto density = functional_density<2>(bending_, H0, weights, at);
        const Pack weight = images_ * load(basis.weight);
        const int z1 = first_variable[1];
        add(space_.shape_size(), stdx::reduce(weight * density.dd[packed<5>(z1, z1)]));
        for (int field = 0; field < 2; ++field)
            for (int d = first_derivative[field]; d < 3; ++d) {
                const Pack c = weight * density.dd[packed<5>(z1, first_variable[field] + d - first_derivative[field])];
                for (int a = 0; a < space_.splines().width(); ++a)
                    add(space_.dof(e, field, a),
                        space_.field(field).signs(e)[a] * stdx::reduce(c * load(basis.by_point[d][a])));
            }
    });
}

double CurveForms::stretch_slope(const Weights& weights, const Eigen::VectorXd& x) const {
    Pack sum{0.0};
    each_group(space_, x.data(), [&](int, int i, const auto& basis, const Local& at) {
        const PointH0 H0(fixed_H0(), i, bending_.H0);
        const auto density = functional_density<1>(bending_, H0, weights, at);
        sum += load(basis.weight) * (density.d[first_variable[1]] * at.z1 + density.d[first_variable[1] + 1] * at.z2);
    });
    const double kg = weights.energy * bending_.kg;
    const double of_places = W_ && weights.energy != 0 ? potential_stretch(space_, *W_, x.data()) : 0;
    return images_ * stdx::reduce(sum) + weights.energy * of_places +
           (kg != 0 ? kg * gradients_->stretch_slope(x.data()) : 0);
}

namespace {

// The rows that r and z are tested with.
template <int Order>
std::array<Jet<Pack, 5, Order>, 2> sliding_rows(const Bending& bending, const VaryingH0& H0, int group,
                                                const Local& at) {
    using J = Jet<Pack, 5, Order>;
    const auto p = at.point<Order>();
    const SlopeInH0<Pack> f0 = slope_in_H0(bending, H0.value[group], p.H.v, p.K.v);
    const J push = chain(p.H, p.K, f0.f, f0.H, f0.K, Pack(0.0), Pack(0.0), Pack(0.0));
    J slope;
    slope.v = H0.slope[group];
    const J common = push * slope * p.area * p.inverse_speed * p.inverse_speed;
    return {common * J::variable(at.r1, 1), common * J::variable(at.z1, 3)};
}

}  // namespace

void CurveForms::add_sliding(const double* x, double* out) const {
    each_group(space_, x, [&](int e, int i, const auto& basis, const Local& at) {
        const Pack weight = images_ * load(basis.weight);
        const auto rows = sliding_rows<1>(bending_, fixed_H0(), i, at);
        for (int field = 0; field < 2; ++field) {
            double local[wide];
            for (int a = 0; a < space_.splines().width(); ++a)
                local[a] = stdx::reduce(weight * rows[field].v * load(basis.by_point[0][a]));
            space_.add(e, field, local, out);
        }
    });
}

void CurveForms::add_sliding_slopes(const double* x, double* values) const {
    const int w = space_.splines().width();
    each_group(space_, x, [&](int e, int i, const auto& basis, const Local& at) {
        const Pack weight = images_ * load(basis.weight);
        const auto rows = sliding_rows<1>(bending_, fixed_H0(), i, at);
        const int* slot = &slots_[static_cast<std::size_t>(e) * 4 * w * w];
        for (int b = 0; b < 2 * w; ++b)
            for (int of = 0; of < 2; ++of) {
                const int by = b / w;
                Pack slope{0.0};
                for (int d = first_derivative[by]; d < 3; ++d)
                    slope += rows[of].d[first_variable[by] + d - first_derivative[by]] * load(basis.by_point[d][b % w]);
                const double sign = space_.field(by).signs(e)[b % w];
                const double* signs = space_.field(of).signs(e);
                for (int a = 0; a < w; ++a)
                    values[slot[b * 2 * w + of * w + a]] +=
                        sign * signs[a] * stdx::reduce(weight * slope * load(basis.by_point[0][a]));
            }
    });
}

Eigen::VectorXd CurveForms::gradient(const Weights& weights, const Eigen::VectorXd& x) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(space_.size());
    add_gradient(weights, x.data(), out.data());
    return out;
}

Eigen::SparseMatrix<double> CurveForms::hessian(const Weights& weights, const Eigen::VectorXd& x) const {
    Eigen::SparseMatrix<double> out = pattern_;
    add_hessian(weights, x.data(), out.valuePtr());
    if (!H0_by_area() || weights.energy == 0) return out;
    Eigen::MatrixXd full = weights.energy * H0ByArea(space_, bending_, x.data()).hessian_beyond();
    for (int j = 0; j < out.cols(); ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(out, j); it; ++it) full(it.row(), j) += it.value();
    return full.sparseView(1, -1);  // zeros included
}

double CurveForms::value(const Weights& weights, const Eigen::VectorXd& x) const {
    const CurveObservation o = observe(x);
    return weights.energy * (o.energy - o.energy_alpha) + weights.area * o.area + weights.volume * o.volume +
           weights.gauge * o.gauge + weights.M * o.M;
}

Eigen::SparseMatrix<double> CurveForms::mass(const Eigen::VectorXd& x) const {
    const int w = space_.splines().width(), rise = space_.shape_size();
    Eigen::SparseMatrix<double> out = pattern_;
    const auto add_rise = [&](int i, double value) {  // of a free period, whose displacement is s e_z
        out.coeffRef(i, rise) += value;
        if (i != rise) out.coeffRef(rise, i) += value;
    };
    each_group(space_, x.data(), [&](int e, int, const auto& basis, const Local& at) {
        const Pack dS = (2 * pi * images_) * load(basis.weight) * at.r * stdx::sqrt(at.r1 * at.r1 + at.z1 * at.z1);
        const int* slot = &slots_[static_cast<std::size_t>(e) * 4 * w * w];
        const double* r = space_.r().signs(e);
        const double* z = space_.z().signs(e);
        if (space_.free_period()) {
            const Pack s = dS * load(basis.z);
            add_rise(rise, stdx::reduce(s * load(basis.z)));
            for (int a = 0; a < w; ++a)
                add_rise(space_.dof(e, 1, a), z[a] * stdx::reduce(s * load(basis.by_point[0][a])));
        }
        for (int b = 0; b < w; ++b)
            for (int a = 0; a < w; ++a) {
                const double value = stdx::reduce(dS * load(basis.by_point[0][a]) * load(basis.by_point[0][b]));
                out.valuePtr()[slot[b * 2 * w + a]] += r[a] * r[b] * value;
                out.valuePtr()[slot[(w + b) * 2 * w + w + a]] += z[a] * z[b] * value;
            }
    });
    return out;
}

double CurveForms::M(const double* x) const {
    Pack sum{0.0};
    each_group(space_, x, [&](int, int, const auto& basis, const Local& at) {
        const auto p = at.point();
        sum += load(basis.weight) * p.area * p.H;
    });
    return images_ * stdx::reduce(sum);
}

bool CurveForms::admissible(const Eigen::VectorXd& x) const {
    bool regular = true;
    each_group(space_, x.data(), [&](int, int, const auto&, const Local& at) {
        regular = regular && stdx::hmin(at.r) > 0 && stdx::hmin(at.r1 * at.r1 + at.z1 * at.z1) > 0;
    });
    if (!regular) return false;
    if (W_) {
        const PotentialObservation potential = observe_potential(space_, *W_, bending_.potentials, x.data());
        if (!(std::isfinite(potential.energy) && potential.distance > 0)) return false;
    }
    return domain(x).value > 0;
}

FormulaDomain::Margin CurveForms::domain(const Eigen::VectorXd& x) const {
    const FormulaDomain::Margin of_place = potential_domain(space_, bending_.potentials, x.data());
    DensityDomain domain(bending_);
    if (!domain.restricted()) return of_place;
    const VaryingH0 H0 = with_H0(x.data(), [](const VaryingH0& at) { return at; });
    each_group(space_, x.data(), [&](int, int i, const auto& basis, const Local& at) {
        const auto p = at.point();
        const Pack at_H0 = H0_of(bending_, H0, i);
        for (int q = 0; q < lanes; ++q) domain.look(at_H0[q], p.H[q], p.K[q], basis.z[q]);
    });
    const FormulaDomain::Margin of_density = domain.margin();
    return of_place.value < of_density.value ? of_place : of_density;
}

CurveObservation CurveForms::observe(const Eigen::VectorXd& x, std::vector<double>* mesh_loss) const {
    const SplineSpace& splines = space_.splines();
    const VaryingH0 H0 = with_H0(x.data(), [](const VaryingH0& at) { return at; });
    CurveObservation o;
    Pack area{0.0}, volume{0.0}, gauge{0.0}, length{0.0}, M{0.0};
    std::vector<Pack> terms(count_terms(bending_), Pack(0.0));
    std::vector<double> stiffness(splines.elements(), 0.0);
    each_group(space_, x.data(), [&](int e, int i, const auto& basis, const Local& at) {
        const auto p = at.point();
        const Pack weight = load(basis.weight), dA = weight * p.area, speed = 1.0 / p.inverse_speed;
        const Pack stretch = stretching(at.r1, at.r2, at.z1, at.z2);
        area += dA, M += dA * p.H;
        volume += pi * weight * at.r * at.r * at.z1;
        gauge += 0.5 * weight * stretch * stretch;
        length += weight * speed;
        const Pack at_H0 = H0_of(bending_, H0, i);
        for_each_value_at(bending_, at_H0, p.H, p.K, [&](std::size_t k, const Pack& value) { terms[k] += value * dA; });
        const auto f = density_at(bending_, at_H0, p.H, p.K);
        const Pack s = principal_symbol(f, p.kappa_theta);
        const Pack low = stdx::min(p.kappa_s, p.kappa_theta), high = stdx::max(p.kappa_s, p.kappa_theta);
        if (bending_.kg == 0) o.symbol_3d = std::min(o.symbol_3d, stdx::hmin(least_principal_symbol(f, low, high)));
        const double size = splines.breaks()[e + 1] - splines.breaks()[e];
        const Pack ig2 = p.inverse_speed * p.inverse_speed;
        stiffness[e] += stdx::reduce(dA * ig2 * ig2 * stdx::abs(s));
        const Pack bent = stdx::max(stdx::abs(low), stdx::abs(high));
        for (int q = 0; q < lanes; ++q) {
            o.g_min = std::min(o.g_min, static_cast<double>(speed[q]));
            o.g_max = std::max(o.g_max, static_cast<double>(speed[q]));
            if (at.r[q] < o.r_min) o.r_min = at.r[q], o.s_min = basis.z[q];
            if (at.r[q] > o.r_max) o.r_max = at.r[q], o.s_max = basis.z[q];
            if (bent[q] > o.curvature) o.curvature = bent[q], o.s_curvature = basis.z[q];
            if (bending_.kg == 0 && s[q] < o.symbol) o.symbol = s[q], o.s_symbol = basis.z[q];
            if (bending_.kg == 0 || s[q] >= 0) continue;
            const double coarse = size * speed[q] * std::sqrt(-s[q] / (2 * bending_.kg));
            if (coarse > o.coarse) o.coarse = coarse, o.s_coarse = basis.z[q];
        }
    });
    o.area = images_ * stdx::reduce(area);
    o.volume = images_ * stdx::reduce(volume);
    o.gauge = images_ * stdx::reduce(gauge);
    o.length = images_ * stdx::reduce(length);
    o.M = images_ * stdx::reduce(M);
    o.energy = o.energy_alpha = area_difference_energy(bending_, o.M);
    for (const Pack& term : terms) o.energy += o.energy_term.emplace_back(images_ * stdx::reduce(term));
    if (W_) o.potential = observe_potential(space_, *W_, bending_.potentials, x.data()), o.energy += o.potential.energy;
    std::vector<double> of_gradients;
    if (bending_.kg != 0) o.energy += o.energy_kg = bending_.kg * gradients_->value(x.data(), &of_gradients);
    o.domain = domain(x);
    if (mesh_loss) *mesh_loss = loss_to_mesh(x, stiffness, of_gradients);
    return o;
}

std::vector<double> CurveForms::loss_to_mesh(const Eigen::VectorXd& x, const std::vector<double>& stiffness,
                                             const std::vector<double>& of_gradients) const {
    const SplineSpace& splines = space_.splines();
    const int n = splines.elements(), p = splines.degree();
    const auto& breaks = splines.breaks();
    const auto size = [&](int e) { return breaks[e + 1] - breaks[e]; };
    // Along the normal at the knots.
    const std::vector<double> of_r = space_.r().top_jumps(x.data()),
                              of_z = space_.z().top_jumps(x.data() + space_.offset(1));
    std::vector<double> jump(n + 1);
    for (int e = 0; e <= n; ++e) {
        const CurveSample at = space_.evaluate(x, breaks[e]);
        jump[e] = Eigen::Vector2d(at.z1, -at.r1).normalized().dot(Eigen::Vector2d(of_r[e], of_z[e]));
    }
    if (splines.cell().open_start) jump[0] = jump[1];
    if (splines.cell().open_end) jump[n] = jump[n - 1];
    std::vector<double> mesh_loss(n);
    for (int e = 0; e < n; ++e) {
        double loss = images_ * splines.bernoulli_norm() * std::pow(size(e), 2 * (p - 1)) * stiffness[e];
        if (!of_gradients.empty())
            loss += splines.bernoulli_norm_of_third() * std::pow(size(e), 2 * (p - 2)) * bending_.kg * of_gradients[e];
        mesh_loss[e] = loss / 4 * (jump[e] * jump[e] + jump[e + 1] * jump[e + 1]);
    }
    return mesh_loss;
}

double CurveForms::reference_energy(const Eigen::VectorXd& x) const {
    const VaryingH0 H0 = with_H0(x.data(), [](const VaryingH0& at) { return at; });
    double magnitude = 0;
    each_group(space_, x.data(), [&](int, int i, const auto& basis, const Local& at) {
        const auto p = at.point();
        const Pack dA = p.area * load(basis.weight), at_H0 = H0_of(bending_, H0, i);
        for (int q = 0; q < lanes; ++q) magnitude += tubule::magnitude(bending_, at_H0[q], p.H[q], p.K[q]) * dA[q];
    });
    const CurveObservation o = observe(x);
    if (space_.is_patch())
        magnitude += patch_scale(bending_, std::max(space_.evaluate(x, 0).r, space_.evaluate(x, 1).r));
    return std::max(std::abs(o.energy), images_ * magnitude + o.energy_kg + o.energy_alpha + o.potential.magnitude);
}

}  // namespace tubule::axisym
