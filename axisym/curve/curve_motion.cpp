#include "axisym/curve/curve_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "axisym/splines/element_pattern.hpp"
#include "axisym/splines/pack.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/solve/sparse.hpp"

namespace tubule::axisym {

// Those that the law has at every point: unknowns, and the tension of a reservoir.
struct PointNumbers {
    double drift = 0, shift = 0, supply = 0, stretch = 0, tension = 0, time = 0;
};

namespace {

namespace stdx = std::experimental;
constexpr int lanes = SplineSpace::lanes;
constexpr int wide = SplineSpace::max_width;

enum FieldName { curve_r, curve_z, velocity_r, velocity_z, swirl, pressure, n_fields };

// What enters the law at a point: values and first derivatives of the fields. (The energy is added by CurveForms.)
enum Slot { r0, r1, z0, z1, ur0, ur1, uz0, uz1, w0, w1, p0, n_slots };
constexpr std::array<int, n_slots> slot_field{curve_r,    curve_r,    curve_z, curve_z, velocity_r, velocity_r,
                                              velocity_z, velocity_z, swirl,   swirl,   pressure};
constexpr std::array<int, n_slots> slot_derivative{0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0};

// The result: factors of test functions and their derivatives, and integrals.
enum Row { kr, kz, mr0, mr1, mz0, mz1, sw0, sw1, continuity, drift_sum, shift_sum, stretch_sum, supply_sum, n_rows };
constexpr int n_test_rows = drift_sum;
constexpr std::array<int, n_test_rows> row_field{curve_r,    curve_z, velocity_r, velocity_r, velocity_z,
                                                 velocity_z, swirl,   swirl,      pressure};
constexpr std::array<int, n_test_rows> row_derivative{0, 0, 0, 1, 0, 1, 0, 1, 0};

// The fields at a point; S is a pack of points or a jet of it. Rates are of the parameter's points, X_t at fixed s.
template <class S>
struct PointFields {
    std::array<S, n_slots> v;
    S r_t, z_t, ur_t, uz_t, w_t;
    S climb;  // what the rise of a tube adds to z
};

// The law per unit of s, except the energy, the gauge and the volume. Long: a line for each term.
template <class S>
std::array<S, n_rows> point_law(const PointFields<S>& f, const CurveLaw& law, const PointNumbers& n) {
    const double drift = n.drift, shift = n.shift;
    const S &r = f.v[r0], &r_s = f.v[r1], &z_s = f.v[z1];
    const S g2 = r_s * r_s + z_s * z_s, ig2 = inverse(g2), ig = inverse_sqrt(g2);
    std::array<S, n_rows> out;
    for (S& x : out) x = S(0.0);
    const S z_t = f.z_t - n.stretch * f.v[z0];  // less the motion of the stretching
    const S place[]{r, f.v[z0] + f.climb, S(n.time)};
    const bool pushed = law.source.push();
    const S push_r = pushed ? law.source.force_at(0, place) : S(0.0),
            push_z = pushed ? law.source.force_at(2, place) : S(0.0);
    if (!law.inextensible && law.lagrangian) {
        const S dS = (2 * pi) * (r * (g2 * ig));
        const S across = (push_r * z_s - push_z * r_s) * ig2;  // along the membrane nothing moves points
        out[kr] = dS * (f.r_t - across * z_s), out[kz] = dS * (f.z_t + across * r_s);
        return out;
    }
    if (!law.inextensible) {
        // (X_t - push).nu dS/g
        const S rate = (2 * pi) * (r * ((f.r_t - push_r) * z_s - (z_t - push_z) * r_s));
        out[kr] = rate * z_s * ig + shift * (2 * pi) * (r * r_s);
        out[kz] = shift * (2 * pi) * (r * z_s) - rate * r_s * ig;
        out[shift_sum] = (2 * pi) * (r * (f.r_t * r_s + z_t * z_s));
        return out;
    }
    const S &u = f.v[ur0], &v = f.v[uz0], &w = f.v[w0], &p = f.v[p0];
    const S inverse_r = inverse(r), dS = (2 * pi) * (r * (g2 * ig));
    const S dr = f.r_t - u, dz = z_t - v;
    const S across = (2 * pi) * (r * ((dr * z_s - dz * r_s) * ig));  // (X_t - u).nu dS/g
    const S along = (2 * pi) * (r * (dr * r_s + dz * z_s));          // (X_t - u).t dS
    if (law.lagrangian) {
        out[kr] = dS * dr, out[kz] = dS * dz;
    } else {
        out[kr] = across * z_s + shift * (2 * pi) * (r * r_s);
        out[kz] = shift * (2 * pi) * (r * z_s) - across * r_s;
    }
    out[shift_sum] = along;
    out[drift_sum] = dS * v;

    const S stretch_s = (r_s * f.v[ur1] + z_s * (f.v[uz1] + n.stretch * z_s)) * ig2, stretch_theta = u * inverse_r;
    const S divergence = stretch_s + stretch_theta, source = law.source.mass ? law.source.mass_at(place) : S(0.0);
    S force_r = law.friction * u - p * inverse_r + (2 * law.viscosity) * (stretch_theta * inverse_r) - push_r;
    S force_z = law.friction * v + drift - push_z;
    const S tension = ((2 * law.viscosity) * stretch_s - p) * ig2;
    if (law.inertia != 0) {
        // What a reservoir or a source feeds has the velocity of the membrane at every point: only the pressure sees
        // it.
        const S half = law.reservoir && !law.open_rim ? S(0.0) : 0.5 * (divergence - source),
                advect = -((dr * r_s + dz * z_s) * ig2);  // (u - X_t).t/g
        force_r += law.inertia * (f.ur_t + advect * f.v[ur1] + half * u - w * w * inverse_r);
        force_z += law.inertia * (f.uz_t + advect * f.v[uz1] + half * v);
        if (law.swirls) {
            const S shear = 0.5 * (ig * (f.v[w1] - w * r_s * inverse_r));
            const S viscous = (2 * law.viscosity) * (shear * ig);
            out[sw0] = dS * (law.inertia * (f.w_t + advect * f.v[w1] + half * w + u * w * inverse_r) +
                             law.friction * w - viscous * r_s * inverse_r - law.source.force_at(1, place));
            out[sw1] = dS * viscous;
        }
    }
    out[mr0] = dS * force_r;
    out[mz0] = dS * force_z;
    out[mr1] = dS * tension * r_s;
    out[mz1] = dS * tension * z_s;
    out[continuity] = -(dS * (divergence - source - n.supply));
    out[stretch_sum] = out[mz1] * z_s;
    out[supply_sum] = dS * (p + n.tension);
    return out;
}

}  // namespace

// Values at the points of one group of an element.
struct CurveMotion::Local {
    PointFields<Pack> fields;

