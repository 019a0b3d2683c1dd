#include "axisym/graph/graph_forms.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <type_traits>

#include "axisym/splines/added_terms.hpp"
#include "axisym/splines/band_lu.hpp"
#include "axisym/splines/element_pattern.hpp"
#include "axisym/splines/pack.hpp"
#include "common/energy/principal_symbol.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

namespace stdx = std::experimental;
constexpr int lanes = SplineSpace::lanes;
constexpr int wide = SplineSpace::max_width;

// Coefficients of an element, gathered into r, r', r'' at its quadrature points.
template <int P>
struct Local {
    Pack r{0.0}, r1{0.0}, r2{0.0};
    Local(const SplineSpace::Basis& b, const int* dofs, const double* x) {
        for (int a = 0; a <= P; ++a) {
            const double c = x[dofs[a]];
            r += c * load(b.by_point[0][a]);
            r1 += c * load(b.by_point[1][a]);
            r2 += c * load(b.by_point[2][a]);
        }
    }
};

template <int P>
Pack gather(const SplineSpace::Basis& b, const int* dofs, const double* x) {
    Pack value{0.0};
    for (int a = 0; a <= P; ++a) value += x[dofs[a]] * load(b.by_point[0][a]);
    return value;
}

// The least of a quantity at the points of each lane, and where.
struct Least {
    Pack value{std::numeric_limits<double>::infinity()}, place{0.0};
    void look(const Pack& v, const Pack& z) {
        const auto less = v < value;
        stdx::where(less, place) = z;
        stdx::where(less, value) = v;
    }
    void find(double& least, double& where) const {
        least = stdx::hmin(value);
        for (int q = 0; q < lanes; ++q)
            if (value[q] == least) where = place[q];
    }
};

// The free energy per unit of z, with derivatives with respect to (r, r', r'').
template <int Order, Added added>
Jet<Pack, 3, Order> energy_density(const Bending& bending, const Loads& loads, const Pack& r, const Pack& r1,
                                   const Pack& r2, ProfilePoint<Jet<Pack, 3, Order>>& p) {
    using J = Jet<Pack, 3, Order>;
    const J radius = J::variable(r, 0);
    p = graph_point(radius, J::variable(r1, 1), J::variable(r2, 2));
    const auto f = density<Pack, added>(bending, p.H.v, p.K.v);
    return p.area * (chain(p.H, p.K, f.f, f.H, f.K, f.HH, f.HK, f.KK) + loads.tension) -
           (pi * loads.pressure) * (radius * radius);
}

}  // namespace

Forms::Forms(const SplineSpace& space, const Bending& bending, const Loads& loads)
    : space_(space), bending_(bending), loads_(loads), images_(space.cell().images()) {
    const int degree = space.degree();
    if (degree != 3 && degree != 5 && degree != 7) throw std::invalid_argument("spline degree must be 3, 5 or 7");
    if (bending.kg != 0) gradients_.emplace(space_);
    auto [pattern, slots] = element_pattern(space.size(), space.elements(), [&](int e) {
        return std::vector<int>(space.dofs(e), space.dofs(e) + space.width());
    });
    pattern_ = std::move(pattern), slots_ = std::move(slots);
    for (int e = 0; e < space.elements(); ++e)
        loss_scale_.push_back(images_ * space.bernoulli_norm() / 4 *
                              std::pow(space.breaks()[e + 1] - space.breaks()[e], 2 * (degree - 1)));
}

