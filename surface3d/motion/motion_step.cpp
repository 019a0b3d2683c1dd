#include "surface3d/motion/motion_step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "surface3d/motion/generalised_alpha.hpp"

namespace tubule::surface3d {
namespace {

constexpr int most_corrections = 5;
constexpr double kept = 1e-12;            // area and volume, relative
constexpr double still_kept = 1e-8;       // a step that is further off is refused
constexpr double slight_friction = 1e-4;  // of viscosity/area: where nothing else resists rigid motions
constexpr double fastest_waves = 0.9;     // of scheme alpha: the factor by which a short step damps them
constexpr double learns = 0.5;            // from what the linear system of a step missed of area and volume
// H of a mesh answers to waves of its own size by up to .06, .07, .08 |B| (width of a triangle) more than L_H for k =
// 2, 3, 4; what little damps would grow in long steps.
constexpr double stiffer = 0.08;
constexpr double follows = 1e-7;     // how well the mesh follows the surface, relative
constexpr int most_iterations = 20;  // of that, before it is factored

// `of_cell(cell)` gives what a cell has at its points: at_point(p, q).
template <class OfCell>
Extent sum_over(const SurfaceSpace& space, const CurvedMesh& mesh, OfCell&& of_cell) {
    Eigen::Matrix2Xd sums(2, space.cells());  // so that the sum does not depend on the number of threads
    const Tabulation& table = space.tabulation();
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        const auto at_point = of_cell(cell);
        Eigen::Vector2d sum = Eigen::Vector2d::Zero();
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            sum += table.weight[q] * p.area * at_point(p, q);
        }
        sums.col(cell) = sum;
    });
    const Eigen::Vector2d total = sums.rowwise().sum();
    return {total[0], total[1]};
}

}  // namespace

Extent extent(const SurfaceSpace& space, const CurvedMesh& mesh) {
    return sum_over(space, mesh, [](int) {
        return [](const SurfacePoint<double>& p, int) {
            return Eigen::Vector2d(1, p.x.head<2>().dot(p.normal.head<2>()) / 2);  // the flux of (x, y, 0)/2
        };
    });
}

Extent extent_rate(const SurfaceSpace& space, const CurvedMesh& mesh, const VectorField& d) {
    const Tabulation& table = space.tabulation();
    return sum_over(space, mesh, [&](int cell) {
        return [&table, D = space.gather(d, cell)](const SurfacePoint<double>& p, int q) {
            const double divergence = gradients(p, table, q).cwiseProduct(D).sum();
            return Eigen::Vector2d(divergence, (D * table.value.col(q)).dot(p.normal));
        };
    });
}

MotionState at_rest(const CurvedMesh& mesh, int components, int pressures) {
    MotionState s;
    s.X = s.X_past = node_positions(mesh);
    s.w = s.w_past = VectorField::Zero(3, mesh.size());
    s.u = s.u_past = Eigen::VectorXd::Zero(components * mesh.size());
    s.p = Eigen::VectorXd::Zero(pressures);
    return s;
}

bool is_finite(const MotionState& s) {
    return s.X.allFinite() && s.w.allFinite() && s.u.allFinite() && s.p.allFinite() && std::isfinite(s.lambda);
}

MotionStepper::MotionStepper(const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending,
                             const MotionControl& control)
    : mesh_(mesh),
      space_(mesh),
      law_(law),
      bending_(bending),
      control_(control),
      unknowns_(mesh, law, bending),
      mesh_motion_(control.follow_curvature),
      solver_(unknowns_.pattern(), unknowns_.node_of_unknown()),
      gmres_(unknowns_.nodes()) {
    if (law.viscosity == 0 || law.inertia != 0 || law.friction != 0) return;
    holds_rigid_motions_ = true;
    law_.friction = slight_friction * law.viscosity / extent(space_, mesh).area;
}

MotionState MotionStepper::start(const CurvedMesh& mesh) {
    MotionState s = at_rest(mesh, law_.components(), unknowns_.p < 0 ? 0 : unknowns_.size() - unknowns_.p);
    const MotionFields f = fields(mesh);
    s.X += correction(s.X, f, law_.keeps_volume && !area_is_volume(mesh, f));
    s.X_past = s.X;
    return s;
}

