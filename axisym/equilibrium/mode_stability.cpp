#include "axisym/equilibrium/mode_stability.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>

#include "axisym/splines/pack.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/solve/dense.hpp"
#include "common/solve/pause.hpp"

namespace tubule::axisym {
namespace {

constexpr int lanes = SplineSpace::lanes;
using J = Jet<Pack, 6, 2>;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// Variables of the quadratic form; those up to w_theta_theta go with cos(m theta), the others with sin.
enum Variable { W, W_s, W_ss, W_tt, W_t, W_st };

// A point of the disturbed surface in the frame (e_r, e_theta, e_z), and the derivatives there.
struct Disturbed {
    J r, z, s_r, s_z, t_r, t_z, ss_r, ss_z, st_r, st_z, tt_r, tt_z;
};

// The surface (r + w n_r) e_r + (z + w n_z) e_z. Each argument: value, first and second derivative in s.
Disturbed disturb(const Pack (&r)[3], const Pack (&z)[3], const Pack (&nr)[3], const Pack (&nz)[3]) {
    const J w = J::variable(Pack(0.0), W), w_s = J::variable(Pack(0.0), W_s), w_ss = J::variable(Pack(0.0), W_ss),
            w_t = J::variable(Pack(0.0), W_t), w_st = J::variable(Pack(0.0), W_st), w_tt = J::variable(Pack(0.0), W_tt);
    const auto constant = [](const Pack& value) {
        J c;
        c.v = value;
        return c;
    };
    const auto first = [&](const Pack(&x)[3], const Pack(&n)[3]) {
        return constant(x[1]) + w_s * constant(n[0]) + w * constant(n[1]);
    };
    const auto second = [&](const Pack(&x)[3], const Pack(&n)[3]) {
        return constant(x[2]) + w_ss * constant(n[0]) + 2.0 * (w_s * constant(n[1])) + w * constant(n[2]);
    };
    const auto mixed = [&](const Pack(&n)[3]) { return w_st * constant(n[0]) + w_t * constant(n[1]); };
    Disturbed d;
    d.r = constant(r[0]) + w * constant(nr[0]), d.z = constant(z[0]) + w * constant(nz[0]);
    d.s_r = first(r, nr), d.s_z = first(z, nz);
    d.ss_r = second(r, nr), d.ss_z = second(z, nz);
    d.t_r = w_t * constant(nr[0]), d.t_z = w_t * constant(nz[0]);
    d.st_r = mixed(nr), d.st_z = mixed(nz);
    d.tt_r = w_tt * constant(nr[0]) - d.r, d.tt_z = w_tt * constant(nz[0]);
    return d;
}

// E + sigma A + lambda V per ds and dtheta. The e_theta components are: of d_theta r, of d_s d_theta d_s r, of
// d_theta^2 twice d_theta r, of the others none. V = 1/2 INT (x, y, 0) . nu dS, which holds for a period too.
J functional_density(const Bending& bending, const std::optional<Formula>& potential,
                     const std::optional<BeadForms>& beads, const Equilibrium& shape, const Disturbed& d) {
    // Normal d_theta X x d_s X, not of unit length.
    const J n_r = d.r * d.s_z, n_t = d.t_z * d.s_r - d.t_r * d.s_z, n_z = -(d.r * d.s_r);
    const J square = n_r * n_r + n_t * n_t + n_z * n_z;
    const J inverse_area = inverse_sqrt(square), inverse_square = inverse_area * inverse_area;
    const J E = d.t_r * d.t_r + d.r * d.r + d.t_z * d.t_z, F = d.t_r * d.s_r + d.t_z * d.s_z,
            G = d.s_r * d.s_r + d.s_z * d.s_z;
    const J L = d.tt_r * n_r + 2.0 * (d.t_r * n_t) + d.tt_z * n_z, M = d.st_r * n_r + d.s_r * n_t + d.st_z * n_z,
            N = d.ss_r * n_r + d.ss_z * n_z;
    const J H = (L * G - 2.0 * (M * F) + N * E) * (inverse_square * inverse_area);
    const J K = (L * N - M * M) * (inverse_square * inverse_square);
    const auto f = density(bending, H.v, K.v);
    J sum = chain(H, K, f.f, f.H, f.K, f.HH, f.HK, f.KK);
    sum.v += shape.sigma;
    if (potential) {
        const J place[]{d.r, d.z};
        sum += evaluate(*potential, place);
    }
    for (int bead = 0; beads && bead < 2; ++bead) {
        if (!beads->equations().has_bead(bead)) continue;
        const J place[]{d.r, d.z, J(shape.beads[2 * bead])};
        sum += shape.beads[2 * bead + 1] * evaluate(beads->equations().density(bead), place);
    }
    return square * inverse_area * sum + (shape.lambda / 2) * (d.r * n_r);
}

}  // namespace

// dW/dnu - H W: the derivative of INT W dS along the normal displacement w is the integral of this times w.
double ModeStability::slope_along_normal(const Formula& W, double P, const Point& p) {
    using Slope = Jet<double, 2, 1>;
    const Slope place[]{Slope::variable(p.r, 0), Slope::variable(p.z, 1), Slope(P)}, value = evaluate(W, place);
    return value.d[0] * p.normal_r + value.d[1] * p.normal_z - p.H * value.v;
}

ModeStability::ModeStability(const StationaryProblem& problem, const Equilibrium& shape)
    : problem_(problem), shape_(shape) {
    const CurveSpace& space = *shape.space;
    const SplineSpace& splines = space.splines();
    // Displacements go along a spline field n that is the normal up to the error of a projection. Only their normal
    // part matters at a stationary shape, and two derivatives of n are at hand.
    const auto normal = [&](double s) {
        const CurveSample p = space.evaluate(shape.x, s);
        const double g = std::hypot(p.r1, p.z1);
        return std::array{p.z1 / g, -p.r1 / g};
    };
    const Vector n_r = space.r().project([&](double s) { return normal(s)[0]; });
    const Vector n_z = space.z().project([&](double s) { return normal(s)[1]; });
    std::vector<std::array<double, 4>> first_variation;  // by w, w_s, w_ss, w_sss
    const Bending bending = with_M(problem.bending, shape.observed.M);
    if (bending.kg != 0) gradients_.emplace(), third_.emplace(splines);
    const std::optional<Formula> potential = potential_density(bending.potentials);
    if (problem.beads) beads_.emplace(bead_forms(space, problem));
    for (int e = 0; e < splines.elements(); ++e)
        for (int group = 0; group < splines.groups(); ++group) {
            const auto& b = splines.basis(e, group);
            Pack r[3], z[3], nr[3], nz[3];
            for (int q = 0; q < lanes; ++q) {
                const CurveSample p = space.evaluate(shape.x, b.z[q]);
                const auto u = space.r().evaluate(n_r.data(), b.z[q]), v = space.z().evaluate(n_z.data(), b.z[q]);
                r[0][q] = p.r, r[1][q] = p.r1, r[2][q] = p.r2, z[0][q] = p.z, z[1][q] = p.z1, z[2][q] = p.z2;
                for (int k = 0; k < 3; ++k) nr[k][q] = u[k], nz[k][q] = v[k];
            }
            if (gradients_) add_gradients(e, group, n_r, n_z);
            const J density = functional_density(bending, potential, beads_, shape, disturb(r, z, nr, nz));
            const auto base = profile_point(r[0], r[1], r[2], z[1], z[2]);
            for (int q = 0; q < lanes; ++q) {
                Point p;
                p.element = e, p.group = group, p.lane = q;
                p.weight = b.weight[q], p.r = r[0][q], p.z = z[0][q], p.g = 1 / base.inverse_speed[q];
                p.kappa_s = base.kappa_s[q], p.kappa_theta = base.kappa_theta[q], p.H = base.H[q];
                p.slope = r[1][q] / p.g;
                p.stretching = (r[1][q] * r[2][q] + z[1][q] * z[2][q]) / (p.g * p.g);
                p.normal_r = z[1][q] / p.g, p.normal_z = -r[1][q] / p.g;
                p.along = p.normal_r * nr[0][q] + p.normal_z * nz[0][q];
                for (int k = 0; k < 21; ++k) p.Q[k] = density.dd[k][q];
                for (int bead = 0; beads_ && bead < 2; ++bead) {
                    if (!beads_->equations().has_bead(bead)) continue;
                    const double P = shape.beads[2 * bead];
                    p.bead[2 * bead] = slope_along_normal(beads_->equations().density(bead), P, p);
                    p.bead[2 * bead + 1] = slope_along_normal(beads_->equations().density_by_P(bead), P, p);
                }
                first_variation.push_back({density.d[W][q], density.d[W_s][q], density.d[W_ss][q], 0});
                if (gradients_) {
                    const auto& more = gradients_->first_variation(points_.size());
                    for (int k = 0; k < 4; ++k) first_variation.back()[k] += bending.kg * more[k];
                }
                points_.push_back(p);
            }
        }
    set_force(first_variation);
}

// Those of the gradient term at a group of points, displaced along the field n.
void ModeStability::add_gradients(int element, int group, const Vector& n_r, const Vector& n_z) {
    const CurveSpace& space = *shape_.space;
    const int width = space.splines().width();
    const auto& b = space.splines().basis(element, group);
    GradientModes::Derivatives r, z, along_r, along_z;
    for (int q = 0; q < lanes; ++q) {
        const auto& third = third_->at(element, group).by_spline[q];
        const auto derivative = [&](const SplineSpace& field, const double* c, int k) {
            double sum = 0;
            for (int a = 0; a < width; ++a)
                sum += (k < 3 ? b.by_spline[q][k][a] : third[a]) * field.signs(element)[a] * c[field.dofs(element)[a]];
            return sum;
        };
        for (int k = 0; k < 4; ++k) {
            const double rise = k == 0 ? b.z[q] : k == 1 ? 1 : 0;
            r[k][q] = derivative(space.r(), shape_.x.data(), k);
            z[k][q] = derivative(space.z(), shape_.x.data() + space.r().size(), k) + rise * space.rise(shape_.x.data());
            along_r[k][q] = derivative(space.r(), n_r.data(), k), along_z[k][q] = derivative(space.z(), n_z.data(), k);
        }
    }
    gradients_->add_group(r, z, along_r, along_z);
}

// (force, phi) = -first variation by phi, for all phi of a scalar field.
void ModeStability::set_force(const std::vector<std::array<double, 4>>& first_variation) {
    const SplineSpace& splines = shape_.space->splines();
    const SplineSpace field(splines, Parity{});
    const int n = field.size(), width = splines.width();
    Matrix mass = Matrix::Zero(n, n);
    Vector load = Vector::Zero(n);
    for (std::size_t k = 0; k < points_.size(); ++k) {
        const Point& p = points_[k];
        const int e = p.element, q = p.lane;
        const auto& b = splines.basis(e, p.group);
        const auto& d = first_variation[k];
        for (int a = 0; a < width; ++a) {
            const int i = field.dofs(e)[a];
            const double sign = field.signs(e)[a], f0 = sign * b.by_spline[q][0][a];
            load[i] -= p.weight * (d[0] * f0 + sign * (d[1] * b.by_spline[q][1][a] + d[2] * b.by_spline[q][2][a]));
            if (gradients_) load[i] -= p.weight * d[3] * sign * third_->at(e, p.group).by_spline[q][a];
            for (int c = 0; c < width; ++c)
                mass(field.dofs(e)[c], i) +=
                    p.weight * p.r * p.g * p.along * f0 * field.signs(e)[c] * b.by_spline[q][0][c];
        }
    }
    const Vector force = solve_dense(mass, load);
    for (Point& p : points_) {
        const auto& b = splines.basis(p.element, p.group);
        p.force = 0;
        for (int a = 0; a < width; ++a)
            p.force += field.signs(p.element)[a] * force[field.dofs(p.element)[a]] * b.by_spline[p.lane][0][a];
    }
}

std::vector<Parity> ModeStability::parities(int m) const {
    const int pole = m % 2 == 0 ? 1 : -1;
    switch (shape_.space->topology()) {
        case Topology::cell:
            return {{pole, pole}};
        case Topology::half_cell:
            return {{pole, 1}, {pole, -1}};
        case Topology::half_tube:
            return {{1, 1}, {-1, -1}};
        case Topology::cap:
            return {{1, pole}};
        default:
            return {{1, 1}};
    }
}

ModeRates ModeStability::rates(int m, const MotionLaw& law, int count) const {
    ModeRates out;
    out.m = m;
    for (const Parity& parity : parities(m)) add_rates(m, law, parity, count, out);
    return out;
}

std::vector<double> ModeStability::axisymmetric_rates(bool even, int count) const {
    const MotionLaw gradient_flow{.friction = 1, .inextensible = false, .keeps_volume = false};
    ModeRates out;
    for (const Parity& parity : parities(0))
        if ((mirror(parity) >= 0) == even) add_rates(0, gradient_flow, parity, count, out);
    return out.rates;
}

namespace {

// Columns that span the vectors orthogonal to all of `fixed`: area and volume are one constraint for a sphere or a
// tube, up to the error of the mesh.
Matrix complement(const Matrix& fixed) {
    return orthogonal_complement(fixed, 1e-6);
}

void append(Matrix& columns, const Vector& column) {
    columns.conservativeResize(column.size(), columns.cols() + 1);
    columns.col(columns.cols() - 1) = column;
}

// A derivative by the parameter at a ring.
Vector functional_at(const SplineSpace& field, std::size_t ring, int derivative) {
    const double s = rim_parameter(ring);
    const int e = field.element_at(s);
    double values[3 * SplineSpace::max_width];
    field.splines(e, s, 2, values);
    Vector out = Vector::Zero(field.size());
    for (int a = 0; a < field.width(); ++a)
        out[field.dofs(e)[a]] += field.signs(e)[a] * values[derivative * field.width() + a];
    return out;
}

// The smallest M + y^T (own y + 2 cross) of all y with `fixed` y = `values`, everything being linear in w.
Matrix smallest_with(const Matrix& M, const Matrix& own, const Matrix& cross, const Matrix& fixed,
                     const Matrix& values) {
    const Matrix first = least_squares(fixed, values), free = complement(fixed.transpose());
    const Matrix slope = own * first + cross, left = free.transpose() * slope;
    return M + first.transpose() * (slope + cross) -
           left.transpose() * least_squares(free.transpose() * own * free, left);
}

struct SmallEigenpairs : Eigenpairs {
    double inverses = 0;  // SUM 1/mu of all
};

// Smallest eigenvalues of A v = mu M v, with the vectors, to their own relative accuracy however large the others are:
// by the inverse.
SmallEigenpairs smallest(const Matrix& A, const Matrix& M, int count) {
    double shift = 1e-2 * A.diagonal().cwiseAbs().minCoeff() / M.diagonal().maxCoeff();
    for (int k = 0; k < 60; ++k, shift *= 4) {
        const Matrix shifted = A + shift * M;
        check_pause();
        if (!is_positive_definite(shifted)) continue;
        const std::optional<Eigenpairs> eigen = eigenpairs(M, shifted);
        if (!eigen) break;
        const int n = static_cast<int>(A.rows()), kept = std::min(count, n);
        SmallEigenpairs out{{Vector(kept), Matrix(n, kept)}};
        out.inverses = (eigen->values.array() / (1 - shift * eigen->values.array())).sum();
        for (int i = 0; i < kept; ++i) {
            out.values[i] = 1 / eigen->values[n - 1 - i] - shift;
            out.vectors.col(i) = eigen->vectors.col(n - 1 - i);
        }
        return out;
    }
    throw SolveError("the eigenproblem of the second variation could not be solved");
}

}  // namespace

// Under reflection at a plane of symmetry; 0 if the curve ends at none.
int ModeStability::mirror(Parity parity) const {
    const Topology t = shape_.space->topology();
    return t == Topology::cell || t == Topology::tube || is_patch(t) ? 0 : parity.end;
}

struct ModeStability::Forms {
    Matrix second_variation, mass, gradients, source;  // INT |grad f|^2, INT H f w
    Vector area, volume, M, mean;
    Vector bead[4];   // slopes of G and dG/dP, of both
    Vector rigid[2];  // translation along or across the axis, tilt