template <int P>
[[gnu::flatten]] bool Forms::residual_kernel(const double* x, const double* v, double* out) const {
    const auto kernel = [&]<Added added>() -> bool {
        Pack smallest{std::numeric_limits<double>::infinity()};
        for (int e = 0; e < space_.elements(); ++e) {
            const int* dofs = space_.dofs(e);
            Pack low{0.0}, high{0.0};
            for (int g = 0; g < space_.groups(); ++g) {
                const auto& basis = space_.basis(e, g);
                const Local<P> at(basis, dofs, x);
                smallest = stdx::min(smallest, at.r);
                ProfilePoint<Jet<Pack, 3, 1>> p;
                const auto energy = energy_density<1, added>(bending_, loads_, at.r, at.r1, at.r2, p);
                const Pack weight = load(basis.weight);
                const Pack drag = (2 * pi) * at.r * p.inverse_speed.v * gather<P>(basis, dofs, v);
                // Through memory: a broadcast load is cheaper than taking a lane out of a register.
                alignas(32) double c[3][lanes];
                store(weight * (energy.d[0] + drag), c[0]);
                store(weight * energy.d[1], c[1]);
                store(weight * energy.d[2], c[2]);
                for (int q = 0; q < lanes; ++q) {
                    const auto& s = basis.by_spline[q];
                    for (int d = 0; d < 3; ++d) {
                        low += c[d][q] * load(s[d]);
                        high += c[d][q] * load(s[d] + lanes);
                    }
                }
            }
            alignas(32) double local[wide];
            store(low, local);
            store(high, local + lanes);
            for (int a = 0; a <= P; ++a) out[dofs[a]] += images_ * local[a];
        }
        return stdx::hmin(smallest) > 0;
    };
    return by_added(bending_, kernel);
}

// Adds the matrix of an element, local[column][half of the rows].
template <class Local>
void Forms::scatter(int element, const Local& local, double* values) const {
    constexpr int w = static_cast<int>(std::extent_v<Local>);
    const int* slot = &slots_[static_cast<std::size_t>(element) * w * w];
    alignas(32) double column[wide];
#pragma GCC unroll 8
    for (int b = 0; b < w; ++b) {
        store(local[b][0], column);
        store(local[b][1], column + lanes);
        for (int a = 0; a < w; ++a) values[slot[b * w + a]] += images_ * column[a];
    }
}

template <int P>
[[gnu::flatten]] void Forms::mass_kernel(const double* x, double* values) const {
    for (int e = 0; e < space_.elements(); ++e) {
        const int* dofs = space_.dofs(e);
        Pack local[P + 1][2];
        for (auto& row : local) row[0] = row[1] = Pack(0.0);
        for (int g = 0; g < space_.groups(); ++g) {
            const auto& basis = space_.basis(e, g);
            const Local<P> at(basis, dofs, x);
            alignas(32) double drag[lanes];
            store((2 * pi) * load(basis.weight) * at.r * graph_point(at.r, at.r1, at.r2).inverse_speed, drag);
            for (int q = 0; q < lanes; ++q) {
                const auto& s = basis.by_spline[q];
#pragma GCC unroll 8
                for (int half = 0; half * lanes <= P; ++half) {
                    const Pack column = drag[q] * load(s[0] + half * lanes);
#pragma GCC unroll 8
                    for (int b = 0; b <= P; ++b) local[b][half] += s[0][b] * column;
                }
            }
        }
        scatter(e, local, values);
    }
}