MotionState MotionStepper::start(const CurvedMesh& at, const Eigen::VectorXd& u, const Eigen::VectorXd& momenta) {
    MotionState s = start(at);
    s.u = u;
    keep_momenta(momenta, 0, s);
    const CurvedMesh now = mesh(s.X);
    const MotionFields f = fields(now);
    s.w = mesh_motion_.velocity(space_, now, f, *projection_, flux(s.u, now, f), control_.relaxation, 0);
    s.u_past = s.u, s.w_past = s.w;
    return s;
}

MotionFields MotionStepper::fields(const CurvedMesh& mesh) {
    if (projection_)
        projection_->update(space_, mesh);
    else
        projection_.emplace(space_, mesh);
    return motion_fields(space_, mesh, *projection_);
}

Eigen::VectorXd MotionStepper::flux(const Eigen::VectorXd& u, const CurvedMesh& mesh,
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
                for (int d = 0; d < 3; ++d) speed += phi[a] * normal[d] * u[d * unknowns_.nodes() + i];
            else
                speed += phi[a] * u[i];
        }
        sum += (table.weight[q] * p.area * speed) * phi.transpose();
    });
    return out.transpose();
}

VectorField MotionStepper::velocity(const MotionState& state, const MotionFields& fields) const {
    const int n = unknowns_.nodes();
    VectorField out(3, n);
    if (law_.flows) {
        for (int d = 0; d < 3; ++d) out.row(d) = state.u.segment(d * n, n).transpose();
        return out;
    }
    for (int i = 0; i < n; ++i) out.col(i) = state.u[i] * fields.normal.col(i);
    if (!law_.inextensible) return out;
    const Tabulation& table = space_.tabulation();
    return out - (*projection_)(
                     load<3>(space_, mesh(state.X), [&](int cell, const CellColumns<3>& X, int q, CellColumns<3>& sum) {
                         const SurfacePoint<double> p = tangent_point(X, table, q);
                         const Eigen::Vector3d slope = gradients(p, table, q) * space_.gather(state.p, cell);
                         sum += (table.weight[q] * p.area / law_.friction * slope) * table.value.col(q).transpose();
                     }));
}

// The evolution of H and K, times -f_HH/te and -f_KK/te, is the transpose of the force but for terms without
// derivatives, the variation of these factors, what is carried along the surface, and by how much L_H is stiffer.
void MotionStepper::make_symmetric(const StepBase& base) {
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(unknowns_.size());
    for (int i = 0; i < unknowns_.nodes(); ++i) {
        const CurvatureJet<double> f = density(bending_, base.fields.H[i], base.fields.K[i]);
        const auto factor = [&](double second) { return second > 0 ? -second / base.te : -1 / base.te; };
        if (unknowns_.H >= 0) scale[unknowns_.H + i] = factor(f.HH);
        if (unknowns_.K >= 0) scale[unknowns_.K + i] = factor(f.KK);
    }
    for (Eigen::Index k = 0; k < system_.A.nonZeros(); ++k)
        system_.A.valuePtr()[k] *= scale[system_.A.innerIndexPtr()[k]];
    system_.b.array() *= scale.array();
}

bool MotionStepper::area_is_volume(const CurvedMesh& mesh, const MotionFields& f) const {
    if (!law_.inextensible) return false;
    const Extent rate = extent_rate(space_, mesh, f.normal);  // -INT H, A
    const Extent by_H = extent_rate(space_, mesh, f.normal * f.H.asDiagonal());
    return 1 - rate.area * by_H.volume / (rate.volume * by_H.area) < control_.least_variation;
}

