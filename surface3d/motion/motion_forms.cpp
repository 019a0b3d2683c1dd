#include "surface3d/motion/motion_forms.hpp"

#include <algorithm>
#include <utility>

#include "surface3d/motion/axial_stretch.hpp"

namespace tubule::surface3d {
namespace {

// Whether the energy depends on H, on K: the density evaluated at a generic point.
struct Dependence {
    bool H, K;
};
Dependence dependence(const Bending& bending) {
    const CurvatureJet<double> f = density(bending, bending.H0 + 0.7310, 0.3170);
    return {f.H != 0 || bending.kg != 0, f.K != 0};
}

}  // namespace

int pressure_order(const SurfaceLaw& law, int order) {
    return !law.inextensible ? 0 : law.flows ? order - 1 : order;
}

MotionUnknowns::MotionUnknowns(const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending)
    : FieldUnknowns(mesh, law.components() + dependence(bending).H + dependence(bending).K + (bending.kg != 0),
                    pressure_order(law, mesh.order)) {
    int next = law.components() * nodes();
    if (dependence(bending).H) H = std::exchange(next, next + nodes());
    if (dependence(bending).K) K = std::exchange(next, next + nodes());
    if (bending.kg != 0) mu = std::exchange(next, next + nodes());
    if (law.inextensible) p = next;
}

namespace {

using Frame = Eigen::Matrix<double, 3, 2>;

// Building blocks of the forms of one cell, stacked over its quadrature points: one column a function, one row a point
// (two or three where there are components in the tangent plane).
struct CellTables {
    Eigen::MatrixXd phi, grad;  // functions of P_k, gradients
    Eigen::MatrixXd psi;        // pressure
    Eigen::MatrixXd psi_grad;
    Eigen::MatrixXd normal, normal_grad;  // v.nu, G(v) = grad(v.nu)
    Eigen::MatrixXd strain, divergence;   // D(v) as (11, 22, sqrt(2) 12), div_P v
};

// Many fields: the parts of the system that one cell adds to.
struct CellWork {
    CellTables t;
    CellMatrix advection;                  // (c.grad phi_b, phi_a), c = u* - w* along the surface
    Eigen::MatrixXd weighted2, weighted1;  // rows of grad and phi times what stands at the point
    Eigen::MatrixXd block;
    Eigen::VectorXd rhs, flux, widening, turning, load, force, row, column;
    Eigen::Matrix<double, Eigen::Dynamic, 4> beads;
    double own = 0, energy = 0, M = 0;  // of a stretch
};

class Assembler {
public:
    Assembler(const SurfaceSpace& space, const MotionUnknowns& unknowns, const SurfaceLaw& law, const Bending& bending,
              const StepBase& base)
        : space_(space),
          unknowns_(unknowns),
          law_(law),
          bending_(with_M(bending, base.M)),
          base_(base),
          table_(space.tabulation()),
          W_(potential_density_in_space(bending.potentials)),
          pressure_table_(space.tabulation(unknowns.p < 0 ? 1 : unknowns.last_mesh().order)),
          n_(space.width()),
          nv_(law.components() * n_),
          H_(unknowns.H < 0 ? -1 : nv_),
          K_(unknowns.K < 0 ? -1 : nv_ + (H_ < 0 ? 0 : n_)),
          mu_(unknowns.mu < 0 ? -1 : nv_ + n_ + (K_ < 0 ? 0 : n_)),
          p_(unknowns.p < 0 ? -1 : unknowns.width() - pressure_table_.functions()),
          of_cell_(law.free_period ? space.cells() : 0) {}

    void add_cell(int cell, CellWork& work, StepSystem& system);
    void sum_stretch(StepSystem& system) const;

private:
    // The state at a point. Many fields: all that the forms of a cell have there.
    struct Point {
        double dS, width, H, K, B2, trace;
        Eigen::Vector3d x;
        Eigen::Vector3d normal;         // continuous
        Frame e;                        // orthonormal, tangential
        Eigen::Matrix<double, 2, 3> B;  // e^T B
        Eigen::Matrix2d S;              // HP - B
        CurvatureJet<double> f;
        // What the slope of H0 adds to grad f_H + S grad f_K; the force along the surface, and its derivatives in H and
        // K.
        Eigen::Vector2d bend, push, push_H, push_K;
        // Potentials of places; the densities of G and dG/dP of each bead; all that acts, at fixed positions of beads.
        PointPotential W, of_beads[4], places;
    };
    // By how much X* is expected to be ahead along the normal of where u = 0 would leave the surface.
    struct ExpectedMotion {
        CellColumns<3> moved;  // u* te - w* te + X* - Xbar, of which the normal part counts
        CellColumns<1> along;  // where nothing flows: te u*.nu
        struct Height {
            double value;
            Eigen::Vector2d slope;
        };
        template <class Phi, class Grad>
        Height at(const Point& s, const Phi& phi, const Grad& grad) const {
            const Eigen::Vector3d d = moved * phi;
            return {s.normal.dot(d) + along.dot(phi),
                    grad * (moved.transpose() * s.normal + along.transpose()) - s.B * d};
        }
    };