template <int P>
[[gnu::flatten]] void Forms::jacobian_kernel(const double* x, const double* v, double cj, double* values) const {
    const auto kernel = [&]<Added added>() -> void {
        for (int e = 0; e < space_.elements(); ++e) {
            const int* dofs = space_.dofs(e);
            Pack local[P + 1][2];
            for (auto& row : local) row[0] = row[1] = Pack(0.0);
            for (int g = 0; g < space_.groups(); ++g) {
                const auto& basis = space_.basis(e, g);
                const Local<P> at(basis, dofs, x);
                ProfilePoint<Jet<Pack, 3, 2>> p;
                const auto energy = energy_density<2, added>(bending_, loads_, at.r, at.r1, at.r2, p);
                const Pack weight = load(basis.weight), rate = gather<P>(basis, dofs, v);
                // Drag 2 pi (r/g) v and its derivatives in r, r', v.
                const Pack ig = p.inverse_speed.v, drag = (2 * pi) * weight * ig;
                const Pack drag_r = drag * rate, drag_r1 = (2 * pi) * weight * at.r * rate * p.inverse_speed.d[1];
                alignas(32) double c[3][3][lanes];
                store(weight * energy.dd[0] + drag_r + cj * at.r * drag, c[0][0]);
                store(weight * energy.dd[1] + drag_r1, c[0][1]);
                store(weight * energy.dd[1], c[1][0]);
                store(weight * energy.dd[2], c[0][2]);
                store(weight * energy.dd[2], c[2][0]);
                store(weight * energy.dd[3], c[1][1]);
                store(weight * energy.dd[4], c[1][2]);
                store(weight * energy.dd[4], c[2][1]);
                store(weight * energy.dd[5], c[2][2]);
                for (int q = 0; q < lanes; ++q) {
                    const auto& s = basis.by_spline[q];
#pragma GCC unroll 8
                    for (int half = 0; half * lanes <= P; ++half) {
                        Pack column[3];  // c contracted with the splines a, the rows of the local matrix
#pragma GCC unroll 8
                        for (int d = 0; d < 3; ++d) {
                            column[d] = c[0][d][q] * load(s[0] + half * lanes);
                            for (int k = 1; k < 3; ++k) column[d] += c[k][d][q] * load(s[k] + half * lanes);
                        }
#pragma GCC unroll 8
                        for (int b = 0; b <= P; ++b)
                            local[b][half] += s[0][b] * column[0] + s[1][b] * column[1] + s[2][b] * column[2];
                    }
                }
            }
            scatter(e, local, values);
        }
    };
    return by_added(bending_, kernel);
}

bool Forms::residual(const double* x, const double* v, double* out) const {
    std::fill_n(out, space_.size(), 0.0);
    const bool inside = for_degree(space_.degree(), [&](auto P) { return residual_kernel<P()>(x, v, out); });
    if (gradients_) gradients_->add_gradient(bending_.kg, x, out);
    return inside &&
           (bending_.terms.empty() || std::all_of(out, out + space_.size(), [](double y) { return std::isfinite(y); }));
}

void Forms::jacobian(const double* x, const double* v, double cj, double* values) const {
    std::fill_n(values, pattern_.nonZeros(), 0.0);
    for_degree(space_.degree(), [&](auto P) { jacobian_kernel<P()>(x, v, cj, values); });
    if (gradients_) gradients_->add_hessian(bending_.kg, x, slots_, values);
}

void Forms::mass(const double* x, double* values) const {
    std::fill_n(values, pattern_.nonZeros(), 0.0);
    for_degree(space_.degree(), [&](auto P) { mass_kernel<P()>(x, values); });
}

template <int P, class Integrand>
[[gnu::flatten]] double Forms::integral_kernel(const double* x, const Integrand& integrand) const {
    const auto kernel = [&]<Added added>() -> double {
        Pack sum{0.0};
        for (int e = 0; e < space_.elements(); ++e)
            for (int g = 0; g < space_.groups(); ++g) {
                const auto& basis = space_.basis(e, g);
                const Local<P> at(basis, space_.dofs(e), x);
                ProfilePoint<Jet<Pack, 3, 1>> p;
                const auto f = energy_density<1, added>(bending_, loads_, at.r, at.r1, at.r2, p);
                sum += load(basis.weight) * integrand(f, at);
            }
        return images_ * stdx::reduce(sum);
    };
    return by_added(bending_, kernel);
}

double Forms::free_energy(const Eigen::VectorXd& x) const {
    const auto density = [](const auto& f, const auto&) { return f.v; };
    const double energy = for_degree(space_.degree(), [&](auto P) { return integral_kernel<P()>(x.data(), density); });
    return gradients_ ? energy + bending_.kg * gradients_->value(x.data()) : energy;
}

double Forms::axial_force(const Eigen::VectorXd& x) const {
    const auto slope = [](const auto& f, const auto& at) { return f.v - at.r1 * f.d[1] - 2 * at.r2 * f.d[2]; };
    const double force = for_degree(space_.degree(), [&](auto P) { return integral_kernel<P()>(x.data(), slope); }),
                 more = gradients_ ? bending_.kg * gradients_->stretch_slope(x.data()) : 0;
    return (force + more) / space_.cell().period();
}