// With the given rates of area and volume, where they are kept.
Eigen::VectorXd MotionStepper::solve(const StepBase& base, const Extent& rate, bool with_lambda, double& lambda) {
    assemble(space_, unknowns_, law_, bending_, base, system_);
    if (law_.inextensible && control_.area) system_.b -= rate.area / *control_.area * system_.pressure_load;
    make_symmetric(base);
    Eigen::MatrixXd rigid(0, 0);
    if (holds_rigid_motions_) rigid = momenta(*base.mesh, rigid_motions(*base.mesh));
    Eigen::MatrixXd border = Eigen::MatrixXd::Zero(unknowns_.size(), rigid.cols() + with_lambda);
    border.topLeftCorner(rigid.rows(), rigid.cols()) = rigid;
    Eigen::VectorXd held = Eigen::VectorXd::Zero(border.cols());
    if (with_lambda) {
        border.rightCols<1>() = system_.flux;
        if (control_.volume) held.tail<1>()[0] = rate.volume;
    }
    const auto [x, y] = solver_.solve(system_.A, system_.b, border, held);
    lambda = with_lambda ? y.tail<1>()[0] : 0;
    return x;
}

// Velocities of rigid motions at the nodes, a column each, component by component: translations, and rotations that the
// surface allows.
Eigen::MatrixXd MotionStepper::rigid_motions(const CurvedMesh& mesh) const {
    const int n = unknowns_.nodes();
    const bool tube = mesh.period > 0;
    const VectorField x = node_positions(mesh);
    Eigen::MatrixXd out(3 * n, tube ? 4 : 6);
    for (int motion = 0; motion < out.cols(); ++motion) {
        const int axis = tube && motion == 3 ? 2 : motion % 3;
        const Eigen::Vector3d e = Eigen::Vector3d::Unit(axis);
        for (int d = 0; d < 3; ++d) {
            const int j = (d + 1) % 3, k = (d + 2) % 3;
            out.col(motion).segment(d * n, n) = motion < 3 ? Eigen::VectorXd::Constant(n, e[d])
                                                           : (e[j] * x.row(k) - e[k] * x.row(j)).transpose().eval();
        }
    }
    return out;
}

// (r, v) of these motions r: momentum and angular momentum of a velocity v, but for the density.
Eigen::MatrixXd MotionStepper::momenta(const CurvedMesh& mesh, const Eigen::MatrixXd& motions) const {
    const Eigen::SparseMatrix<double> mass = mass_matrix(space_, mesh);
    const int n = unknowns_.nodes();
    Eigen::MatrixXd out(motions.rows(), motions.cols());
    for (int d = 0; d < 3; ++d) out.middleRows(d * n, n) = mass * motions.middleRows(d * n, n);
    return out;
}

Eigen::VectorXd MotionStepper::momenta(const MotionState& state) const {
    if (!law_.flows || law_.inertia == 0) return {};
    const CurvedMesh m = mesh(state.X);
    return momenta(m, rigid_motions(m)).transpose() * state.u;
}

// What friction leaves of them after a step.
Eigen::VectorXd MotionStepper::momenta_after(const MotionState& from, double tau) const {
    const Eigen::VectorXd now = momenta(from);
    return now.size() == 0 ? now : std::exp(-law_.friction / law_.inertia * tau) * now;
}

// Nothing but friction changes momentum and angular momentum, but the bending force of a mesh has a small resultant,
// which would move a surface at rest ever faster: a rigid motion takes it back. It changes no shape.
void MotionStepper::keep_momenta(const Eigen::VectorXd& kept, double te, MotionState& to) const {
    if (kept.size() == 0) return;
    const CurvedMesh m = mesh(to.X);
    const Eigen::MatrixXd motions = rigid_motions(m), of = momenta(m, motions);
    const Eigen::VectorXd lack = kept - of.transpose() * to.u;
    const Eigen::VectorXd back = motions * (motions.transpose() * of).ldlt().solve(lack);
    to.u += back;
    const VectorField nodal = back.reshaped(unknowns_.nodes(), 3).transpose();
    to.w += nodal;
    to.X += te * nodal;
}