    Local(const CurveMotion& m, int e, int g, const double* y, const double* rate) {
        for (Pack& value : fields.v) value = Pack(0.0);
        Pack rates[n_fields];
        for (int part = 0; part < n_fields; ++part) {
            rates[part] = Pack(0.0);
            const auto& [field, offset] = m.parts_[part];
            if (offset < 0) continue;
            const auto& b = field->basis(e, g);
            const int *dofs = field->dofs(e), slot = first_slot(part);
            const double* signs = field->signs(e);
            for (int a = 0; a < m.width(part); ++a) {
                const double c = signs[a] * y[offset + dofs[a]];
                fields.v[slot] += c * load(b.by_point[0][a]);
                if (part == pressure) continue;
                fields.v[slot + 1] += c * load(b.by_point[1][a]);
                rates[part] += signs[a] * rate[offset + dofs[a]] * load(b.by_point[0][a]);
            }
        }
        const double rise = m.space().rise(y);
        fields.v[z1] += rise, fields.climb = rise * load(m.space().splines().basis(e, g).z);
        fields.r_t = rates[curve_r], fields.z_t = rates[curve_z];
        fields.ur_t = rates[velocity_r], fields.uz_t = rates[velocity_z], fields.w_t = rates[swirl];
    }

    static int first_slot(int part) { return 2 * part; }

    // The same as jets in the slots; rates depend on the values of their fields by cj.
    template <class J>
    PointFields<J> jets(double cj) const {
        PointFields<J> out;
        for (int i = 0; i < n_slots; ++i) out.v[i] = J::variable(fields.v[i], i);
        const auto rate = [&](const Pack& value, int slot) {
            J x;
            x.v = value;
            x.d[slot] = Pack(cj);
            return x;
        };
        out.r_t = rate(fields.r_t, r0), out.z_t = rate(fields.z_t, z0);
        out.climb = J(0.0), out.climb.v = fields.climb;
        out.ur_t = rate(fields.ur_t, ur0), out.uz_t = rate(fields.uz_t, uz0), out.w_t = rate(fields.w_t, w0);
        return out;
    }
};

CurveMotion::CurveMotion(const CurveSpace& space, const Bending& bending, const CurveLaw& law, double gauge,
                         double area, double volume)
    : forms_(space, bending),
      law_(law),
      gauge_(law.lagrangian ? 0 : gauge),
      area0_(area),
      volume0_(volume),
      pressure_(space.splines().cell(), space.splines().breaks(), space.splines().degree() - 1,
                std::min(space.splines().smoothness(), space.splines().degree() - 2)) {
    int size = 0;
    const auto add = [&](bool present, int length) {
        if (!present) return -1;
        size += length;
        return size - length;
    };
    at_.r = add(true, space.r().size());
    at_.z = add(true, space.z().size());
    at_.rise = add(space.free_period(), 1);
    at_.u_r = add(law.inextensible, space.r().size());
    at_.u_z = add(law.inextensible, space.z().size());
    at_.swirl = add(law.inextensible && law.swirls, space.r().size());
    at_.p = add(law.inextensible, pressure_.size());
    at_.tension = add(law.keeps_area, 1);
    at_.supply = add(law.reservoir && !law.open_rim, 1);
    at_.stretch = add(space.free_period(), 1);
    at_.lambda = add(law.keeps_volume || law.pressure_of_volume, 1);
    at_.area = add(law.inextensible && law.holds_area, 1);
    at_.volume = add(law.inextensible && law.keeps_volume && law.holds_volume, 1);
    const bool held = law.inertia != 0 || law.friction != 0 || space.images() == 2 || space.is_patch();
    at_.drift = add(law.inextensible && !held, 1);
    at_.mu = add(bending.alpha.has_value(), 1);
    at_.bead = add(law.beads.has_value(), 4);
    at_.reach = add(law.inertia != 0 && law.beads && law.beads->extension, 1);
    const int ends = space.topology() == Topology::strip ? 2 : 1, conditions = ends * (law.rim == Rim::clamped ? 3 : 2);
    at_.rim = add(space.is_patch(), conditions);
    if (law.open_rim)
        for (int end = 0; end < ends; ++end) open_rims_.emplace_back(space, end, law.rim);
    const int flow_conditions = !law.inextensible ? 0 : law.open_rim ? conditions - ends : conditions;
    at_.rim_flow = add(space.is_patch() && law.inextensible, flow_conditions);
    at_.shift = add(space.topology() == Topology::tube && !law.lagrangian, 1);
    at_.size = size;
    for (const int number : {at_.rise, at_.tension, at_.supply, at_.stretch, at_.lambda, at_.area, at_.volume,
                             at_.drift, at_.mu, at_.reach, at_.shift})
        if (number >= 0) numbers_.push_back(number);
    for (int i = 0; i < 4 && at_.bead >= 0; ++i) numbers_.push_back(at_.bead + i);
    for (int i = 0; i < conditions && at_.rim >= 0; ++i) {
        numbers_.push_back(at_.rim + i);
        if (i < flow_conditions) numbers_.push_back(at_.rim_flow + i);
    }
    if (law.beads && !space.is_patch()) beads_.emplace(space, law.beads->width);
    parts_ = {{&space.r(), at_.r},   {&space.z(), at_.z},     {&space.r(), at_.u_r},
              {&space.z(), at_.u_z}, {&space.r(), at_.swirl}, {&pressure_, at_.p}};
    set_pattern();
}

int CurveMotion::slot_of(int row, int column) const {
    return tubule::axisym::slot_of(pattern_, row, column);
}

void CurveMotion::set_pattern() {
    for (int part = 0; part < n_fields; ++part) local_size_ += parts_[part].offset < 0 ? 0 : width(part);
    const auto local_dofs = [&](int e) {  // -1: absent
        std::vector<int> dofs;
        for (int part = 0; part < n_fields; ++part) {
            const auto& [field, offset] = parts_[part];
            for (int a = 0; offset >= 0 && a < width(part); ++a)
                dofs.push_back(field->signs(e)[a] == 0 ? -1 : offset + field->dofs(e)[a]);
        }
        return dofs;
    };
    auto [pattern, slots] = element_pattern(at_.size, space().splines().elements(), local_dofs, numbers_);
    pattern_ = std::move(pattern), slots_ = std::move(slots);
    const Eigen::SparseMatrix<double>& of_forms = forms_.pattern();
    for (int column = 0; column < of_forms.cols(); ++column)
        for (Eigen::SparseMatrix<double>::InnerIterator it(of_forms, column); it; ++it) {
            const bool of_rise = it.row() == at_.rise;  // that derivative has no row of its own
            curve_slots_.push_back(of_rise ? -1 : slot_of(at_.r + it.row(), column));
            momentum_slots_.push_back(law_.inextensible && !of_rise ? slot_of(at_.u_r + it.row(), column) : -1);
        }
    for (const int number : numbers_) {
        std::vector<int>& row = number_rows_[number];
        for (int i = 0; i < at_.size; ++i) row.push_back(slot_of(number, i));
    }
}

Eigen::VectorXd CurveMotion::differential() const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(at_.size);
    out.head(space().size()).setOnes();
    if (law_.inertia != 0) out.segment(at_.u_r, (at_.p >= 0 ? at_.p : at_.size) - at_.u_r).setOnes();
    return out;
}