    // W_nu - W H, theory.md (2.22), of which the force is the negative.
    static double variation(const PointPotential& W, const Point& s) {
        return W.slope.dot(s.normal) - W.value * s.trace;
    }

    void size(CellWork& work) const;
    Point point(const SurfacePoint<double>& p, const CellColumns<3>& gradient, const CellColumns<3>& normals, int cell,
                int q) const;
    void fill_tables(const Point& at, const CellColumns<3>& gradient, int q, CellTables& t) const;
    ExpectedMotion expected_motion(int cell) const;
    void add_advection(const std::vector<Point>& at, int cell, CellWork& work) const;
    void add_momentum(const std::vector<Point>& at, int cell, CellWork& work) const;
    Eigen::Vector2d slope_of_H(int cell, int q, const CellTables& t) const;
    void add_gradients(const std::vector<Point>& at, int cell, CellWork& work) const;
    void add_bending(const std::vector<Point>& at, int cell, CellWork& work) const;
    void add_varying_H0(const std::vector<Point>& at, CellWork& work) const;
    void add_pressure(const std::vector<Point>& at, CellWork& work) const;
    void add_sources(const std::vector<Point>& at, CellWork& work) const;
    void add_places(const std::vector<Point>& at, int cell, CellWork& work) const;
    void add_curvature_evolution(const std::vector<Point>& at, int cell, CellWork& work) const;
    void add_stretch(const std::vector<Point>& at, int cell, CellWork& work) const;