Eigen::VectorXd MotionStepper::pressure_at_nodes(const MotionState& state) const {
    const CurvedMesh& own = unknowns_.last_mesh();
    if (own.order == mesh_.order) return state.p;
    std::vector<QuadraturePoint> nodes;
    for (const auto& [i, j, l] : lattice(mesh_.order))
        nodes.push_back({static_cast<double>(j) / mesh_.order, static_cast<double>(l) / mesh_.order, 0});
    const Tabulation table(own.order, nodes);
    Eigen::VectorXd out(mesh_.size());
    for (int cell = 0; cell < mesh_.triangles(); ++cell)
        for (int a = 0; a < mesh_.nodes_per_cell(); ++a) {
            double p = 0;
            for (int b = 0; b < own.nodes_per_cell(); ++b) p += table.value(b, a) * state.p[own.node(cell, b)];
            out[mesh_.node(cell, a)] = p;
        }
    return out;
}

// Of what is kept; zero where nothing is.
Extent MotionStepper::lack(const CurvedMesh& mesh) const {
    const Extent now = extent(space_, mesh);
    return {control_.area ? *control_.area - now.area : 0, control_.volume ? *control_.volume - now.volume : 0};
}

// Newton's method for two numbers: displacements along nu and H nu, those of the expected surface.
VectorField MotionStepper::correction(const VectorField& X, const MotionFields& f, bool with_volume) const {
    const bool area = law_.inextensible && control_.area, volume = with_volume && control_.volume;
    VectorField sum = VectorField::Zero(3, X.cols());
    if (!area && !volume) return sum;
    const VectorField by_normal = f.normal, by_H = f.normal * f.H.asDiagonal();
    for (int k = 0;; ++k) {
        const CurvedMesh m = mesh(X + sum);
        const Extent lacks = lack(m);
        const Eigen::Vector2d missing(area ? lacks.area : 0, volume ? lacks.volume : 0);
        const Eigen::Vector2d parts(area ? missing[0] / *control_.area : 0, volume ? missing[1] / *control_.volume : 0);
        const double off = parts.cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
        if (off <= kept || (k == most_corrections && off <= still_kept)) return sum;
        if (k == most_corrections)
            throw SolveError(fmt::format("area and volume are not kept: {:.2g} of them is missing after {} corrections",
                                         off, most_corrections));
        const Extent a = extent_rate(space_, m, by_normal), b = extent_rate(space_, m, by_H);
        if (area && volume) {
            Eigen::Matrix2d J;
            J << a.area, b.area, a.volume, b.volume;
            const Eigen::Vector2d x = J.inverse() * missing;
            sum += x[0] * by_normal + x[1] * by_H;
        } else {
            sum += volume ? VectorField(missing[1] / a.volume * by_normal) : VectorField(missing[0] / b.area * by_H);
        }
    }
}

// -(b, d), to first order the energy that a displacement of the nodes takes.
double MotionStepper::work(const VectorField& d, const MotionFields& fields) const {
    const int n = unknowns_.nodes();
    if (!law_.flows) return -system_.force.head(n).dot(d.cwiseProduct(fields.normal).colwise().sum());
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum -= system_.force.segment(i * n, n).dot(d.row(i));
    return sum;
}

// What a step solves for: at `level` of the way through it, X = Xbar + te w and u_t = (u - ubar)/te. Its end lies on
// the line from its beginning to there.
struct MotionStepper::Formula {
    double level, te;
    VectorField Xbar;
    Eigen::VectorXd ubar;
    double error;         // of the positions in a step, in units of their third derivative * tau^3
    double renewing = 1;  // of scheme alpha: the part of the carried rates that a step makes anew
    double lag = 0;       // and the time from which they then are, before the end of the step
};

MotionStepper::Formula MotionStepper::euler(const MotionState& from, double tau) {
    return {1, tau, from.X, from.u, 0};
}

MotionStepper::Formula MotionStepper::bdf2(const MotionState& from, double tau) {
    const double r = tau / from.step, te = (1 + r) * tau / (1 + 2 * r);
    const auto bar = [&](const auto& now, const auto& before) {
        return ((1 + r) * now - r * r / (1 + r) * before) * (te / tau);
    };
    return {1, te, bar(from.X, from.X_past), bar(from.u, from.u_past), -(1 + r) * (1 + r) / (6 * r * (1 + 2 * r))};
}