PointNumbers CurveMotion::point_numbers(double t, const double* y) const {
    const auto number = [&](int at) { return at < 0 ? 0.0 : y[at]; };
    return {number(at_.drift), number(at_.shift), number(at_.supply), number(at_.stretch), law_.tension.at(t), t};
}

// Weights of the forces on the membrane.
Weights CurveMotion::force_weights(double t, const double* y) const {
    const Loads loads = loads_at(law_, t);
    const double tension = at_.tension < 0 ? loads.tension : y[at_.tension];
    return {.energy = 1,
            .area = law_.inextensible ? 0 : tension,
            .volume = at_.lambda < 0 ? -loads.pressure : y[at_.lambda],
            .M = at_.mu < 0 ? 0 : y[at_.mu]};
}

void CurveMotion::set_followers(Eigen::VectorXd& y) const {
    if (at_.mu >= 0) y[at_.mu] = area_difference_force(forms_.bending(), forms_.M(y.data()));
    if (at_.bead >= 0) y.segment<4>(at_.bead) = beads_->numbers(y.data(), bead_load(0).force);
}

BeadLoad CurveMotion::bead_load(double t) const {
    if (!law_.beads->extension) return {.force = law_.force.at(t)};
    return {.distance = bead_distance0_ + law_.beads->extension->at(t)};
}

double CurveMotion::length(const double* y) const {
    return at_.bead < 0 ? space().length(y) : BeadEquations::distance(bead_numbers(y));
}

double CurveMotion::lengthening(const double* y, const double* rate) const {
    if (at_.bead >= 0)
        return beads_->equations()
            .distance_slope(beads_->on(y), bead_numbers(y))
            .dot(Eigen::Map<const Eigen::VectorXd>(rate, space().size()));
    return law_.free_period ? space().images() * rate[at_.rise] : 0;
}

// Weights of the velocity that moves the curve in addition to the flow.
Weights CurveMotion::drift_weights(const double* y) const {
    return {.area = at_.area < 0 ? 0 : y[at_.area], .volume = at_.volume < 0 ? 0 : y[at_.volume], .gauge = gauge_};
}

// The displacement z e_z, as coefficients of a curve.
Eigen::VectorXd CurveMotion::stretched(const double* y) const {
    Eigen::VectorXd out = Eigen::Map<const Eigen::VectorXd>(y, space().size());
    out.head(space().r().size()).setZero();
    return out;
}