Eigen::VectorXd Forms::gradient(const Eigen::VectorXd& x) const {
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(x.size());
    Eigen::VectorXd out(x.size());
    residual(x.data(), rest.data(), out.data());
    return out;
}

Eigen::SparseMatrix<double> Forms::hessian(const Eigen::VectorXd& x) const {
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(x.size());
    Eigen::SparseMatrix<double> out = pattern_;
    jacobian(x.data(), rest.data(), 0, out.valuePtr());
    return out;
}

Eigen::SparseMatrix<double> Forms::mass(const Eigen::VectorXd& x) const {
    Eigen::SparseMatrix<double> out = pattern_;
    mass(x.data(), out.valuePtr());
    return out;
}

Eigen::VectorXd Forms::rate(const Eigen::VectorXd& x) const {
    BandLu lu(pattern_);
    lu.factor(mass(x).valuePtr());
    return lu.solved(-gradient(x));
}

template <int P>
[[gnu::flatten]] Observation Forms::observe_kernel(const double* x, const double* v, double* stiffness) const {
    const auto kernel = [&]<Added added>() -> Observation {
        Observation o;
        Least neck, belly, steepest, symbol, symbol_3d;
        Pack dissipation{0.0}, area{0.0}, volume{0.0}, listed[n_bending_terms];
        for (Pack& term : listed) term = Pack(0.0);
        std::vector<Pack> more(bending_.terms.size(), Pack(0.0));
        for (int e = 0; e < space_.elements(); ++e) {
            if (stiffness) stiffness[e] = 0;
            for (int g = 0; g < space_.groups(); ++g) {
                const auto& basis = space_.basis(e, g);
                const Local<P> at(basis, space_.dofs(e), x);
                const auto p = graph_point(at.r, at.r1, at.r2);
                const Pack weight = load(basis.weight), rate = gather<P>(basis, space_.dofs(e), v);
                const Pack dA = weight * p.area;
                area += dA;
                volume += pi * weight * at.r * at.r;
                dissipation += (2 * pi) * weight * at.r * p.inverse_speed * rate * rate;
                for_each_value<Pack, added>(bending_, p.H, p.K, [&](std::size_t i, const Pack& value) {
                    (i < n_bending_terms ? listed[i] : more[i - n_bending_terms]) += value * dA;
                });
                const auto f = density<Pack, added>(bending_, p.H, p.K);
                const Pack s = principal_symbol(f, p.kappa_theta), steep = stdx::abs(at.r1) / at.r;
                const Pack low = stdx::min(p.kappa_s, p.kappa_theta), high = stdx::max(p.kappa_s, p.kappa_theta);
                const Pack z = load(basis.z);
                neck.look(at.r, z), belly.look(-at.r, z), steepest.look(-steep, z);
                if (!gradients_) symbol.look(s, z), symbol_3d.look(least_principal_symbol(f, low, high), z);
                if (stiffness) {
                    const Pack ig2 = p.inverse_speed * p.inverse_speed;
                    stiffness[e] += stdx::reduce(dA * ig2 * ig2 * ig2 * stdx::abs(s));
                }
                if (!gradients_) continue;
                for (int q = 0; q < lanes; ++q) {
                    if (s[q] >= 0) continue;
                    const double size = (space_.breaks()[e + 1] - space_.breaks()[e]) / p.inverse_speed[q],
                                 coarse = size * std::sqrt(-s[q] / (2 * bending_.kg));
                    if (coarse > o.coarse) o.coarse = coarse, o.z_coarse = basis.z[q];
                }
            }
        }
        neck.find(o.r_min, o.z_min), belly.find(o.r_max, o.z_max), steepest.find(o.steepness, o.z_steep);
        symbol.find(o.symbol, o.z_symbol);
        o.symbol_3d = stdx::hmin(symbol_3d.value);
        o.r_max = -o.r_max;
        o.steepness *= -o.r_min;
        o.area = images_ * stdx::reduce(area);
        o.volume = images_ * stdx::reduce(volume);
        o.dissipation = images_ * stdx::reduce(dissipation);
        o.energy_term.reserve(count_terms(bending_));
        for (const Pack& term : listed) o.energy += o.energy_term.emplace_back(images_ * stdx::reduce(term));
        for (const Pack& term : more) o.energy += o.energy_term.emplace_back(images_ * stdx::reduce(term));
        return o;
    };
    return by_added(bending_, kernel);
}