// A wave of bending, of no tangential flow but what its stretching takes, is damped by 2 viscosity k^2/inertia, k the
// curvature across it, and by half of the friction. So this is what a step may damp the fastest waves by, in addition:
// long steps, which do not follow them, need it.
double MotionStepper::wave_factor(const MotionState& from, double tau) const {
    if (law_.inertia == 0) return 0;
    const CurvedMesh m = mesh(from.X);
    const Extent e = extent(space_, m);
    const double curvature = e.area / ((m.period > 0 ? 2 : 3) * e.volume);
    const double rate = (2 * law_.viscosity * curvature * curvature + law_.friction / 2) / law_.inertia;
    return fastest_waves * std::exp(-rate * tau);
}

MotionStepper::Formula MotionStepper::alpha(const MotionState& from, double tau, double radius) {
    const AlphaNumbers a = alpha_numbers(tau, from.lag, radius);
    return {a.level, a.te, from.X + a.kept * from.X_rate, from.u + a.kept * from.u_rate, a.error, a.renewing, a.lag};
}

// A run that another scheme began goes on without.
bool MotionStepper::has_past(const MotionState& from) const {
    if (control_.scheme == Scheme::alpha && from.u_rate.size() == 0) return false;
    return from.step > 0 && control_.scheme != Scheme::euler;
}

// Such that area and volume at the end of the step are those that are kept: linear about the surface that is expected
// there, but for what a step like this is expected to miss.
Extent MotionStepper::wanted_rate(const MotionState& from, const Formula& f, double tau, const CurvedMesh& at) const {
    const double r = has_past(from) ? tau / from.step : 0;
    const VectorField end = (1 + r) * from.X - r * from.X_past, begin = from.X + (f.Xbar - from.X) / f.level;
    const Extent lacks = lack(mesh(end)), back = extent_rate(space_, at, end - begin);
    const double again = r * r * r, span = f.te / f.level;
    return {(lacks.area + back.area + again * from.missed.area) / span,
            (lacks.volume + back.volume + again * from.missed.volume) / span};
}

// (w.nu, phi) of the mesh. At the end of the step (w - u).nu = 0: with what the surface has moved since X* along the
// normal, xi = (Xbar - X*).nu + te w.nu, and c = u* - w* along the surface, w.nu + c.grad xi = u.nu. To take u.nu on X*
// alone would carry waves along the surface explicitly, by which those that little damps grow. Without inertia there
// are none, and xi, where motions fade within a step, is not small.
Eigen::VectorXd MotionStepper::mesh_flux(const StepBase& base, const Eigen::VectorXd& u) {
    if (law_.inertia == 0) return flux(u, *base.mesh, base.fields);
    using Row = Eigen::Matrix<double, 1, Eigen::Dynamic>;
    const Eigen::SparseMatrix<double>& along = system_.advection;
    const Row back = base.displacement.cwiseProduct(base.fields.normal).colwise().sum();
    const Eigen::VectorXd b = flux(u, *base.mesh, base.fields) + along * back.transpose();
    Eigen::VectorXd out = b;
    const auto carried = [&](const Eigen::VectorXd& x, Eigen::VectorXd& y) {
        y = x + base.te * (along * (*projection_)(Row(x.transpose())).transpose());
    };
    const auto as_it_is = [](const Eigen::VectorXd& x, Eigen::VectorXd& y) { y = x; };
    try {
        gmres_.solve(carried, as_it_is, b, out, follows, most_iterations);
    } catch (const SolveError&) {  // far along the surface in a step
        const Eigen::SparseMatrix<double> mass = mass_matrix(space_, *base.mesh);
        SparseLuLarge lu;
        lu.factor(mass + base.te * along);
        out = mass * lu.solve(b);
    }
    return out;
}

// Of area and volume, by the linear system of a step: it is of third order in the step. Backward differences do
// without, and where area and volume are nearly one condition a run of theirs became rough by it.
Extent MotionStepper::expected_miss(const MotionState& from, const MotionState& to) const {
    const double again = std::pow(to.step / from.step, 3);
    const Extent lacks = lack(mesh(to.X));
    return {again * from.missed.area + learns * lacks.area, again * from.missed.volume + learns * lacks.volume};
}