bool CurveMotion::residual(double t, const double* y, const double* rate, double* F) const {
    std::fill_n(F, at_.size, 0.0);
    const SplineSpace& splines = space().splines();
    const double images = space().images();
    const PointNumbers numbers = point_numbers(t, y);
    Pack smallest{std::numeric_limits<double>::infinity()}, area{0.0}, volume{0.0}, sums[n_rows];
    for (Pack& sum : sums) sum = Pack(0.0);
    for (int e = 0; e < splines.elements(); ++e)
        for (int g = 0; g < splines.groups(); ++g) {
            const auto& basis = splines.basis(e, g);
            const Pack weight = images * load(basis.weight);
            const Local at(*this, e, g, y, rate);
            const auto& f = at.fields;
            smallest = stdx::min(smallest, f.v[r0]);
            area += weight * (2 * pi) * f.v[r0] * sqrt(f.v[r1] * f.v[r1] + f.v[z1] * f.v[z1]);
            volume += weight * pi * f.v[r0] * f.v[r0] * f.v[z1];
            const std::array<Pack, n_rows> rows = point_law(f, law_, numbers);
            for (int row = 0; row < n_test_rows; ++row) {
                const int part = row_field[row], offset = parts_[part].offset;
                if (offset < 0) continue;
                const SplineSpace& field = *parts_[part].field;
                const auto& tests = field.basis(e, g);
                alignas(32) double c[lanes];
                store(weight * rows[row], c);
                for (int a = 0; a < width(part); ++a) {
                    double sum = 0;
                    for (int q = 0; q < lanes; ++q) sum += c[q] * tests.by_spline[q][row_derivative[row]][a];
                    F[offset + field.dofs(e)[a]] += field.signs(e)[a] * sum;
                }
            }
            for (int row = n_test_rows; row < n_rows; ++row) sums[row] += weight * rows[row];
        }
    for (int row = n_test_rows; row < n_rows; ++row)
        if (const int at = number_of(row); at >= 0) F[at] = stdx::reduce(sums[row]);
    if (!(stdx::hmin(smallest) > 0)) return false;

    // Added where the other forces are: rounding is what keeps weakly damped waves of a fluid alive.
    const auto add_gradient = [&](const Weights& weights, double* rows) {
        const int n = space().shape_size();
        if (at_.rise < 0)
            forms_.add_gradient(weights, y, rows);
        else  // whose derivative has no row here
            Eigen::Map<Eigen::VectorXd>(rows, n) += gradient_at(weights, y).head(n);
    };
    add_gradient(force_weights(t, y), law_.inextensible ? F + at_.u_r : F);
    add_gradient(drift_weights(y), F);
    if (slides()) forms_.add_sliding(y, F);
    set_numbers(t, y, stdx::reduce(area), stdx::reduce(volume), F);
    if (at_.bead >= 0) {
        beads_->add_force(y, bead_numbers(y), law_.inextensible ? F + at_.u_r : F);
        Eigen::Map<BeadNumbers>(F + at_.bead) =
            beads_->equations().residual(beads_->on(y), bead_load(t), bead_numbers(y));
        if (at_.reach >= 0) hold_reach(t, y, F);
    }
    if (at_.rim >= 0) hold_rim(t, y, F);
    if (at_.stretch < 0) return true;
    F[at_.rise] = rate[at_.rise] - y[at_.stretch] * y[at_.rise];
    F[at_.stretch] += gradient_at(force_weights(t, y), y).dot(stretched(y)) - law_.force.at(t) * space().length(y);
    return true;
}

// The equations of the multipliers of area and volume, and of mu, of a curve with this area and volume.
void CurveMotion::set_numbers(double t, const double* y, double area, double volume, double* F) const {
    const double A = area - area0_, V = volume - volume0_;
    if (at_.area >= 0) F[at_.area] = A;
    if (at_.tension >= 0) F[at_.tension] = A;
    if (at_.volume >= 0) F[at_.volume] = V;
    if (at_.lambda >= 0 && !law_.keeps_volume)
        F[at_.lambda] = y[at_.lambda] + loads_at(law_, t).pressure_at(volume);
    else if (at_.lambda >= 0 && !law_.inextensible)
        F[at_.lambda] = V;
    else if (at_.lambda >= 0)
        F[at_.lambda] = gradient_at({.volume = 1}, y).dot(velocity(y));
    if (at_.mu >= 0) F[at_.mu] = y[at_.mu] - area_difference_force(forms_.bending(), forms_.M(y));
}

// The whole velocity, as the rates of a curve.
Eigen::VectorXd CurveMotion::velocity(const double* y) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(space().size());
    if (at_.stretch >= 0) out = y[at_.stretch] * stretched(y);
    out.head(space().shape_size()) += Eigen::Map<const Eigen::VectorXd>(y + at_.u_r, space().shape_size());
    return out;
}

int CurveMotion::number_of(int row) const {
    return row == drift_sum ? at_.drift : row == shift_sum ? at_.shift : row == stretch_sum ? at_.stretch : at_.supply;
}

Eigen::VectorXd CurveMotion::gradient_at(const Weights& weights, const double* y) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(space().size());
    forms_.add_gradient(weights, y, out.data());
    return out;
}

void CurveMotion::jacobian(double t, const double* y, const double* rate, double cj, double* values) const {
    std::fill_n(values, pattern_.nonZeros(), 0.0);
    add_law(t, y, rate, cj, values);
    add_forms(t, y, values);
    add_numbers(y, values);
    if (at_.bead >= 0) add_beads(t, y, values);
    if (at_.rim >= 0) add_rim(t, y, values);
    if (at_.stretch >= 0) add_stretch(t, y, cj, values);
}

// What point_law() has.
void CurveMotion::add_law(double t, const double* y, const double* rate, double cj, double* values) const {
    using J = Jet<Pack, n_slots, 1>;
    const SplineSpace& splines = space().splines();
    const double images = space().images();
    const PointNumbers numbers = point_numbers(t, y);
    Eigen::MatrixXd local(local_size_, local_size_);
    std::array<int, n_fields> first{};  // of each part in the local matrix
    for (int part = 0, next = 0; part < n_fields; ++part) {
        first[part] = next;
        next += parts_[part].offset < 0 ? 0 : width(part);
    }
    for (int e = 0; e < splines.elements(); ++e) {
        local.setZero();
        for (int g = 0; g < splines.groups(); ++g) {
            const Pack weight = images * load(splines.basis(e, g).weight);
            const Local at(*this, e, g, y, rate);
            const std::array<J, n_rows> rows = point_law(at.jets<J>(cj), law_, numbers);
            for (int row = 0; row < n_test_rows; ++row) {
                const int test = row_field[row];
                if (parts_[test].offset < 0) continue;
                const auto& tests = parts_[test].field->basis(e, g);
                for (int slot = 0; slot < n_slots; ++slot) {
                    const int trial = slot_field[slot];
                    if (parts_[trial].offset < 0) continue;
                    const auto& trials = parts_[trial].field->basis(e, g);
                    alignas(32) double c[lanes];
                    store(weight * rows[row].d[slot], c);
                    if (c[0] == 0 && c[1] == 0 && c[2] == 0 && c[3] == 0) continue;
                    for (int q = 0; q < lanes; ++q)
                        for (int b = 0; b < width(trial); ++b) {
                            const double factor = c[q] * trials.by_spline[q][slot_derivative[slot]][b];
                            for (int a = 0; a < width(test); ++a)
                                local(first[test] + a, first[trial] + b) +=
                                    factor * tests.by_spline[q][row_derivative[row]][a];
                        }
                }
            }
            for (int row = n_test_rows; row < n_rows; ++row)
                if (const int number = number_of(row); number >= 0)
                    add_row(number, e, g, weight, rows[row].d.data(), values);
            const auto& f = at.fields;
            const Pack dS = (2 * pi) * f.v[r0] * sqrt(f.v[r1] * f.v[r1] + f.v[z1] * f.v[z1]);
            if (at_.drift >= 0) add_column(at_.drift, velocity_z, e, g, weight * dS, values);
            if (at_.supply >= 0) add_column(at_.supply, pressure, e, g, weight * dS, values);
            if (at_.shift >= 0) {
                add_column(at_.shift, curve_r, e, g, weight * (2 * pi) * f.v[r0] * f.v[r1], values);
                add_column(at_.shift, curve_z, e, g, weight * (2 * pi) * f.v[r0] * f.v[z1], values);
            }
            if (at_.stretch >= 0) add_free_period(e, g, numbers, at, cj, values);
        }
        scatter(e, local, values);
    }
}