    const SurfaceSpace& space_;
    const MotionUnknowns& unknowns_;
    const SurfaceLaw& law_;
    const Bending bending_;
    const StepBase& base_;
    const Tabulation& table_;
    const std::optional<Formula> W_;
    Tabulation pressure_table_;
    int n_, nv_, H_, K_, mu_, p_;           // nodes and velocities of a cell, first columns of its blocks
    std::vector<Eigen::Vector3d> of_cell_;  // own, energy and M of a stretch: their sum does not depend on the threads
};

void Assembler::size(CellWork& work) const {
    const int Q = table_.points(), w = unknowns_.width();
    CellTables& t = work.t;
    t.phi.resize(Q, n_), t.grad.resize(2 * Q, n_);
    t.normal.resize(Q, nv_), t.normal_grad.resize(2 * Q, nv_);
    if (law_.flows) t.strain.resize(3 * Q, nv_);
    if (p_ >= 0) {
        t.divergence.resize(Q, nv_), t.psi.resize(Q, pressure_table_.functions());
        if (!law_.flows) t.psi_grad.resize(2 * Q, pressure_table_.functions());
    }
    work.weighted1.resize(Q, n_), work.weighted2.resize(2 * Q, n_);
    work.block.setZero(w, w), work.rhs.setZero(w), work.flux.setZero(w), work.widening.setZero(w);
    work.turning.setZero(w), work.beads.setZero(base_.beads ? w : 0, 4), work.load.setZero(w), work.force.setZero(w);
    if (law_.free_period) work.row.setZero(w), work.column.setZero(w), work.own = work.energy = work.M = 0;
}

Assembler::Point Assembler::point(const SurfacePoint<double>& p, const CellColumns<3>& gradient,
                                  const CellColumns<3>& normals, int cell, int q) const {
    Point at;
    const auto phi = table_.value.col(q);
    at.dS = table_.weight[q] * p.area;
    at.width = triangle_width(p);
    at.x = p.x;
    at.H = at.K = 0;
    for (int a = 0; a < n_; ++a) {
        at.H += phi[a] * base_.fields.H[space_.node(cell, a)];
        at.K += phi[a] * base_.fields.K[space_.node(cell, a)];
    }
    at.normal = (normals * phi).normalized();
    const Eigen::Matrix3d B = shape_operator(p, gradient, normals);
    at.e.col(0) = p.tangent[0].normalized();
    at.e.col(1) = p.normal.cross(at.e.col(0));
    at.B = at.e.transpose() * B;
    at.trace = B.trace();
    at.B2 = B.squaredNorm();
    at.S = at.trace * Eigen::Matrix2d::Identity() - at.B * at.e;
    const PointH0 H0(bending_, gather_H0(space_, base_.fields.H0, cell), gradient, phi, at.H, at.K);
    at.f = density_at(bending_, H0.value, at.H, at.K);
    const Eigen::Vector2d slope = at.e.transpose() * H0.slope;
    at.bend = H0.f0.H * slope + H0.f0.K * (at.S * slope);
    at.push = H0.f0.f * slope, at.push_H = H0.f0.H * slope, at.push_K = H0.f0.K * slope;
    at.W = at.places = PointPotential(W_, p.x);
    for (int k = 0; k < 2 && base_.beads; ++k) {
        const double P = base_.bead_numbers[2 * k];
        if (!is_in_reach(p.x, k == 0 ? -P : P, base_.beads->width())) continue;
        at.of_beads[2 * k] = PointPotential(base_.beads->density(k), p.x, P);
        at.of_beads[2 * k + 1] = PointPotential(base_.beads->density_by_P(k), p.x, P);
        at.places.add(base_.force * base_.bead_numbers[2 * k + 1], at.of_beads[2 * k]);
    }
    return at;
}

void Assembler::fill_tables(const Point& at, const CellColumns<3>& gradient, int q, CellTables& t) const {
    const auto phi = table_.value.col(q);
    const Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, max_cell_nodes> g = at.e.transpose() * gradient;
    t.phi.row(q) = phi.transpose();
    t.grad.middleRows<2>(2 * q) = g;
    if (p_ >= 0) t.psi.row(q) = pressure_table_.value.col(q).transpose();
    if (!law_.flows) {
        t.normal.row(q) = phi.transpose();
        t.normal_grad.middleRows<2>(2 * q) = g;
        if (p_ >= 0) {
            t.divergence.row(q) = -at.H * phi.transpose();
            t.psi_grad.middleRows<2>(2 * q) = g;  // the pressure is P_k as well
        }
        return;
    }
    for (int d = 0; d < 3; ++d) {
        const auto columns = Eigen::seqN(d * n_, n_);
        const double e1 = at.e(d, 0), e2 = at.e(d, 1);
        t.normal(q, columns) = at.normal[d] * phi.transpose();
        t.normal_grad(Eigen::seqN(2 * q, 2), columns) = at.normal[d] * g - at.B.col(d) * phi.transpose();
        t.strain(3 * q, columns) = e1 * g.row(0);
        t.strain(3 * q + 1, columns) = e2 * g.row(1);
        t.strain(3 * q + 2, columns) = (e1 * g.row(1) + e2 * g.row(0)) / std::sqrt(2.0);
        if (p_ >= 0) t.divergence(q, columns) = e1 * g.row(0) + e2 * g.row(1);
    }
}

Assembler::ExpectedMotion Assembler::expected_motion(int cell) const {
    ExpectedMotion out{CellColumns<3>(3, n_), CellColumns<1>::Zero(1, n_)};
    for (int a = 0; a < n_; ++a) {
        const int i = space_.node(cell, a);
        out.moved.col(a) = base_.displacement.col(i) - base_.te * base_.mesh_velocity.col(i);
        if (law_.flows)
            for (int d = 0; d < 3; ++d) out.moved(d, a) += base_.te * base_.velocity[d * unknowns_.nodes() + i];
        else
            out.along[a] = base_.te * base_.velocity[i];
    }
    return out;
}

void Assembler::add_advection(const std::vector<Point>& at, int cell, CellWork& work) const {
    work.advection.setZero(n_, n_);
    if (law_.inertia == 0) return;
    const CellTables& t = work.t;
    CellColumns<3> across(3, n_);
    for (int a = 0; a < n_; ++a) {
        const int i = space_.node(cell, a);
        for (int d = 0; d < 3; ++d)
            across(d, a) = base_.velocity[d * unknowns_.nodes() + i] - base_.mesh_velocity(d, i);
    }
    for (int q = 0; q < table_.points(); ++q) {
        const Eigen::Vector2d c = at[q].e.transpose() * (across * table_.value.col(q));
        work.advection.noalias() +=
            (at[q].dS * t.phi.row(q).transpose()) * (c.transpose() * t.grad.middleRows<2>(2 * q));
    }
}

// theory.md (10.5): inertia (u - ubar, v)/te + inertia ((u* - w*).grad u, v) + friction (u, v) + 2 viscosity (D(u),
// D(v))
void Assembler::add_momentum(const std::vector<Point>& at, int cell, CellWork& work) const {
    const CellTables& t = work.t;
    const int Q = table_.points();
    const double rate = law_.inertia / base_.te, drag = rate + law_.friction;
    CellMatrix scalar = CellMatrix::Zero(n_, n_);
    for (int q = 0; q < Q; ++q) work.weighted1.row(q) = at[q].dS * t.phi.row(q);
    if (drag != 0) scalar.noalias() += drag * (t.phi.transpose() * work.weighted1);
    if (law_.inertia != 0) {
        scalar += law_.inertia * work.advection;
        CellColumns<3> past(3, n_);
        for (int a = 0; a < n_; ++a)
            for (int d = 0; d < 3; ++d) past(d, a) = base_.past[d * unknowns_.nodes() + space_.node(cell, a)];
        for (int q = 0; q < Q; ++q) {
            const Eigen::Vector3d bar = past * table_.value.col(q);
            for (int d = 0; d < 3; ++d)
                work.rhs.segment(d * n_, n_) += (rate * bar[d]) * work.weighted1.row(q).transpose();
        }
    }
    for (int d = 0; d < law_.components(); ++d) work.block.block(d * n_, d * n_, n_, n_) += scalar;
    if (law_.viscosity == 0) return;
    Eigen::MatrixXd weighted = t.strain;
    for (int q = 0; q < Q; ++q) weighted.middleRows<3>(3 * q) *= 2 * law_.viscosity * at[q].dS;
    work.block.topLeftCorner(nv_, nv_).noalias() += t.strain.transpose() * weighted;
}

Eigen::Vector2d Assembler::slope_of_H(int cell, int q, const CellTables& t) const {
    return t.grad.middleRows<2>(2 * q) * space_.gather(base_.fields.H, cell);
}

// The gradient term, theory.md (2.26), (10.25): -(grad mu, G(v)) + (|B|^2 mu + kg (2 B - H) (grad H, grad H), v.nu),
// linear in mu and H about those of X*, with (mu, phi) - 2 kg (grad H, grad phi) = 0.
void Assembler::add_gradients(const std::vector<Point>& at, int cell, CellWork& work) const {
    if (mu_ < 0) return;
    const CellTables& t = work.t;
    const int Q = table_.points();
    const double kg = bending_.kg;
    Eigen::MatrixXd slopes(Q, n_);  // of the term that is quadratic in grad H
    Eigen::VectorXd force = Eigen::VectorXd::Zero(nv_);
    for (int q = 0; q < Q; ++q) {
        const Point& s = at[q];
        const auto g = t.grad.middleRows<2>(2 * q);
        const Eigen::Vector2d H = slope_of_H(cell, q, t);
        const Eigen::Vector2d slope = kg * (4 * (s.B * s.e) * H - 2 * s.trace * H);
        slopes.row(q) = s.dS * (slope.transpose() * g);
        force += (s.dS * slope.dot(H) / 2) * t.normal.row(q).transpose();
        work.weighted2.middleRows<2>(2 * q) = s.dS * g;
        work.weighted1.row(q) = s.dS * t.phi.row(q);
    }
    const CellMatrix stiffness = t.grad.transpose() * work.weighted2, mass = t.phi.transpose() * work.weighted1;
    work.block.block(mu_, mu_, n_, n_) += mass;
    work.block.block(mu_, H_, n_, n_) -= 2 * kg * stiffness;
    for (int q = 0; q < Q; ++q) work.weighted1.row(q) *= at[q].B2;
    auto by_mu = work.block.block(0, mu_, nv_, n_);
    by_mu.noalias() += t.normal.transpose() * work.weighted1;
    by_mu.noalias() -= t.normal_grad.transpose() * work.weighted2;
    work.block.block(0, H_, nv_, n_).noalias() += t.normal.transpose() * slopes;
    work.rhs.head(nv_) += force;
    work.force.head(nv_) += force;
    work.force.head(nv_) -= by_mu * space_.gather(base_.fields.mu, cell);
}

// -(grad f_H + (HP-B) grad f_K, G(v)) + (|B|^2 f_H + H K f_K - H f, v.nu) - tension (H - H*, v.nu), linear in H and K
// about those of X*
void Assembler::add_bending(const std::vector<Point>& at, int cell, CellWork& work) const {
    const CellTables& t = work.t;
    const int Q = table_.points();
    const auto add = [&](int columns, const auto& gradient, const auto& value) {
        if (columns < 0) return;
        for (int q = 0; q < Q; ++q) {
            work.weighted2.middleRows<2>(2 * q) = -at[q].dS * (gradient(at[q]) * t.grad.middleRows<2>(2 * q));
            work.weighted1.row(q) = at[q].dS * value(at[q]) * t.phi.row(q);
        }
        auto block = work.block.block(0, columns, nv_, n_);
        block.noalias() += t.normal_grad.transpose() * work.weighted2;
        block.noalias() += t.normal.transpose() * work.weighted1;
    };
    const auto in_H = [&](const Point& s) {
        return s.B2 * s.f.HH + s.trace * s.K * s.f.HK - s.trace * s.f.H - base_.tension - s.places.value;
    };
    const auto in_K = [](const Point& s) { return s.B2 * s.f.HK + s.trace * s.K * s.f.KK - s.trace * s.f.K; };
    add(
        H_, [](const Point& s) { return Eigen::Matrix2d(s.f.HH * Eigen::Matrix2d::Identity() + s.f.HK * s.S); }, in_H);
    add(
        K_, [](const Point& s) { return Eigen::Matrix2d(s.f.HK * Eigen::Matrix2d::Identity() + s.f.KK * s.S); }, in_K);
    for (int q = 0; q < Q; ++q) {
        const Point& s = at[q];
        double known = s.B2 * s.f.H + s.trace * s.K * s.f.K - s.trace * s.f.f + variation(s.W, s);
        if (H_ >= 0) known -= in_H(s) * s.H;
        if (K_ >= 0) known -= in_K(s) * s.K;
        work.rhs.head(nv_) -= (s.dS * known) * t.normal.row(q).transpose();
        work.force.head(nv_) -= (s.dS * known) * t.normal.row(q).transpose();
        work.flux.head(nv_) += s.dS * t.normal.row(q).transpose();
        if (bending_.alpha) work.turning.head(nv_) += (s.dS * (s.B2 - s.trace * s.H)) * t.normal.row(q).transpose();
        for (int i = 0; i < work.beads.size() / unknowns_.width(); ++i)
            work.beads.col(i).head(nv_) += (s.dS * variation(s.of_beads[i], s)) * t.normal.row(q).transpose();
        if (!law_.inextensible) work.widening.head(nv_) -= (s.dS * s.H) * t.normal.row(q).transpose();
    }
    if (H_ >= 0) work.force.head(nv_) -= work.block.block(0, H_, nv_, n_) * space_.gather(base_.fields.H, cell);
    if (K_ >= 0) work.force.head(nv_) -= work.block.block(0, K_, nv_, n_) * space_.gather(base_.fields.K, cell);
}

// What a varying H0 adds, known on X* but where nothing flows: -(f_HH0 grad H0 + (HP-B) f_KH0 grad H0, G(v)) - (f_H0
// grad H0, v), and where nothing flows (f_H0 grad H0, grad q)/friction, as u has f_H0 grad H0/friction along the
// surface: theory.md (10.20).
void Assembler::add_varying_H0(const std::vector<Point>& at, CellWork& work) const {
    if (base_.fields.H0.size() == 0) return;
    const CellTables& t = work.t;
    Eigen::VectorXd force = Eigen::VectorXd::Zero(nv_);
    for (int q = 0; q < table_.points(); ++q) {
        const Point& s = at[q];
        force += s.dS * (t.normal_grad.middleRows<2>(2 * q).transpose() * s.bend);
        if (law_.flows) {
            const Eigen::Vector3d push = s.dS * (s.e * s.push);
            for (int d = 0; d < 3; ++d) force.segment(d * n_, n_) += push[d] * t.phi.row(q).transpose();
        } else if (p_ >= 0) {
            const Eigen::MatrixXd slopes = (s.dS / law_.friction) * t.psi_grad.middleRows<2>(2 * q).transpose();
            Eigen::Vector2d known = s.push;
            const auto add = [&](int columns, const Eigen::Vector2d& by, double value) {
                if (columns < 0) return;
                work.block.block(p_, columns, slopes.rows(), n_) += (slopes * by) * t.phi.row(q);
                known -= value * by;
            };
            add(H_, s.push_H, s.H), add(K_, s.push_K, s.K);
            work.rhs.segment(p_, slopes.rows()) -= slopes * known;
        }
    }
    work.rhs.head(nv_) += force;
    work.force.head(nv_) += force;
}

// -(p, div_P v) and -(div_P u, q); where nothing flows u = (u.nu) nu - grad p/friction.
void Assembler::add_pressure(const std::vector<Point>& at, CellWork& work) const {
    if (p_ < 0) return;
    const CellTables& t = work.t;
    const int n_p = pressure_table_.functions();
    Eigen::MatrixXd weighted = t.psi;
    for (int q = 0; q < table_.points(); ++q) {
        weighted.row(q) *= -at[q].dS;
        work.load.segment(p_, n_p) -= weighted.row(q).transpose();
    }
    const Eigen::MatrixXd block = t.divergence.transpose() * weighted;
    work.block.block(0, p_, nv_, n_p) += block;
    work.block.block(p_, 0, n_p, nv_) += block.transpose();
    if (law_.flows) return;
    Eigen::MatrixXd slope = t.psi_grad;
    for (int q = 0; q < table_.points(); ++q) slope.middleRows<2>(2 * q) *= -at[q].dS / law_.friction;
    work.block.block(p_, p_, n_p, n_p).noalias() += t.psi_grad.transpose() * slope;
}

// (force, v) and, with div_P u = mass, -(mass, q), known on X*; where nothing flows the force has the velocity
// force/friction along the surface: theory.md (3.26).
void Assembler::add_sources(const std::vector<Point>& at, CellWork& work) const {
    if (!law_.source.act()) return;
    const CellTables& t = work.t;
    for (int q = 0; q < table_.points(); ++q) {
        const Point& s = at[q];
        const Eigen::Vector3d force = s.dS * law_.body_force(s.x, base_.time);
        if (law_.flows)
            for (int d = 0; d < 3; ++d) work.rhs.segment(d * n_, n_) += force[d] * t.phi.row(q).transpose();
        else
            work.rhs.head(nv_) += force.dot(s.normal) * t.normal.row(q).transpose();
        if (p_ < 0) continue;
        auto known = work.rhs.segment(p_, t.psi.cols());
        known -= s.dS * law_.mass_source(s.x, base_.time) * t.psi.row(q).transpose();
        if (!law_.flows)
            known -= t.psi_grad.middleRows<2>(2 * q).transpose() * (s.e.transpose() * force) / law_.friction;
    }
}

// How the force of densities W of places, -(W_nu - W H, v.nu) of theory.md (2.22), changes as the surface moves by xi
// along the normal: -(W_nunu - W_nu H) xi + grad W.grad xi; what H adds is implicit with it, as of a tension.
void Assembler::add_places(const std::vector<Point>& at, int cell, CellWork& work) const {
    if (!W_ && !base_.beads) return;
    const CellTables& t = work.t;
    const ExpectedMotion moved = expected_motion(cell);
    Eigen::MatrixXd changes(table_.points(), nv_);
    for (int q = 0; q < table_.points(); ++q) {
        const Point& s = at[q];
        const PointPotential& W = s.places;
        const double stiffness = s.normal.dot(W.second * s.normal) - W.slope.dot(s.normal) * s.trace;
        const Eigen::Vector2d along = s.e.transpose() * W.slope;
        changes.row(q) =
            (s.dS * base_.te) * (stiffness * t.normal.row(q) - along.transpose() * t.normal_grad.middleRows<2>(2 * q));
        const auto [height, slope] = moved.at(s, table_.value.col(q), t.grad.middleRows<2>(2 * q));
        work.rhs.head(nv_) += (s.dS * (stiffness * height - along.dot(slope))) * t.normal.row(q).transpose();
    }
    work.block.topLeftCorner(nv_, nv_).noalias() += t.normal.transpose() * changes;
}

// (H, phi) + te (c.grad (H - H*), phi) + te L_H(u) = (H*, phi) + L_H(X* - Xbar) + te L_H(u* - w*), K alike, with
// c = u* - w* along the surface if there is inertia, else 0, L_H on the left and of X* - Xbar and u* - w* taken
// 1 + curvature_stabilisation |B| (width) times, and what a velocity makes of them:
//   L_H(v) = (grad(v.nu), grad phi) - (|B|^2 v.nu, phi)
//   L_K(v) = ((HP-B) grad(v.nu), grad phi) - (H K v.nu, phi)
// div(HP-B) = 0 makes the second the transpose of K's force, as the first is of H's.
void Assembler::add_curvature_evolution(const std::vector<Point>& at, int cell, CellWork& work) const {
    const CellTables& t = work.t;
    const int Q = table_.points();
    const ExpectedMotion moved = expected_motion(cell);
    const auto add = [&](int rows, const Eigen::VectorXd& known, const auto& gradient, const auto& value) {
        if (rows < 0) return;
        for (int q = 0; q < Q; ++q) {
            const Point& s = at[q];
            const auto phi = table_.value.col(q);
            const auto g = t.grad.middleRows<2>(2 * q);
            const Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, max_cell_nodes> Sg = gradient(s) * g;
            const auto [height, slope] = moved.at(s, phi, g);
            work.rhs.segment(rows, n_) += s.dS * (Sg.transpose() * slope - value(s) * height * phi);
            work.weighted2.middleRows<2>(2 * q) = (base_.te * s.dS) * Sg;
            work.weighted1.row(q) = (base_.te * s.dS * value(s)) * t.phi.row(q);
        }
        auto block = work.block.block(rows, 0, n_, nv_);
        block.noalias() += work.weighted2.transpose() * t.normal_grad;
        block.noalias() -= work.weighted1.transpose() * t.normal;
        for (int q = 0; q < Q; ++q) work.weighted1.row(q) = at[q].dS * t.phi.row(q);
        CellMatrix own = base_.te * work.advection;
        own.noalias() += t.phi.transpose() * work.weighted1;
        work.block.block(rows, rows, n_, n_) += own;
        work.rhs.segment(rows, n_).noalias() += own * space_.gather(known, cell);
    };
    add(
        H_, base_.fields.H,
        [&](const Point& s) {
            const double more = base_.curvature_stabilisation * std::sqrt(s.B2) * s.width;
            return Eigen::Matrix2d((1 + more) * Eigen::Matrix2d::Identity());
        },
        [](const Point& s) { return s.B2; });
    add(
        K_, base_.fields.K, [](const Point& s) { return s.S; }, [](const Point& s) { return s.trace * s.K; });
}

// The column and the row of a stretch e, u = .. + e z e_z: theory.md (3.19), (10.18). Nodes go along with it, so that H
// and K change as those of points of the membrane.
void Assembler::add_stretch(const std::vector<Point>& at, int cell, CellWork& work) const {
    if (!law_.free_period) return;
    const CellTables& t = work.t;
    for (int q = 0; q < table_.points(); ++q) {
        const Point& s = at[q];
        const AxialStretch by = axial_stretch(s.e.row(2).transpose(), s.B * s.e, s.H, s.K);
        const auto phi = t.phi.row(q).transpose();
        work.energy += s.dS * (s.f.H * by.H + s.f.K * by.K + s.f.f * by.area);
        work.M += s.dS * (by.H + s.H * by.area);
        const auto add = [&](int first, double rate, double force, double value) {
            if (first < 0) return;
            work.column.segment(first, n_) -= (base_.te * s.dS * rate) * phi;
            work.rhs.segment(first, n_) -= (base_.stretch * s.dS * rate) * phi;
            work.row.segment(first, n_) += (s.dS * force) * phi;
            work.energy -= s.dS * force * value;
        };
        add(H_, by.H, s.f.HH * by.H + s.f.HK * by.K + s.f.H, s.H);
        add(K_, by.K, s.f.HK * by.H + s.f.KK * by.K + s.f.K * (2 - 3 * by.area), s.K);
        if (mu_ >= 0) {
            const Eigen::Vector2d H = slope_of_H(cell, q, t),
                                  slope = 2 * bending_.kg * (by.area * H - 2 * by.along.dot(H) * by.along);
            work.row.segment(mu_, n_) += (s.dS * by.H) * phi;
            work.row.segment(H_, n_) += s.dS * (t.grad.middleRows<2>(2 * q).transpose() * slope);
            work.energy -= s.dS * slope.dot(H) / 2;
        }
        if (p_ >= 0) work.row.tail(t.psi.cols()) -= (s.dS * by.area) * t.psi.row(q).transpose();
        if (law_.viscosity == 0) continue;
        const double drag = 2 * law_.viscosity * s.dS;
        const Eigen::Vector3d D(by.along[0] * by.along[0], by.along[1] * by.along[1],
                                std::sqrt(2.0) * by.along[0] * by.along[1]);
        work.row.head(nv_) += drag * (t.strain.middleRows<3>(3 * q).transpose() * D);
        work.own += drag * by.area * by.area;
    }
    work.column.head(nv_) = work.row.head(nv_);
    if (p_ >= 0) work.column.tail(t.psi.cols()) = work.row.tail(t.psi.cols());
}

void Assembler::add_cell(int cell, CellWork& work, StepSystem& system) {
    size(work);
    const CellColumns<3> X = cell_nodes(*base_.mesh, cell), normals = space_.gather(base_.fields.normal, cell);
    std::vector<Point> at;
    at.reserve(table_.points());
    for (int q = 0; q < table_.points(); ++q) {
        const SurfacePoint<double> p = tangent_point(X, table_, q);
        const CellColumns<3> gradient = gradients(p, table_, q);
        at.push_back(point(p, gradient, normals, cell, q));
        fill_tables(at.back(), gradient, q, work.t);
    }
    add_advection(at, cell, work);
    add_momentum(at, cell, work);
    add_gradients(at, cell, work);
    add_bending(at, cell, work);
    add_varying_H0(at, work);
    add_pressure(at, work);
    add_sources(at, work);
    add_places(at, cell, work);
    add_curvature_evolution(at, cell, work);
    add_stretch(at, cell, work);
    unknowns_.add(system.A, cell, work.block);
    if (law_.inertia != 0) space_.add(system.advection, cell, work.advection);
    const int* numbers = unknowns_.of_cell(cell);
    for (int i = 0; i < unknowns_.width(); ++i) {
        system.b[numbers[i]] += work.rhs[i];
        system.flux[numbers[i]] += work.flux[i];
        system.widening[numbers[i]] += work.widening[i];
        system.turning[numbers[i]] += work.turning[i];
        if (base_.beads) system.beads.row(numbers[i]) += work.beads.row(i);
        system.pressure_load[numbers[i]] += work.load[i];
        system.force[numbers[i]] += work.force[i];
    }
    if (!law_.free_period) return;
    for (int i = 0; i < unknowns_.width(); ++i) {
        system.stretch.row[numbers[i]] += work.row[i];
        system.stretch.column[numbers[i]] += work.column[i];
    }
    of_cell_[cell] = {work.own, work.energy, work.M};
}

void Assembler::sum_stretch(StepSystem& system) const {
    if (!law_.free_period) return;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& of : of_cell_) sum += of;
    system.stretch.own = sum[0], system.stretch.energy = sum[1], system.stretch.M = sum[2];
    system.stretch.rate = stretch_rate(space_, *base_.mesh);
}

}  // namespace

void assemble(const SurfaceSpace& space, const MotionUnknowns& unknowns, const SurfaceLaw& law, const Bending& bending,
              const StepBase& base, StepSystem& system) {
    if (system.A.size() == 0) system.A = unknowns.pattern();
    std::fill_n(system.A.valuePtr(), system.A.nonZeros(), 0.0);
    if (law.inertia != 0 && system.advection.size() == 0) system.advection = space.pattern();
    std::fill_n(system.advection.valuePtr(), system.advection.nonZeros(), 0.0);
    system.b.setZero(unknowns.size());
    system.flux.setZero(unknowns.size());
    system.pressure_load.setZero(unknowns.size());
    system.widening.setZero(unknowns.size());
    system.turning.setZero(unknowns.size());
    system.beads.setZero(base.beads ? unknowns.size() : 0, 4);
    system.force.setZero(unknowns.size());
    if (law.free_period) system.stretch.row.setZero(unknowns.size()), system.stretch.column.setZero(unknowns.size());
    Assembler assembler(space, unknowns, law, bending, base);
    space.for_each_cell([&](int cell) {
        static thread_local CellWork work;
        assembler.add_cell(cell, work, system);
    });
    assembler.sum_stretch(system);
}

}  // namespace tubule::surface3d