// From the level at which the step was solved to its end.
void MotionStepper::finish(const MotionState& from, const Formula& f, MotionState& to) const {
    if (control_.scheme == Scheme::alpha) {
        const bool first = !has_past(from);
        to.solved = {from.time + f.level * to.step, to.p, to.lambda};
        if (!first && f.level < 1) {
            const double ahead = (to.time - to.solved.time) / (to.solved.time - from.solved.time);
            to.lambda += ahead * (to.lambda - from.solved.lambda);
            if (to.p.size() > 0) to.p += ahead * (to.p - from.solved.p);
        }
        to.lag = f.lag;
        const VectorField X_rate = to.w;
        const Eigen::VectorXd u_rate = (to.u - f.ubar) / f.te;
        to.X_rate = first ? X_rate : VectorField(from.X_rate + f.renewing * (X_rate - from.X_rate));
        to.u_rate = first ? u_rate : Eigen::VectorXd(from.u_rate + f.renewing * (u_rate - from.u_rate));
    }
    if (f.level == 1) return;
    to.X = from.X + (to.X - from.X) / f.level;
    to.w = from.w + (to.w - from.w) / f.level;
    to.u = from.u + (to.u - from.u) / f.level;
}

MotionStep MotionStepper::step(const MotionState& from, double tau) {
    const bool past = has_past(from);
    const Formula f = !past                              ? euler(from, tau)
                      : control_.scheme == Scheme::alpha ? alpha(from, tau, wave_factor(from, tau))
                                                         : bdf2(from, tau);
    const double r = past ? tau / from.step : 0;
    const auto ahead = [&](const auto& now, const auto& before) {
        return ((1 + f.level * r) * now - f.level * r * before).eval();
    };
    const VectorField Xstar = ahead(from.X, from.X_past);
    const CurvedMesh at = mesh(Xstar);
    const StepBase base{&at,    fields(at), Xstar - f.Xbar, ahead(from.w, from.w_past), ahead(from.u, from.u_past),
                        f.ubar, f.te,       stiffer};
    MotionStep out;
    MotionState& to = out.state;
    const bool keeps_volume = law_.keeps_volume && !area_is_volume(at, base.fields);
    const Eigen::VectorXd x = solve(base, wanted_rate(from, f, tau, at), keeps_volume, to.lambda);
    to.time = from.time + tau, to.step = tau;
    to.u = x.head(from.u.size());
    if (unknowns_.p >= 0) to.p = x.tail(unknowns_.size() - unknowns_.p);
    to.w =
        mesh_motion_.velocity(space_, at, base.fields, *projection_, mesh_flux(base, to.u), control_.relaxation, f.te);
    to.X = f.Xbar + f.te * to.w;
    finish(from, f, to);
    const Eigen::VectorXd momenta = momenta_after(from, tau);
    keep_momenta(momenta, f.te / f.level, to);
    if (past) {
        // Adams-Bashforth of second order for comparison; the constants of both errors are known (Milne).
        const VectorField explicitly = from.X + tau * ((1 + r / 2) * from.w - r / 2 * from.w_past);
        const double theirs = (2 * r + 3) / (12 * r);
        const Eigen::RowVectorXd along = (to.X - explicitly).cwiseProduct(base.fields.normal).colwise().sum();
        out.error = std::abs(f.error / (theirs - f.error)) * along.cwiseAbs().maxCoeff();
        if (control_.scheme == Scheme::alpha) to.missed = expected_miss(from, to);
    } else {
        const Eigen::RowVectorXd along =
            (to.X - from.X - tau * from.w).cwiseProduct(base.fields.normal).colwise().sum();
        out.error = along.cwiseAbs().maxCoeff() / 2;
    }
    const VectorField kept_extent = correction(to.X, base.fields, keeps_volume);
    out.correction = work(kept_extent, base.fields);
    to.X += kept_extent;
    keep_momenta(momenta, 0, to);  // on the surface as it is now
    to.X_past = from.X, to.w_past = from.w, to.u_past = from.u;
    return out;
}

}  // namespace tubule::surface3d