// The derivatives of the law in the rise and in its rate of stretching.
void CurveMotion::add_free_period(int e, int g, const PointNumbers& numbers, const Local& at, double cj,
                                  double* values) const {
    using J = Jet<Pack, n_slots, 1>;
    const Pack weight = space().images() * load(space().splines().basis(e, g).weight);
    const std::array<J, n_rows> rows = point_law(at.jets<J>(cj), law_, numbers);
    PointNumbers longer = numbers;  // the law is affine in the stretching
    longer.stretch += 1;
    const std::array<Pack, n_rows> after = point_law(at.fields, law_, longer);
    std::array<Pack, n_rows> by_rise, by_stretch;
    for (int row = 0; row < n_rows; ++row) {
        by_rise[row] = weight * rows[row].d[z1];
        by_stretch[row] = weight * (after[row] - rows[row].v);
    }
    add_test_column(at_.rise, e, g, by_rise, values);
    add_test_column(at_.stretch, e, g, by_stretch, values);
}

// The derivatives of all rows of the law in a number.
template <class Rows>
void CurveMotion::add_test_column(int number, int e, int g, const Rows& rows, double* values) const {
    double* column = values + pattern_.outerIndexPtr()[number];
    for (int row = 0; row < n_test_rows; ++row) {
        const auto& [field, offset] = parts_[row_field[row]];
        if (offset < 0) continue;
        const auto& basis = field->basis(e, g);
        for (int a = 0; a < width(row_field[row]); ++a)
            column[offset + field->dofs(e)[a]] +=
                field->signs(e)[a] * stdx::reduce(rows[row] * load(basis.by_point[row_derivative[row]][a]));
    }
    for (int row = n_test_rows; row < n_rows; ++row)
        if (const int at = number_of(row); at >= 0) column[at] += stdx::reduce(rows[row]);
}

// d(sum of a row of numbers)/dy, from its derivatives in the slots.
template <class Packs>
void CurveMotion::add_row(int number, int e, int g, const Packs& weight, const Packs* in_slots, double* values) const {
    const std::vector<int>& row = number_rows_.at(number);
    for (int slot = 0; slot < n_slots; ++slot) {
        const auto& [field, offset] = parts_[slot_field[slot]];
        if (offset < 0) continue;
        const auto& basis = field->basis(e, g);
        alignas(32) double c[lanes];
        store(weight * in_slots[slot], c);
        for (int q = 0; q < lanes; ++q)
            for (int a = 0; a < width(slot_field[slot]); ++a)
                values[row[offset + field->dofs(e)[a]]] +=
                    field->signs(e)[a] * c[q] * basis.by_spline[q][slot_derivative[slot]][a];
    }
}

// dF/d(number), against the test functions of one part.
template <class Packs>
void CurveMotion::add_column(int number, int part, int e, int g, const Packs& factor, double* values) const {
    const auto& [field, offset] = parts_[part];
    if (offset < 0) return;
    const auto& basis = field->basis(e, g);
    double* column = values + pattern_.outerIndexPtr()[number];
    alignas(32) double c[lanes];
    store(factor, c);
    for (int q = 0; q < lanes; ++q)
        for (int a = 0; a < width(part); ++a)
            column[offset + field->dofs(e)[a]] += field->signs(e)[a] * c[q] * basis.by_spline[q][0][a];
}

void CurveMotion::scatter(int e, const Eigen::MatrixXd& local, double* values) const {
    Eigen::VectorXd signs(local_size_);
    int next = 0;
    for (int part = 0; part < n_fields; ++part)
        for (int a = 0; parts_[part].offset >= 0 && a < width(part); ++a)
            signs[next++] = parts_[part].field->signs(e)[a];
    const int* slot = &slots_[static_cast<std::size_t>(e) * local_size_ * local_size_];
    for (int b = 0; b < local_size_; ++b)
        for (int a = 0; a < local_size_; ++a) values[slot[b * local_size_ + a]] += signs[a] * signs[b] * local(a, b);
}

// Contributions of the energy and the gauge.
void CurveMotion::add_forms(double t, const double* y, double* values) const {
    std::vector<double> entries(forms_.pattern().nonZeros());
    const auto add = [&](const Weights& weights, const std::vector<int>& slots) {
        std::fill(entries.begin(), entries.end(), 0.0);
        forms_.add_hessian(weights, y, entries.data());
        for (std::size_t i = 0; i < entries.size(); ++i)
            if (slots[i] >= 0) values[slots[i]] += entries[i];
    };
    add(force_weights(t, y), law_.inextensible ? momentum_slots_ : curve_slots_);
    add(drift_weights(y), curve_slots_);
    if (!slides()) return;
    std::fill(entries.begin(), entries.end(), 0.0);
    forms_.add_sliding_slopes(y, entries.data());
    for (std::size_t i = 0; i < entries.size(); ++i) values[curve_slots_[i]] += entries[i];
}