Observation Forms::observe(const double* x, const double* v, std::vector<double>* mesh_loss) const {
    double* stiffness = nullptr;
    if (mesh_loss) {
        mesh_loss->resize(space_.elements());
        stiffness = mesh_loss->data();
    }
    Observation o = for_degree(space_.degree(), [&](auto P) { return observe_kernel<P()>(x, v, stiffness); });
    std::vector<double> of_gradients;
    if (gradients_) o.energy += o.energy_kg = bending_.kg * gradients_->value(x, mesh_loss ? &of_gradients : nullptr);
    o.free_energy = o.energy + loads_.energy(o.area, o.volume, 0);
    o.domain = domain(x);
    if (!mesh_loss) return o;
    const std::vector<double> jump = space_.top_jumps(x);
    for (int e = 0; e < space_.elements(); ++e) {
        double& loss = (*mesh_loss)[e] *= loss_scale_[e];
        if (gradients_)
            loss += bending_.kg * space_.bernoulli_norm_of_third() / 4 * of_gradients[e] *
                    std::pow(space_.breaks()[e + 1] - space_.breaks()[e], 2 * (space_.degree() - 2));
        loss *= jump[e] * jump[e] + jump[e + 1] * jump[e + 1];
    }
    return o;
}

FormulaDomain::Margin Forms::domain(const double* x) const {
    DensityDomain domain(bending_);
    if (!domain.restricted()) return {};
    for (int e = 0; e < space_.elements(); ++e)
        for (int g = 0; g < space_.groups(); ++g)
            for (const double z : space_.basis(e, g).z) {
                const auto [r, r1, r2] = space_.evaluate(x, e, z);
                const auto p = graph_point(r, r1, r2);
                domain.look(bending_.H0, p.H, p.K, z);
            }
    return domain.margin();
}

double Forms::reference_energy(const Eigen::VectorXd& x) const {
    double magnitude = 0;
    for (int e = 0; e < space_.elements(); ++e)
        for (int g = 0; g < space_.groups(); ++g)
            for (int q = 0; q < lanes; ++q) {
                const auto& basis = space_.basis(e, g);
                const auto [r, r1, r2] = space_.evaluate(x.data(), e, basis.z[q]);
                const auto p = graph_point(r, r1, r2);
                magnitude += tubule::magnitude(bending_, p.H, p.K) * p.area * basis.weight[q];
            }
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(x.size());
    const Observation o = observe(x.data(), rest.data());
    return std::max(std::abs(o.free_energy), images_ * magnitude + o.energy_kg + loads_.scale(o.area, o.volume, 0));
}

std::array<Eigen::VectorXd, 2> Forms::mode(int n) const {
    const Cell& cell = space_.cell();
    std::array<Eigen::VectorXd, 2> out{Eigen::VectorXd::Zero(space_.size()), Eigen::VectorXd::Zero(space_.size())};
    if (n % cell.copies != 0) return out;  // the cells cancel each other
    const double q0 = 2 * pi * n / cell.period(), scale = (n == 0 ? 1 : 2) * images_ / cell.period();
    for (int e = 0; e < space_.elements(); ++e)
        for (int g = 0; g < space_.groups(); ++g)
            for (int q = 0; q < lanes; ++q) {
                const auto& basis = space_.basis(e, g);
                const double phase = q0 * (basis.z[q] - cell.z0), weight = scale * basis.weight[q];
                for (int a = 0; a < space_.width(); ++a) {
                    out[0][space_.dofs(e)[a]] += weight * std::cos(phase) * basis.by_spline[q][0][a];
                    // The mirror image of a sine cancels it.
                    if (!cell.mirror) out[1][space_.dofs(e)[a]] += weight * std::sin(phase) * basis.by_spline[q][0][a];
                }
            }
    return out;
}

}  // namespace tubule::axisym
