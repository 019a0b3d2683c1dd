#include "surface3d/motion/moving_surface.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "common/geometry/profile_point.hpp"
#include "common/solve/dense.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/motion/motion_forms.hpp"

namespace tubule::surface3d {
namespace {

constexpr int most_corrections = 5;
constexpr double kept = 1e-12;            // area and volume, relative
constexpr double still_kept = 1e-8;       // a larger defect rejects the step
constexpr double slight_friction = 1e-4;  // relative to viscosity/area; used if nothing else resists rigid motions

}  // namespace

MovingSurface::MovingSurface(const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending,
                             const MotionControl& control)
    : mesh_(mesh),
      space_(mesh),
      law_(law),
      bending_(bending),
      control_(control),
      mesh_motion_(control.follow_curvature) {
    if (const int order = pressure_order(law, mesh.order); order > 0)
        pressure_mesh_ = order == mesh.order ? mesh : with_order(mesh, order);
    if (law.beads) beads_.emplace(law.beads->width, BeadEquations::in_space);
    const double size = bending.potentials.empty() ? 1 : node_positions(mesh).cwiseAbs().maxCoeff();
    free_motions_ = free_motions(mesh, bending.potentials, beads_.has_value(), Eigen::Vector3d::Zero(), size);
    free_motions_.bottomRows<3>() /= size;
    if (law.viscosity == 0 || law.inertia != 0 || law.friction != 0) return;
    holds_rigid_motions_ = true;
    law_.friction = slight_friction * law.viscosity / extent(space_, mesh).area;
}

MotionState MovingSurface::start(const CurvedMesh& mesh, double time) {
    MotionState s;
    s.time = time;
    s.X = node_positions(mesh), s.period = mesh.period;
    s.w = VectorField::Zero(3, mesh.size());
    s.u = Eigen::VectorXd::Zero(law_.components() * mesh.size());
    s.p = Eigen::VectorXd::Zero(pressure_mesh_.size());
    const MotionFields f = fields(mesh);
    correct(f, law_.keeps_volume && !area_is_volume(mesh, f), s);
    return s;
}

MotionState MovingSurface::start(const CurvedMesh& at, const Eigen::VectorXd& u, const Eigen::VectorXd& momenta,
                                 double time) {
    MotionState s = start(at, time);
    s.u = u;
    keep_momenta(momenta, 0, s);
    const CurvedMesh now = mesh(s);
    const MotionFields f = fields(now);
    s.w = node_velocity(s, now, f, flux(s.u, now, f), control_.relaxation);
    return s;
}

BeadNumbers MovingSurface::bead_numbers(const CurvedMesh& mesh) const {
    const BeadNumbers out = surface3d::bead_numbers(space_, mesh, *beads_, 1);
    if (!out.allFinite()) throw SolveError("a bead has lost the membrane at its pole");
    return out;
}

double MovingSurface::bead_bend(const CurvedMesh& mesh, int bead, double P) const {
    const BeadSurface on{[&](const Formula& W, double at) { return place_integral(space_, mesh, W, at); }, {}};
    return beads_->slopes_in_P(on, bead, P)[1];
}

double MovingSurface::distance_rate(const CurvedMesh& mesh, const BeadNumbers& at, const VectorField& v) const {
    double sum = 0;
    for (int k = 0; k < 2; ++k) sum -= at[2 * k + 1] * place_rate(space_, mesh, beads_->density(k), at[2 * k], v);
    return sum;
}

double MovingSurface::length(const CurvedMesh& mesh) const {
    return beads_ ? BeadEquations::distance(bead_numbers(mesh)) : mesh.period;
}

CurvedMesh MovingSurface::mesh(const VectorField& X, double period) const {
    CurvedMesh out = with_nodes(mesh_, X);
    out.period = period;
    return out;
}

MotionFields MovingSurface::fields(const CurvedMesh& mesh) {
    if (projection_)
        projection_->update(space_, mesh);
    else
        projection_.emplace(space_, mesh);
    MotionFields out = motion_fields(space_, mesh, *projection_, bending_.kg);
    out.H0 = H0_;
    return out;
}

VectorField MovingSurface::node_velocity(const MotionState& state, const CurvedMesh& mesh, const MotionFields& fields,
                                         const Eigen::VectorXd& flux, double relaxation) {
    return H0_.size() > 0 ? velocity(state, fields) : mesh_velocity(mesh, fields, flux, relaxation);
}

VectorField MovingSurface::mesh_velocity(const CurvedMesh& mesh, const MotionFields& fields,
                                         const Eigen::VectorXd& flux, double relaxation) {
    return mesh_motion_.velocity(space_, mesh, fields, *projection_, flux, relaxation);
}

Eigen::VectorXd MovingSurface::flux(const Eigen::VectorXd& u, const CurvedMesh& mesh,
                                    const MotionFields& fields) const {
    const Tabulation& table = space_.tabulation();
    const auto out = load<1>(space_, mesh, [&](int cell, const CellColumns<3>& X, int q, CellColumns<1>& sum) {
        const SurfacePoint<double> p = tangent_point(X, table, q);
        const auto phi = table.value.col(q);
        const Eigen::Vector3d normal = (space_.gather(fields.normal, cell) * phi).normalized();
        double speed = 0;
        for (int a = 0; a < space_.width(); ++a) {
            const int i = space_.node(cell, a);
            if (law_.flows)
                for (int d = 0; d < 3; ++d) speed += phi[a] * normal[d] * u[d * nodes() + i];
            else
                speed += phi[a] * u[i];
        }
        sum += (table.weight[q] * p.area * speed) * phi.transpose();
    });
    return out.transpose();
}

VectorField MovingSurface::velocity(const MotionState& state, const MotionFields& fields) const {
    const int n = nodes();
    VectorField out(3, n);
    if (law_.flows) {
        for (int d = 0; d < 3; ++d) out.row(d) = state.u.segment(d * n, n).transpose();
        return out;
    }
    for (int i = 0; i < n; ++i) out.col(i) = state.u[i] * fields.normal.col(i);
    if (!law_.inextensible) return out;
    const Tabulation& table = space_.tabulation();
    return out - (*projection_)(
                     load<3>(space_, mesh(state), [&](int cell, const CellColumns<3>& X, int q, CellColumns<3>& sum) {
                         const SurfacePoint<double> p = tangent_point(X, table, q);
                         const CellColumns<3> gradient = gradients(p, table, q);
                         const auto phi = table.value.col(q);
                         const PointH0 H0(bending_, gather_H0(space_, fields.H0, cell), gradient, phi,
                                          space_.gather(fields.H, cell).dot(phi),
                                          space_.gather(fields.K, cell).dot(phi));
                         Eigen::Vector3d slope = gradient * space_.gather(state.p, cell) - H0.push();
                         if (law_.source.push()) {
                             const Eigen::Vector3d force = law_.body_force(p.x, state.time);
                             slope -= force - p.normal.dot(force) * p.normal;
                         }
                         sum += (table.weight[q] * p.area / law_.friction * slope) * table.value.col(q).transpose();
                     }));
}

Eigen::VectorXd MovingSurface::pressure_at_nodes(const MotionState& state) const {
    const CurvedMesh& own = pressure_mesh_;
    if (own.order == mesh_.order) return state.p;
    const Tabulation table = at_nodes(own.order, mesh_.order);
    Eigen::VectorXd out(mesh_.size());
    for (int cell = 0; cell < mesh_.triangles(); ++cell)
        for (int a = 0; a < mesh_.nodes_per_cell(); ++a) {
            double p = 0;
            for (int b = 0; b < own.nodes_per_cell(); ++b) p += table.value(b, a) * state.p[own.node(cell, b)];
            out[mesh_.node(cell, a)] = p;
        }
    return out;
}

Eigen::MatrixXd MovingSurface::rigid_motions(const CurvedMesh& mesh) const {
    Places at(4, nodes());
    at << Eigen::RowVectorXd::Ones(nodes()), node_positions(mesh);
    return rigid_motions(at);
}

// Velocities, a column each, component by component: of translations and rotations those that are free.
Eigen::MatrixXd MovingSurface::rigid_motions(const Places& at) const {
    const int n = nodes();
    Eigen::MatrixXd out(3 * n, 6);
    for (int motion = 0; motion < out.cols(); ++motion) {
        const Eigen::Vector3d e = Eigen::Vector3d::Unit(motion % 3);
        for (int d = 0; d < 3; ++d) {
            const int j = (d + 1) % 3, k = (d + 2) % 3;
            auto to = out.col(motion).segment(d * n, n);
            if (motion < 3)
                to = e[d] * at.row(0).transpose();
            else
                to = (e[j] * at.row(1 + k) - e[k] * at.row(1 + j)).transpose();
        }
    }
    return out * free_motions_;
}

// (r, v) of these motions r: momentum and angular momentum of a velocity v, except for the density. P_k holds 1 and x,
// so that no mass matrix is needed.
Eigen::MatrixXd MovingSurface::momenta(const CurvedMesh& mesh) const {
    const Tabulation& table = space_.tabulation();
    const Places at = load<4>(space_, mesh, [&](int, const CellColumns<3>& X, int q, CellColumns<4>& sum) {
        const SurfacePoint<double> p = tangent_point(X, table, q);
        sum += (table.weight[q] * p.area * Eigen::Vector4d(1, p.x[0], p.x[1], p.x[2])) * table.value.col(q).transpose();
    });
    return rigid_motions(at);
}

Eigen::MatrixXd MovingSurface::open_rigid_motions(const CurvedMesh& mesh) const {
    return holds_rigid_motions_ ? momenta(mesh) : Eigen::MatrixXd(0, 0);
}

Eigen::VectorXd MovingSurface::momenta(const MotionState& state) const {
    if (!law_.flows || law_.inertia == 0 || law_.source.act()) return {};
    return momenta(mesh(state)).transpose() * state.u;
}

// Membrane from a reservoir enters with the local velocity, so that both grow with the area: theory.md (3.18).
Eigen::VectorXd MovingSurface::momenta_after(const MotionState& from, const MotionState& to) const {
    const Eigen::VectorXd now = momenta(from);
    if (now.size() == 0) return now;
    const double left = std::exp(-law_.friction / law_.inertia * to.step);
    if (!law_.reservoir) return left * now;
    return left * extent(space_, mesh(to)).area / extent(space_, mesh(from)).area * now;
}

// Only friction changes momentum and angular momentum, but the discrete bending force has a small resultant, which
// would accelerate a surface at rest: a rigid motion cancels it without a change of shape.
void MovingSurface::keep_momenta(const Eigen::VectorXd& kept, double te, MotionState& to) const {
    if (kept.size() == 0 || free_motions_.cols() == 0) return;
    const CurvedMesh m = mesh(to);
    const Eigen::MatrixXd motions = rigid_motions(m), of = momenta(m);
    const Eigen::VectorXd lack = kept - of.transpose() * to.u;
    const Eigen::VectorXd back = motions * solve_dense(motions.transpose() * of, lack);
    to.u += back;
    const VectorField nodal = back.reshaped(nodes(), 3).transpose();
    to.w += nodal;
    to.X += te * nodal;
}

// Relative to the sphere, or the straight tube, of the same area.
double MovingSurface::lack_of_volume(const CurvedMesh& mesh) const {
    const Extent e = extent(space_, mesh);
    const double radius = mesh.period > 0 ? e.area / (2 * pi * mesh.period) : std::sqrt(e.area / (4 * pi));
    return 1 - e.volume / (e.area * radius / (mesh.period > 0 ? 2 : 3));
}

bool MovingSurface::area_is_volume(const CurvedMesh& mesh, const MotionFields& f) const {
    if (law_.area_is_free() || law_.free_period) return false;
    const Extent rate = extent_rate(space_, mesh, f.normal);  // -INT H, A
    const Extent by_H = extent_rate(space_, mesh, f.normal * f.H.asDiagonal());
    const double variation = 1 - rate.area * by_H.volume / (rate.volume * by_H.area);
    return variation < control_.least_variation && std::abs(lack_of_volume(mesh)) < control_.most_drift;
}

// Where their distance is held.
BeadNumbers MovingSurface::held_beads(const CurvedMesh& mesh) const {
    return law_.holds_distance() ? bead_numbers(mesh) : BeadNumbers(BeadNumbers::Zero());
}

// How much area, volume and distance that are kept have lost; 0 of what is not kept.
Extent MovingSurface::lack(const CurvedMesh& mesh, double time, const BeadNumbers& beads) const {
    const Extent now = extent(space_, mesh);
    const double distance = law_.holds_distance() ? control_.distance + law_.beads->extension->at(time) : 0;
    return {control_.area && law_.conserves_area() ? *control_.area - now.area : 0,
            control_.volume && law_.keeps_volume ? *control_.volume - now.volume : 0,
            law_.holds_distance() ? distance - BeadEquations::distance(beads) : 0};
}

Extent MovingSurface::rate_of(const CurvedMesh& mesh, const BeadNumbers& beads, const VectorField& v) const {
    Extent out = extent_rate(space_, mesh, v);
    if (law_.holds_distance()) out.length = distance_rate(mesh, beads, v);
    return out;
}

Extent MovingSurface::rate_to_keep(const CurvedMesh& at, const CurvedMesh& begin, const CurvedMesh& end, double time,
                                   double span, const Extent& missed) const {
    const double stretch = at.period > 0 ? (end.period - begin.period) / at.period : 0;
    const VectorField moved = node_positions(end) - node_positions(begin) - stretched(node_positions(at), stretch);
    const Extent lacks = lack(end, time, held_beads(end)), back = rate_of(at, held_beads(at), moved);
    const Extent along = stretch != 0 ? stretch_rate(space_, at) : Extent{};
    return {(lacks.area + back.area + stretch * along.area + missed.area) / span,
            (lacks.volume + back.volume + stretch * along.volume + missed.volume) / span,
            (lacks.length + back.length) / span};
}

// The displacement along the normal in proportion to what a pull of the beads exerts there.
VectorField MovingSurface::pulled(const MotionFields& f, const CurvedMesh& mesh, const BeadNumbers& numbers) const {
    VectorField out = f.normal;
    for (int i = 0; i < mesh.size(); ++i) {
        double pull = 0;
        for (int k = 0; k < 2; ++k) {
            const PointPotential at(beads_->density(k), mesh.nodes[i], numbers[2 * k]);
            pull += numbers[2 * k + 1] * (at.value * f.H[i] - at.slope.dot(f.normal.col(i)));
        }
        out.col(i) *= pull;
    }
    return out;
}

// Newton's method for up to three numbers: displacements along nu and H nu, those of the expected surface, or along nu
// and z e_z, by which a straight tube meets both; and along nu near the beads.
MovingSurface::Correction MovingSurface::correct(const MotionFields& f, bool with_volume, MotionState& s) const {
    const bool area = law_.conserves_area() && control_.area, volume = with_volume && control_.volume,
               distance = law_.holds_distance();
    Correction out{VectorField::Zero(3, s.X.cols()), 0, {}};
    if (!area && !volume && !distance) return out;
    const bool stretches = area && volume && law_.free_period;
    std::vector<VectorField> along;
    if (volume) along.push_back(f.normal);
    if (area && !stretches) along.push_back(f.normal * f.H.asDiagonal());
    if (distance) along.push_back(pulled(f, mesh(s), bead_numbers(mesh(s))));
    const auto kept_of = [&](const Extent& e) {
        Eigen::VectorXd of(along.size() + stretches);
        Eigen::Index n = 0;
        if (volume) of[n++] = e.volume / *control_.volume;
        if (area) of[n++] = e.area / *control_.area;
        if (distance) of[n++] = e.length / control_.distance;
        return of;
    };
    const VectorField X = s.X;
    const double period = s.period;
    for (int k = 0;; ++k) {
        s.X = X + stretched(X, out.stretch) + out.displacement, s.period = (1 + out.stretch) * period;
        const CurvedMesh m = mesh(s);
        const BeadNumbers beads = held_beads(m);
        const Extent lacks = lack(m, s.time, beads);
        if (k == 0) out.lacking = lacks;
        const Eigen::VectorXd missing = kept_of(lacks);
        const double off = missing.cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
        if (off <= kept || (k == most_corrections && off <= still_kept)) return out;
        if (k == most_corrections)
            throw SolveError(fmt::format("{} are not conserved: relative error {:.2g} after {} corrections",
                                         distance ? "area, volume and the distance of beads" : "area and volume", off,
                                         most_corrections));
        Eigen::MatrixXd J(missing.size(), missing.size());
        for (std::size_t i = 0; i < along.size(); ++i) J.col(i) = kept_of(rate_of(m, beads, along[i]));
        if (stretches) J.rightCols(1) = kept_of(stretch_rate(space_, m));
        const Eigen::VectorXd x = solve_dense(J, missing);
        for (std::size_t i = 0; i < along.size(); ++i) out.displacement += x[i] * along[i];
        if (stretches) out.stretch += x[x.size() - 1];
    }
}

}  // namespace tubule::surface3d