// Contributions of the multipliers of area and volume, and of mu.
void CurveMotion::add_numbers(const double* y, double* values) const {
    const int n = space().shape_size(), all = space().size();
    const auto add_border = [&](int at, int rows, int columns, const Eigen::VectorXd& slope) {
        for (int i = 0; i < n; ++i) values[pattern_.outerIndexPtr()[at] + rows + i] += slope[i];
        for (int i = 0; i < (columns == 0 ? all : n); ++i) values[number_rows_.at(at)[columns + i]] += slope[i];
    };
    if (at_.area >= 0) add_border(at_.area, 0, 0, gradient_at({.area = 1}, y));
    if (at_.tension >= 0) add_border(at_.tension, 0, 0, gradient_at({.area = 1}, y));
    if (at_.mu >= 0) {
        const Eigen::VectorXd slope = gradient_at({.M = 1}, y);
        const std::vector<int>& row = number_rows_.at(at_.mu);
        const int column = pattern_.outerIndexPtr()[at_.mu] + (law_.inextensible ? at_.u_r : 0);
        for (int i = 0; i < n; ++i) values[column + i] += slope[i];
        for (int i = 0; i < all; ++i) values[row[i]] -= *forms_.bending().alpha * slope[i];
        values[row[at_.mu]] += 1;
    }
    if (at_.lambda < 0) return;
    const Eigen::VectorXd slope = gradient_at({.volume = 1}, y);
    if (!law_.keeps_volume) {
        const std::vector<int>& row = number_rows_.at(at_.lambda);
        const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(y, all);
        const int column = pattern_.outerIndexPtr()[at_.lambda] + (law_.inextensible ? at_.u_r : 0);
        const double by_volume = loads_at(law_, 0).pressure_slope(forms_.observe(x).volume);
        for (int i = 0; i < n; ++i) values[column + i] += slope[i];
        for (int i = 0; i < all; ++i) values[row[i]] += by_volume * slope[i];
        values[row[at_.lambda]] += 1;
        return;
    }
    if (!law_.inextensible) return add_border(at_.lambda, 0, 0, slope);
    if (at_.volume >= 0) add_border(at_.volume, 0, 0, slope);
    add_border(at_.lambda, at_.u_r, at_.u_r, slope);
    Eigen::SparseMatrix<double> second = forms_.pattern();
    forms_.add_hessian({.volume = 1}, y, second.valuePtr());
    Eigen::VectorXd by_curve = second * velocity(y);
    if (at_.stretch >= 0) {
        by_curve.tail(all - space().r().size()) += y[at_.stretch] * slope.tail(all - space().r().size());
        values[number_rows_.at(at_.lambda)[at_.stretch]] += slope.dot(stretched(y));
    }
    for (int i = 0; i < all; ++i) values[number_rows_.at(at_.lambda)[i]] += by_curve[i];
}

// Contributions of beads.
void CurveMotion::add_beads(double t, const double* y, double* values) const {
    const int n = space().size(), rows = law_.inextensible ? at_.u_r : 0;
    std::vector<double> entries(forms_.pattern().nonZeros());
    beads_->add_hessian(y, bead_numbers(y), forms_.slots(), entries.data());
    const std::vector<int>& slots = law_.inextensible ? momentum_slots_ : curve_slots_;
    for (std::size_t i = 0; i < entries.size(); ++i) values[slots[i]] += entries[i];
    const BeadEquations::Slopes s = beads_->equations().slopes(beads_->on(y), bead_load(t), bead_numbers(y));
    for (int k = 0; k < 4; ++k) {
        double* column = values + pattern_.outerIndexPtr()[at_.bead + k];
        const bool of_reach = at_.reach >= 0 && k == beads_->equations().distance_row();
        const std::vector<int>& row = number_rows_.at(of_reach ? at_.reach : at_.bead + k);
        for (int i = 0; i < n; ++i) column[rows + i] += s.force_by_numbers(i, k);
        for (int i = 0; i < n; ++i) values[row[i]] += s.equations_by_shape(k, i);
        for (int j = 0; j < 4; ++j) values[row[at_.bead + j]] += s.equations_by_numbers(k, j);
    }
    if (at_.reach >= 0) add_reach(y, values);
}

// With the multipliers by which SUM q G has the derivative of the distance.
BeadNumbers CurveMotion::lengthening_beads(const double* y) const {
    BeadNumbers out = bead_numbers(y);
    const BeadSurface on = beads_->on(y);
    for (int k = 0; k < 2; ++k)
        if (beads_->equations().has_bead(k))
            out[2 * k + 1] = -1 / beads_->equations().slopes_in_P(on, k, out[2 * k])[0];
    return out;
}

// The rate of the distance as the curve moves with the velocity.
double CurveMotion::reach_rate(const double* y) const {
    Eigen::VectorXd slope = Eigen::VectorXd::Zero(space().size());
    beads_->add_force(y, lengthening_beads(y), slope.data());
    return slope.dot(velocity(y));
}

// At a kink the rate is that before it: steps end there.
void CurveMotion::hold_reach(double t, const double* y, double* F) const {
    const int row = at_.bead + beads_->equations().distance_row();
    F[at_.reach] = F[row];
    F[row] = reach_rate(y) - law_.beads->rate(std::nextafter(t, -HUGE_VAL));
    BeadNumbers drift = lengthening_beads(y);
    drift[1] *= y[at_.reach], drift[3] *= y[at_.reach];
    beads_->add_force(y, drift, F);
}