    explicit Forms(int n)
        : second_variation(Matrix::Zero(n, n)),
          mass(second_variation),
          gradients(second_variation),
          source(second_variation),
          area(Vector::Zero(n)),
          volume(area),
          M(area),
          mean(area),
          bead{area, area, area, area},
          rigid{area, area} {}
};

ModeStability::Forms ModeStability::assemble(int m, const SplineSpace& field) const {
    const int width = field.width();
    const double m2 = m * m;
    Forms forms(field.size());
    for (std::size_t k = 0; k < points_.size(); ++k) {
        const Point& p = points_[k];
        const int e = p.element, q = p.lane;
        const auto& b = field.basis(e, p.group);
        const auto Q = [&](int i, int j) { return p.Q[packed<6>(i, j)]; };
        const double dS = p.weight * p.r * p.g, n2 = p.along * p.along;
        Eigen::Matrix4d C = Eigen::Matrix4d::Zero();
        C(0, 0) =
            Q(W, W) - 2 * m2 * Q(W, W_tt) + m2 * m2 * Q(W_tt, W_tt) + m2 * Q(W_t, W_t) - p.force * p.H * n2 * p.r * p.g;
        C(0, 1) = C(1, 0) = Q(W, W_s) - m2 * Q(W_s, W_tt) + m2 * Q(W_t, W_st);
        C(0, 2) = C(2, 0) = Q(W, W_ss) - m2 * Q(W_ss, W_tt);
        C(1, 1) = Q(W_s, W_s) + m2 * Q(W_st, W_st);
        C(1, 2) = C(2, 1) = Q(W_s, W_ss);
        C(2, 2) = Q(W_ss, W_ss);
        if (gradients_) C += problem_.bending.kg * gradients_->second_variation(k, m);
        const auto third = [&](int a) { return third_ ? third_->at(e, p.group).by_spline[q][a] : 0.0; };
        // Rigid motions as normal displacements over cos(m theta).
        const double motion[2] = {m == 0 ? p.normal_z : p.normal_r, p.z * p.normal_r - p.r * p.normal_z};
        for (int a = 0; a < width; ++a) {
            const int i = field.dofs(e)[a];
            const double sign = field.signs(e)[a];
            const Eigen::Vector4d v =
                sign * Eigen::Vector4d(b.by_spline[q][0][a], b.by_spline[q][1][a], b.by_spline[q][2][a], third(a));
            const Eigen::Vector4d Cv = p.weight * (C * v);
            forms.area[i] -= dS * p.H * p.along * v[0];
            forms.volume[i] += dS * p.along * v[0];
            forms.M[i] -= 2 * dS * p.kappa_s * p.kappa_theta * p.along * v[0];
            forms.mean[i] += dS * v[0];
            for (int l = 0; beads_ && l < 4; ++l) forms.bead[l][i] += dS * p.bead[l] * p.along * v[0];
            for (int l = 0; l < 2; ++l) forms.rigid[l][i] += dS * p.along * motion[l] * v[0];
            for (int c = 0; c < width; ++c) {
                const int j = field.dofs(e)[c];
                const double other = field.signs(e)[c], f0 = other * b.by_spline[q][0][c],
                             f1 = other * b.by_spline[q][1][c], f2 = other * b.by_spline[q][2][c];
                forms.second_variation(j, i) += f0 * Cv[0] + f1 * Cv[1] + f2 * Cv[2] + other * third(c) * Cv[3];
                forms.mass(j, i) += dS * n2 * f0 * v[0];
                forms.gradients(j, i) += dS * (f1 * v[1] / (p.g * p.g) + m2 / (p.r * p.r) * f0 * v[0]);
                forms.source(j, i) += dS * p.H * p.along * f0 * v[0];
            }
        }
    }
    return forms;
}

// A basis of the functions that begin with the power m of the distance at a pole. Parity does it for m = 0 and 1; of
// the others the even ones must vanish, the odd ones be flat. Where |grad H|^2 counts, the next power down is excluded,
// too, by its second or third derivative: with it that has no integral.
Matrix ModeStability::regular(int m, const SplineSpace& field) const {
    Matrix at_poles(field.size(), 0);
    const auto require = [&](int e, double s) {
        double values[4 * SplineSpace::max_width];
        field.splines(e, s, 3, values);
        for (int derivative = m % 2; derivative < (gradients_ && m >= 4 ? 4 : 2); derivative += 2) {
            Vector functional = Vector::Zero(field.size());
            for (int a = 0; a < field.width(); ++a)
                functional[field.dofs(e)[a]] += field.signs(e)[a] * values[derivative * field.width() + a];
            append(at_poles, functional.normalized());
        }
    };
    if (m >= 2 && shape_.space->begins_at_pole()) require(0, 0);
    if (m >= 2 && shape_.space->ends_at_pole()) require(field.elements() - 1, 1);
    return complement(at_poles);
}

// At its rings a patch does not move around the axis, d psi/ds = m chi/r, and does not flow through closed ones, psi =
// 0. (There d chi/ds = 0; where they are open chi = 0.) Columns: functionals of psi, and their values in w.
std::pair<Matrix, Matrix> ModeStability::ring_conditions(int m, const MotionLaw& law, const SplineSpace& field,
                                                         const SplineSpace& psi, const Matrix& chi) const {
    Matrix fixed(psi.size(), 0), values(field.size(), 0);
    for (std::size_t i = 0; i < problem_.rings.size(); ++i) {
        const CurveSample at = shape_.space->evaluate(shape_.x, rim_parameter(i));
        append(fixed, functional_at(psi, i, 1) / std::hypot(at.r1, at.z1));
        append(values, m / at.r * (chi.transpose() * functional_at(field, i, 0)));
        if (law.reservoir) continue;
        append(fixed, functional_at(psi, i, 0) / at.r);
        append(values, Vector::Zero(field.size()));
    }
    return {fixed, values};
}

// A basis of the chi of this m.
Matrix ModeStability::potentials(int m, const MotionLaw& law, Parity parity, const SplineSpace& field,
                                 const Forms& forms) const {
    if (!(law.reservoir && shape_.space->is_patch()))
        return m == 0 && mirror(parity) >= 0 ? complement(forms.mean) : regular(m, field);
    Matrix ends(field.size(), 0);  // membrane flows in at a constant pressure
    for (std::size_t i = 0; i < problem_.rings.size(); ++i) append(ends, functional_at(field, i, 0).normalized());
    const Matrix basis = regular(m, field);
    return basis * complement(basis.transpose() * ends);
}

// The dissipation of w nu with the best tangential velocity, as a quadratic form in w. That velocity is grad chi + nu x
// grad psi, w and chi going with cos(m theta), psi with sin: inextensibility is Lap chi = H w, and psi is free.
Matrix ModeStability::dissipation_form(int m, const MotionLaw& law, Parity parity, const SplineSpace& field,
                                       const Forms& forms) const {
    if (!law.inextensible) return law.friction * forms.mass;
    const Matrix basis = potentials(m, law, parity, field, forms);
    const Matrix L = basis.transpose() * forms.gradients * basis, S = basis.transpose() * forms.source;
    const Matrix X = -Eigen::LDLT<Matrix>(L).solve(S);  // chi of w, in the basis
    Matrix M = law.friction * (forms.mass + X.transpose() * L * X);
    if (law.viscosity == 0) return M;

    // sigma at each point as a linear map of (w, chi, psi): its components ss, theta theta, s theta times sqrt 2.
    const Parity turned{mirror(parity) == 0      ? parity.start
                        : shape_.space->closed() ? parity.start
                                                 : -parity.start,
                        mirror(parity) == 0 ? parity.end : -parity.end};
    const SplineSpace psi(field, turned);
    const int n = field.size(), swirls = m == 0 ? 0 : psi.size(), width = field.width();
    Matrix sigma = Matrix::Zero(3 * static_cast<Eigen::Index>(points_.size()), 2 * n + swirls);
    for (std::size_t k = 0; k < points_.size(); ++k) {
        const Point& p = points_[k];
        const int e = p.element, q = p.lane;
        const auto& b = field.basis(e, p.group);
        const double root = std::sqrt(p.weight * p.r * p.g), sqrt2 = std::sqrt(2.0), rate = p.slope / p.r, mr = m / p.r;
        const auto add = [&](int column, double factor, double ss, double tt, double st) {
            const Eigen::Index row = 3 * static_cast<Eigen::Index>(k);
            sigma(row, column) += factor * ss;
            sigma(row + 1, column) += factor * tt;
            sigma(row + 2, column) += factor * st;
        };
        for (int a = 0; a < width; ++a) {
            const double f = root * b.by_spline[q][0][a], f1 = root * b.by_spline[q][1][a], f_s = f1 / p.g,
                         f_ss = (root * b.by_spline[q][2][a] - p.stretching * f1) / (p.g * p.g);
            const double twist = mr * (f_s - rate * f);
            const int i = field.dofs(e)[a];
            add(i, -field.signs(e)[a] * p.along * f, p.kappa_s, p.kappa_theta, 0);
            add(n + i, field.signs(e)[a], f_ss, rate * f_s - mr * mr * f, -sqrt2 * twist);
            if (swirls > 0)
                add(2 * n + psi.dofs(e)[a], psi.signs(e)[a], -twist, twist, (mr * mr * f + f_ss - rate * f_s) / sqrt2);
        }
    }
    const Matrix chi = basis * X, of_w = sigma.leftCols(n) + sigma.middleCols(n, n) * chi;
    M += 2 * law.viscosity * of_w.transpose() * of_w;
    if (m == 0 && law.reservoir && shape_.space->topology() == Topology::strip) return with_flux(law, of_w, M);
    if (swirls == 0) return M;
    // The best psi. Motions of the whole that cost nothing may be among its choices: least squares then.
    const Matrix basis_psi = regular(m, psi), of_psi = sigma.rightCols(swirls) * basis_psi;
    const Matrix cross = 2 * law.viscosity * of_psi.transpose() * of_w;
    const Matrix own = 2 * law.viscosity * of_psi.transpose() * of_psi +
                       law.friction * basis_psi.transpose() * assemble(m, psi).gradients * basis_psi;
    if (!shape_.space->is_patch()) return M - cross.transpose() * least_squares(own, cross);
    const auto [fixed, values] = ring_conditions(m, law, field, psi, chi);
    return smallest_with(M, own, cross, fixed.transpose() * basis_psi, values.transpose());
}

// Between two open rims membrane may also flow by u_s = 1/r, in at one and out at the other.
Matrix ModeStability::with_flux(const MotionLaw& law, const Matrix& of_w, const Matrix& M) const {
    Vector flux = Vector::Zero(of_w.rows());
    double own = 0;
    for (std::size_t k = 0; k < points_.size(); ++k) {
        const Point& p = points_[k];
        const double root = std::sqrt(p.weight * p.r * p.g), rate = p.slope / (p.r * p.r);
        flux[3 * static_cast<Eigen::Index>(k)] = -root * rate, flux[3 * static_cast<Eigen::Index>(k) + 1] = root * rate;
        own += law.friction * root * root / (p.r * p.r);
    }
    own += 2 * law.viscosity * flux.squaredNorm();
    const Vector cross = 2 * law.viscosity * of_w.transpose() * flux;
    return own > 0 ? Matrix(M - cross * cross.transpose() / own) : M;
}

// The positions of beads follow from the displacement, for m = 0; where their distance is held, it is fixed.
void ModeStability::add_beads(Forms& forms, Matrix& fixed) const {
    const double whole = 2 * pi;
    Vector lengthens = Vector::Zero(forms.mean.size());
    for (int k = 0; k < 2; ++k) {
        if (!beads_->equations().has_bead(k)) continue;
        const double q = shape_.beads[2 * k + 1];
        const auto [by_P, by_PP] = beads_->equations().slopes_in_P(beads_->on(shape_.x.data()), k, shape_.beads[2 * k]);
        const Vector follows = -whole * forms.bead[2 * k] / by_P, with = q * forms.bead[2 * k + 1];
        forms.second_variation +=
            with * follows.transpose() + follows * with.transpose() + q * by_PP / whole * follows * follows.transpose();
        lengthens += follows;
    }
    if (problem_.held_distance()) append(fixed, lengthens.normalized());
}

// The rings of a patch, and where it is clamped its angle there.
void ModeStability::fix_at_rings(const SplineSpace& field, Matrix& fixed) const {
    for (std::size_t i = 0; i < problem_.rings.size(); ++i)
        for (int derivative = 0; derivative <= (problem_.rings[i].tangent ? 1 : 0); ++derivative)
            append(fixed, functional_at(field, i, derivative).normalized());
}

// What a displacement must leave alone, as columns: for m = 0 area and volume, and of a patch its rings; else for m < 2
// the place, that is, the rigid motions M is orthogonal to. At a plane of symmetry a translation along the axis and a
// tilt are odd, a translation across it is even.
Matrix ModeStability::fixed_functionals(int m, const MotionLaw& law, const SplineSpace& field, Forms& forms,
                                        const Matrix& M) const {
    const CurveSpace& space = *shape_.space;
    const Parity parity = field.parity();
    Matrix fixed(forms.mean.size(), 0);
    if (m == 0 && mirror(parity) >= 0) {
        const double whole = 2 * pi * space.images();
        forms.second_variation += whole * problem_.bending.alpha.value_or(0) * forms.M * forms.M.transpose();
        const double slope = problem_.loads.pressure_slope(shape_.observed.volume);
        forms.second_variation -= whole * slope * forms.volume * forms.volume.transpose();
        const Constraints& c = problem_.constraints;
        const bool flows = law.inextensible;
        if ((flows && !law.reservoir) || c.area) append(fixed, forms.area.normalized());
        if ((flows && law.keeps_volume) || c.volume) append(fixed, forms.volume.normalized());
        if (!law.inextensible && c.reduced_volume) {
            // V is fixed to a power of A: the multiplier of that, in the same units as those of area and volume.
            const double slope = 1.5 * shape_.observed.volume / shape_.observed.area;
            append(fixed, (forms.volume - slope * forms.area).normalized());
            forms.second_variation -=
                whole * shape_.lambda * slope / (2 * shape_.observed.area) * forms.area * forms.area.transpose();
        }
    }
    if (m == 0 && beads_) add_beads(forms, fixed);
    if (space.is_patch()) {
        fix_at_rings(field, fixed);
        return fixed;
    }
    // They hold it in its place, but along planes, and along the axis where they do not depend on z; beads in their
    // axis.
    const std::vector<Potential>& potentials = problem_.bending.potentials;
    const bool held = m == 1 && hold_axis(problem_, axial_force(problem_, shape_), std::sqrt(shape_.observed.area),
                                          shape_.reference_energy);
    const bool free =
        !held && std::ranges::none_of(potentials, m == 0 ? &Potential::acts_along_axis : &Potential::acts);
    const bool planes =
        !held && std::ranges::all_of(potentials, [](const Potential& p) { return p.kind == Potential::Kind::plane; });
    const Eigen::LDLT<Matrix> projection(forms.mass);
    for (int k = 0; k < 2; ++k) {
        const bool across = m == 1 && k == 0, exists = m == 0 ? k == 0 : m == 1 && (across || space.closed());
        if (!exists || mirror(parity) == (across ? -1 : 1) || !(free || (across && planes))) continue;
        const Vector motion = projection.solve(forms.rigid[k]);
        if (motion.dot(forms.mass * motion) < 1e-12 * forms.mass.sum()) continue;
        // Without friction a rigid motion dissipates nothing, and what it is orthogonal to does not matter.
        append(fixed, ((law.friction > 0 ? M : forms.mass) * motion).normalized());
    }
    return fixed;
}

void ModeStability::add_rates(int m, const MotionLaw& law, Parity parity, int count, ModeRates& out) const {
    check_pause();
    const SplineSpace field(shape_.space->splines(), parity);
    Forms forms = assemble(m, field);
    check_pause();
    const Matrix M = dissipation_form(m, law, parity, field, forms), basis = regular(m, field);
    check_pause();
    const Matrix fixed = fixed_functionals(m, law, field, forms, M);
    const Matrix free = basis * complement(basis.transpose() * fixed);
    const SmallEigenpairs found =
        smallest(free.transpose() * forms.second_variation * free, free.transpose() * M * free, count);

    out.softness += found.inverses;
    const double whole = (m == 0 ? 2 : 1) * pi * shape_.space->images();  // of cos^2(m theta)
    for (Eigen::Index k = 0; k < found.values.size(); ++k) {
        const auto place = std::upper_bound(out.rates.begin(), out.rates.end(), -found.values[k], std::greater<>());
        const Vector w = free * found.vectors.col(k);
        const double size = std::sqrt(whole * w.dot(forms.mass * w) / shape_.observed.area);
        constexpr int samples = 200;
        std::vector<double> values(samples + 1);
        for (int i = 0; i <= samples; ++i) values[i] = field.evaluate(w.data(), 1.0 * i / samples)[0] / size;
        out.displacements.insert(out.displacements.begin() + (place - out.rates.begin()), std::move(values));
        out.rates.insert(place, -found.values[k]);
    }
    if (static_cast<int>(out.rates.size()) > count) out.rates.resize(count), out.displacements.resize(count);
    if (out.rates.empty()) return;
    out.shape = out.displacements[0];
    const double largest = *std::max_element(out.shape.begin(), out.shape.end(),
                                             [](double x, double y) { return std::abs(x) < std::abs(y); });
    for (double& value : out.shape) value /= largest;
}

std::vector<ModeRates> mode_stability(const StationaryProblem& problem, const Equilibrium& shape, int last,
                                      const MotionLaw& law, int count) {
    const ModeStability stability(problem, shape);
    std::vector<ModeRates> out;
    for (int m = 0; m <= last; ++m) out.push_back(stability.rates(m, law, count));
    return out;
}

}  // namespace tubule::axisym