// Its multiplier is zero but for errors in time: second derivatives of the distance are left out of its column.
void CurveMotion::add_reach(const double* y, double* values) const {
    const int n = space().size();
    const BeadNumbers at = lengthening_beads(y);
    const Eigen::VectorXd u = velocity(y);
    const BeadEquations::Slopes s = beads_->equations().slopes(beads_->on(y), {}, at);
    Eigen::SparseMatrix<double> second = forms_.pattern();
    std::fill_n(second.valuePtr(), second.nonZeros(), 0.0);
    beads_->add_hessian(y, at, forms_.slots(), second.valuePtr());
    Eigen::VectorXd slope = Eigen::VectorXd::Zero(n), by_curve = second * u;
    const std::vector<int>& row = number_rows_.at(at_.bead + beads_->equations().distance_row());
    for (int k = 0; k < 2; ++k) {
        if (!beads_->equations().has_bead(k)) continue;
        const int P = 2 * k, q = P + 1;
        const double along = at[q] * s.force_by_numbers.col(q).dot(u);
        slope += at[q] * s.force_by_numbers.col(q), by_curve += along * s.force_by_numbers.col(P);
        values[row[at_.bead + P]] += s.force_by_numbers.col(P).dot(u) + along * s.equations_by_numbers(q, P);
    }
    double* column = values + pattern_.outerIndexPtr()[at_.reach];
    for (int i = 0; i < n; ++i) {
        values[row[i]] += by_curve[i], values[row[at_.u_r + i]] += slope[i];
        column[i] += slope[i];
    }
}

// Contributions of a free period.
void CurveMotion::add_stretch(double t, const double* y, double cj, double* values) const {
    const int all = space().size(), after_r = all - space().r().size();
    const std::vector<int>& kinematic = number_rows_.at(at_.rise);
    values[kinematic[at_.rise]] += cj - y[at_.stretch];
    values[kinematic[at_.stretch]] -= y[at_.rise];

    const Eigen::VectorXd along = stretched(y), x = Eigen::Map<const Eigen::VectorXd>(y, all);
    const Weights weights = force_weights(t, y);
    Eigen::VectorXd by_curve = forms_.hessian(weights, x) * along;
    by_curve.tail(after_r) += gradient_at(weights, y).tail(after_r);
    by_curve[at_.rise] -= law_.force.at(t) * space().images();
    const std::vector<int>& row = number_rows_.at(at_.stretch);
    for (int i = 0; i < all; ++i) values[row[i]] += by_curve[i];
    if (at_.tension >= 0) values[row[at_.tension]] += gradient_at({.area = 1}, y).dot(along);
    if (at_.lambda >= 0) values[row[at_.lambda]] += gradient_at({.volume = 1}, y).dot(along);
    if (at_.mu >= 0) values[row[at_.mu]] += gradient_at({.M = 1}, y).dot(along);
}

CurveMotion::Balance CurveMotion::balance(double t, const double* y, const double* rate) const {
    const SplineSpace& splines = space().splines();
    const double images = space().images();
    const PointNumbers numbers = point_numbers(t, y);
    Balance out;
    Pack pressure_sum{0.0}, area{0.0}, pull{0.0};
    Pack kinetic{0.0}, supplied{0.0}, dissipation{0.0}, momentum{0.0}, angular{0.0}, divergence{0.0}, speed{0.0},
        acceleration{0.0};
    for (int e = 0; e < splines.elements(); ++e)
        for (int g = 0; g < splines.groups(); ++g) {
            const Local at(*this, e, g, y, rate);
            const auto& f = at.fields;
            const Pack &r = f.v[r0], &r_s = f.v[r1], &z_s = f.v[z1];
            const Pack g2 = r_s * r_s + z_s * z_s, ig = 1.0 / sqrt(g2);
            const Pack dS = images * load(splines.basis(e, g).weight) * (2 * pi) * r * g2 * ig;
            const Sources& source = law_.source;
            const Pack place[]{r, f.v[z0] + f.climb, Pack(t)};
            const Pack push_r = source.force_at(0, place), push_z = source.force_at(2, place);
            if (!law_.inextensible) {
                const Pack normal = (f.r_t * z_s - (f.z_t - numbers.stretch * f.v[z0]) * r_s) * ig;
                dissipation += dS * normal * normal;
                supplied += dS * normal * (push_r * z_s - push_z * r_s) * ig;
                speed = stdx::max(speed, normal * normal);
                continue;
            }
            const Pack &u = f.v[ur0], &v = f.v[uz0], &w = f.v[w0];
            const Pack square = u * u + v * v + w * w;
            const Pack ss = (r_s * f.v[ur1] + z_s * (f.v[uz1] + numbers.stretch * z_s)) * ig * ig, tt = u / r;
            const Pack shear = 0.5 * (f.v[w1] - w * r_s / r) * ig;
            const Pack kinetic_here = (0.5 * law_.inertia) * dS * square;
            kinetic += kinetic_here;
            if (at_.supply >= 0) supplied += kinetic_here * (ss + tt);
            dissipation += dS * (law_.friction * square + 2 * law_.viscosity * (ss * ss + tt * tt + 2 * shear * shear));
            acceleration += law_.inertia * dS * (f.ur_t * f.ur_t + f.uz_t * f.uz_t + f.w_t * f.w_t);
            momentum += dS * v;
            angular += dS * r * w;
            const Pack made = source.mass_at(place);
            if (source.act())
                supplied += dS * (push_r * u + push_z * v + source.force_at(1, place) * w + f.v[p0] * made) +
                            kinetic_here * made;
            const Pack div = ss + tt - numbers.supply - made;
            divergence += dS * div * div;
            area += dS, pressure_sum += dS * f.v[p0];
            pull += dS * (2 * law_.viscosity * ss - f.v[p0]) * z_s * z_s * ig * ig;
            speed = stdx::max(speed, square);
        }
    out.kinetic = stdx::reduce(kinetic), out.supplied = stdx::reduce(supplied) + rim_supply(y);
    out.dissipation = stdx::reduce(dissipation);
    out.momentum_z = space().images() == 2 ? 0 : stdx::reduce(momentum);  // the other half has the opposite
    out.angular_z = stdx::reduce(angular);
    out.acceleration = stdx::reduce(acceleration);
    out.divergence = std::sqrt(stdx::reduce(divergence)), out.speed = std::sqrt(stdx::hmax(speed));
    const double tension = law_.inextensible ? -stdx::reduce(pressure_sum) / stdx::reduce(area) : 0;
    out.loads = loads_of(t, y, tension, stdx::reduce(pull));
    return out;
}

FormulaDomain::Margin CurveMotion::source_domain(double t, const double* y) const {
    SourceDomain domain(law_.source);
    if (!domain.restricted()) return {};
    const SplineSpace& splines = space().splines();
    const std::vector<double> rest(at_.size);
    for (int e = 0; e < splines.elements(); ++e)
        for (int g = 0; g < splines.groups(); ++g) {
            const Local at(*this, e, g, y, rest.data());
            for (int q = 0; q < lanes; ++q) {
                const double place[]{at.fields.v[r0][q], at.fields.v[z0][q] + at.fields.climb[q], t};
                domain.look(place, splines.basis(e, g).z[q]);
            }
        }
    return domain.margin();
}

// Given, or of the state: tension and pull (the part of the axial force that the velocity and p exert, times the
// period) of a membrane that is inextensible.
Loads CurveMotion::loads_of(double t, const double* y, double tension, double pull) const {
    const Weights weights = force_weights(t, y);
    Loads out = loads_at(law_, t);
    if (!law_.area_is_free()) out.tension = law_.inextensible ? tension : weights.area;
    out.pressure = -weights.volume;
    if (at_.bead >= 0) out.force = beads_->force(y, bead_numbers(y));
    if (space().topology() == Topology::strip) {  // what the second ring does in a translation along the axis
        Eigen::VectorXd rows = Eigen::VectorXd::Zero(at_.size);
        hold_rim(t, y, rows.data());
        const int n = space().z().size(), first = (law_.inextensible ? at_.u_z : at_.z) + n / 2;
        out.force = -rows.segment(first, n - n / 2).sum();
    }
    const double length = space().length(y);
    if (at_.stretch < 0 && length > 0) {
        const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(y, space().size());
        out.force = (pull + forms_.stretch_slope(weights, x)) / length;
    }
    return out;
}

namespace {

// Rows and columns of a matrix divided by the roots of their largest entries, iterated: pressures and velocities
// over a very short step differ by many orders of magnitude.
struct Equilibrated {
    Eigen::VectorXd rows, columns;

    explicit Equilibrated(Eigen::SparseMatrix<double>& A)
        : rows(Eigen::VectorXd::Ones(A.rows())), columns(Eigen::VectorXd::Ones(A.cols())) {
        for (int pass = 0; pass < 8; ++pass) {
            Eigen::VectorXd r = Eigen::VectorXd::Zero(A.rows()), c = Eigen::VectorXd::Zero(A.cols());
            const auto each = [&](auto&& visit) {
                for (int j = 0; j < A.cols(); ++j)
                    for (Eigen::SparseMatrix<double>::InnerIterator it(A, j); it; ++it) visit(it);
            };
            each([&](auto& it) {
                r[it.row()] = std::max(r[it.row()], std::abs(it.value()));
                c[it.col()] = std::max(c[it.col()], std::abs(it.value()));
            });
            const auto factor = [](double largest) { return largest > 0 ? 1 / std::sqrt(largest) : 1; };
            r = r.unaryExpr(factor), c = c.unaryExpr(factor);
            each([&](auto& it) { it.valueRef() *= r[it.row()] * c[it.col()]; });
            rows.array() *= r.array(), columns.array() *= c.array();
        }
    }
};

}  // namespace

InitialState CurveMotion::consistent(const Eigen::VectorXd& y0, double h, double time) const {
    constexpr int most_iterations = 25;
    constexpr double most_growth = 10;  // of a correction, before smaller ones follow
    constexpr double rounding = 1e-9;   // of the curve: corrections below it need not become smaller
    InitialState s{y0, Eigen::VectorXd::Zero(at_.size), time + 2 * h, h};
    Eigen::VectorXd before = y0, F(at_.size);
    Eigen::SparseMatrix<double> J = pattern_;
    SparseLu lu;
    for (int step = 0; step < 2; ++step, before = s.y) {
        s.rate.setZero();
        double last = std::numeric_limits<double>::infinity();
        const double t = time + (step + 1) * h;
        for (int iteration = 0;; ++iteration) {
            if (!residual(t, s.y.data(), s.rate.data(), F.data()))
                throw SolveError("the profile leaves the half plane r > 0 at the start of the motion");
            jacobian(t, s.y.data(), s.rate.data(), 1 / h, J.valuePtr());
            const Equilibrated scale(J);
            lu.factor(J);
            const Eigen::VectorXd change =
                scale.columns.cwiseProduct(lu.solve(Eigen::VectorXd(scale.rows.cwiseProduct(F))));
            s.y -= change;
            s.rate = (s.y - before) / h;
            const double size = change.head(space().size()).norm();
            if (size == 0 || (size >= 0.5 * last && size <= rounding * s.y.head(space().size()).norm())) break;
            if (!(size < most_growth * last) || iteration == most_iterations)
                throw SolveError("Newton's method for the initial velocities does not converge");
            last = size;
        }
        if (at_.reach >= 0)  // where the rate jumps, a constraint does work at the mean of both
            s.work += h * beads_->force(s.y.data(), bead_numbers(s.y.data())) *
                      (reach_rate(before.data()) + reach_rate(s.y.data())) / 2;
    }
    s.rate.array() *= differential().array();  // the others jumped from a guess
    return s;
}

}  // namespace tubule::axisym
