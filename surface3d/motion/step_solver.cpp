#include "surface3d/motion/step_solver.hpp"

#include <algorithm>
#include <cmath>

#include "common/solve/parallel.hpp"

namespace tubule::surface3d {
namespace {

// H of a mesh answers to waves of its own size by up to .06, .07, .08 |B| (width of a triangle) more than L_H for k =
// 2, 3, 4; what little damps would grow in long steps.
constexpr double curvature_stabilisation = 0.08;
constexpr double flux_tolerance = 1e-7;  // how well the mesh follows the surface, relative
constexpr int most_carried = 20;         // of that, before it is factored
constexpr int most_multipliers = 10;     // lambda or P, tension, supply, stretch, mu, five of beads
// Measured: docs/decisions/energies.md.
constexpr double least_evenness = 0.02;
constexpr int numbers_of_beads = 4;

// In which they are as large as the rates of the surface: GMRES has one tolerance for all.
double unit_of_beads(const StepBase& base) {
    return std::sqrt(base.te);
}

}  // namespace

MotionState StageSolution::state(double time, double step) const {
    return {.time = time,
            .step = step,
            .X = X,
            .w = w,
            .u = u,
            .p = p,
            .lambda = lambda,
            .tension = tension,
            .force = force,
            .period = period,
            .stretch = stretch,
            .memory = {}};
}

StepSolver::StepSolver(MovingSurface& surface)
    : surface_(surface),
      unknowns_(surface.mesh(), surface.law(), surface.bending()),
      solver_(unknowns_.pattern(), unknowns_.node_of_unknown()),
      gmres_(unknowns_.nodes()) {}

StageSolution StepSolver::solve(const Stage& stage, const Extent& rate) {
    const CurvedMesh at = surface_.mesh(stage.X, stage.period);
    const SurfaceLaw& law = surface_.law();
    const double stretch = at.period > 0 ? (stage.period - stage.period_bar) / stage.period : 0;
    StepBase base{.mesh = &at,
                  .fields = surface_.fields(at),
                  .displacement = stage.X - stage.Xbar - stretched(stage.X, stretch),
                  .mesh_velocity = stage.w,
                  .velocity = stage.u,
                  .past = stage.ubar,
                  .te = stage.te,
                  .curvature_stabilisation = curvature_stabilisation,
                  .tension = law.keeps_area ? stage.tension : law.tension.at(stage.time),
                  .stretch = stretch,
                  .time = stage.time};
    if (surface_.bending().alpha) base.M = integral(surface_.space(), at, base.fields.H);
    if (law.beads) {
        base.beads = &*surface_.beads(), base.bead_numbers = surface_.bead_numbers(at);
        base.force = law.holds_distance() ? stage.force : law.force.at(stage.time);
    }
    StageSolution out;
    out.keeps_volume = law.keeps_volume && !surface_.area_is_volume(at, base.fields);
    const Eigen::VectorXd x = solve(base, stage.time, rate, out);
    out.u = x.head(stage.u.size());
    MotionState moving;
    moving.X = stage.X, moving.u = out.u, moving.p = out.p, moving.period = stage.period;
    MotionFields ahead;  // explicit in H, the force along the surface would limit the step
    const bool slips = surface_.H0().size() > 0 && !law.flows;
    if (slips) ahead = base.fields;
    if (slips && unknowns_.H >= 0) ahead.H = x.segment(unknowns_.H, surface_.nodes());
    if (slips && unknowns_.K >= 0) ahead.K = x.segment(unknowns_.K, surface_.nodes());
    out.w = surface_.node_velocity(moving, at, slips ? ahead : base.fields, mesh_flux(base, out.u), stage.relaxation);
    out.X = stage.Xbar + stage.te * (out.w + stretched(stage.X, out.stretch));
    out.period = stage.period_bar + stage.te * out.stretch * stage.period;
    out.fields = std::move(base.fields);
    return out;
}

KeptExtent StepSolver::keep_extent(const StageSolution& solved, MotionState& to) const {
    const auto by = surface_.correct(solved.fields, solved.keeps_volume, to);
    return {work(by, to, solved.fields), by.lacking};
}

namespace {

// The smaller over the larger eigenvalue of the Hessian of the density in (H, K), in units of the curvature.
double evenness(const CurvatureJet<double>& f, double H, double K) {
    const double curvature2 = std::max(H * H - 2 * K, 0.0), a = f.HH, d = f.KK * curvature2,
                 b2 = f.HK * f.HK * curvature2;
    const double mean = std::abs(a + d) / 2, root = std::sqrt((a - d) * (a - d) / 4 + b2);
    return mean + root > 0 ? std::abs(mean - root) / (mean + root) : 0;
}

// What the evolution of H and K is multiplied by. Where the Hessian is nearly singular somewhere, not that but what is
// positive in its diagonal, or 1: rows must not vanish.
std::vector<Eigen::Matrix2d> row_factors(const Bending& bending, const MotionFields& fields) {
    const bool gradients = bending.kg != 0;  // of H: its row does not vanish then
    const Eigen::Index n = fields.H.size();
    std::vector<CurvatureJet<double>> f(n);
    bool regular = true;
    for (Eigen::Index i = 0; i < n; ++i) {
        f[i] = density_at(bending, fields.H0_at(bending, i), fields.H[i], fields.K[i]);
        regular = regular && (f[i].HK == 0 || evenness(f[i], fields.H[i], fields.K[i]) > least_evenness);
    }
    const auto or_one = [](double second, bool good) { return good ? second : 1; };
    std::vector<Eigen::Matrix2d> out(n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const auto& [value, H, K, HH, HK, KK] = f[i];
        if (HK != 0 && regular)
            out[i] << HH, HK, HK, KK;
        else
            out[i] << (gradients ? HH : or_one(HH, HK == 0 ? HH != 0 : HH > 0)), 0, 0,
                or_one(KK, HK == 0 ? KK != 0 : KK > 0);
    }
    return out;
}

}  // namespace

// The evolution of H and K, times -1/te times the Hessian of the density in (H, K) at each node, is the transpose of
// the force but for terms without derivatives, the variation of the Hessian, what is carried along the surface, and the
// stabilisation of L_H: theory.md (10.7), (10.8). With the gradient term the row of mu becomes -1/te times the
// evolution of H, and what it was, the definition of mu, goes to that of H: the columns of mu in the force and of mu in
// the row of H are then transposes of rows.
void StepSolver::make_symmetric(const StepBase& base) {
    const int n = surface_.nodes(), H = unknowns_.H, K = unknowns_.K, mu = unknowns_.mu;
    std::vector<Eigen::Matrix2d> factor = row_factors(surface_.bending(), base.fields);
    for (Eigen::Matrix2d& one : factor) one *= -1 / base.te;
    // Pairs of rows, or the one that there is: their entries in a column.
    const auto scale = [&](int i, double* of_H, double* of_K, double* of_mu) {
        const Eigen::Vector2d old(of_H ? *of_H : 0, of_K ? *of_K : 0), out = factor[i] * old;
        if (of_H) *of_H = of_K ? out[0] : factor[i](0, 0) * old[0];
        if (of_K) *of_K = of_H ? out[1] : factor[i](1, 1) * old[1];
        if (!of_mu) return;
        *of_H -= *of_mu / base.te;
        *of_mu = -old[0] / base.te;
    };
    Eigen::SparseMatrix<double>& A = system_.A;
    parallel_for(static_cast<std::size_t>(A.cols()), [&](std::size_t j) {
        const int *begin = A.innerIndexPtr() + A.outerIndexPtr()[j],
                  *end = A.innerIndexPtr() + A.outerIndexPtr()[j + 1];
        double* value = A.valuePtr() + A.outerIndexPtr()[j];
        // Nodes that a column meets are the same for all fields.
        const auto first = [&](int field) { return field < 0 ? nullptr : std::lower_bound(begin, end, field); };
        const int *rows_H = first(H), *rows_K = first(K), *rows_mu = first(mu), *rows = rows_H ? rows_H : rows_K;
        if (!rows) return;
        const int field = rows_H ? H : K;
        for (int k = 0; rows + k < end && rows[k] < field + n; ++k)
            scale(rows[k] - field, rows_H ? value + (rows_H - begin) + k : nullptr,
                  rows_K ? value + (rows_K - begin) + k : nullptr, rows_mu ? value + (rows_mu - begin) + k : nullptr);
    });
    const auto scale_vector = [&](Eigen::VectorXd& v) {
        for (int i = 0; i < n; ++i)
            scale(i, H >= 0 ? &v[H + i] : nullptr, K >= 0 ? &v[K + i] : nullptr, mu >= 0 ? &v[mu + i] : nullptr);
    };
    scale_vector(system_.b);
    if (surface_.law().free_period) scale_vector(system_.stretch.column);
}

namespace {

// With room for `most` columns, of which these are the first.
BorderedSolver::Border border_of(Eigen::Index unknowns, Eigen::Index most, const Eigen::MatrixXd& first) {
    BorderedSolver::Border out{
        Eigen::MatrixXd::Zero(unknowns, most), {}, Eigen::MatrixXd::Zero(most, most), Eigen::VectorXd::Zero(most)};
    out.C.topLeftCorner(first.rows(), first.cols()) = first;
    out.R = out.C;
    return out;
}

}  // namespace

// With the given rates of area, volume and distance, where they are kept, and the loads of this time. Columns of the
// border, each also a row: rigid motions; lambda; the tension of an area that is kept as a whole; what belongs to
// beads; the supply of a reservoir, whose row is the mean of p; the stretch of a free period; how far alpha (M - M0)
// and P(V) at the end differ from those of X*.
Eigen::VectorXd StepSolver::solve(const StepBase& base, double time, const Extent& rate, StageSolution& out) {
    const SurfaceLaw& law = surface_.law();
    const MotionControl& control = surface_.control();
    assemble(surface_.space(), unknowns_, law, surface_.bending(), base, system_);
    if (law.inextensible && control.area && law.conserves_area())
        system_.b -= rate.area / *control.area * system_.pressure_load;
    if (!law.inextensible) system_.b -= law.tension.at(time) * system_.widening;
    const Loads given = loads_at(law, time);
    const double volume = given.of_volume ? extent(surface_.space(), *base.mesh).volume : 0;
    system_.b += given.pressure_at(volume) * system_.flux;
    if (base.beads) system_.b += base.force * system_.pulling(base.bead_numbers);
    make_symmetric(base);
    const Eigen::MatrixXd rigid = surface_.open_rigid_motions(*base.mesh);
    const Eigen::Index most = rigid.cols() + most_multipliers;
    BorderedSolver::Border border = border_of(unknowns_.size(), most, rigid);
    Eigen::Index n = rigid.cols();
    const auto add = [&](const Eigen::VectorXd& column, const Eigen::VectorXd& row, double value) {
        border.C.col(n) = column, border.R.col(n) = row, border.d[n] = value;
        return n++;
    };
    const auto add_both = [&](const Eigen::VectorXd& column, double value) { return add(column, column, value); };
    const Eigen::Index lambda = out.keeps_volume ? add_both(system_.flux, control.volume ? rate.volume : 0) : -1;
    const Eigen::Index tension = law.keeps_area ? add_both(system_.widening, control.area ? rate.area : 0) : -1;
    const Eigen::Index force = n + numbers_of_beads;
    if (base.beads) add_beads(base, rate, border, n);
    if (law.reservoir) add_both(system_.pressure_load, -law.tension.at(time) * system_.pressure_load.sum());
    Eigen::Index stretch = -1;
    if (law.free_period) {
        const StretchTerms& s = system_.stretch;
        // What the tension of a reservoir does is in p.
        const double loads =
            law.potential_rate(time, {law.reservoir ? 0 : s.rate.area, s.rate.volume, s.rate.length}, volume);
        stretch = add(s.column, s.row, -s.energy - loads);
        border.D(stretch, stretch) = s.own;
        if (lambda >= 0) border.D(lambda, stretch) = border.D(stretch, lambda) = s.rate.volume;
        if (tension >= 0) border.D(tension, stretch) = border.D(stretch, tension) = s.rate.area;
    }
    const auto add_spring = [&](double stiffness, const Eigen::VectorXd& slope, double by_stretch) {
        const double unit = std::sqrt(std::abs(stiffness) * base.te);  // in which all are alike
        const Eigen::Index n = add_both(unit * slope, unit * lead(base, slope, by_stretch) / base.te);
        border.D(n, n) = stiffness < 0 ? 1 : -1;
        if (stretch >= 0) border.D(n, stretch) = border.D(stretch, n) = unit * by_stretch;
    };
    if (surface_.bending().alpha) add_spring(*surface_.bending().alpha, system_.turning, system_.stretch.M);
    if (given.of_volume) add_spring(-given.pressure_slope(volume), system_.flux, system_.stretch.rate.volume);
    border.C.conservativeResize(Eigen::NoChange, n), border.R.conservativeResize(Eigen::NoChange, n);
    border.D.conservativeResize(n, n), border.d.conservativeResize(n);
    const int before = solver_.fallbacks();
    const auto [x, y] = solver_.solve(system_.A, system_.b, border);
    LinearWork& work = surface_.linear_work();
    const bool by_lu = solver_.fallbacks() > before;
    ++work.solves, work.lu += by_lu, work.iterations += by_lu ? 0 : solver_.iterations();
    if (lambda >= 0) out.lambda = y[lambda];
    if (law.holds_distance()) out.force = base.force + unit_of_beads(base) * y[force];
    if (stretch >= 0) out.stretch = y[stretch];
    if (tension >= 0) out.tension = y[tension];
    if (unknowns_.p >= 0) out.p = x.tail(unknowns_.size() - unknowns_.p);
    return x;
}

// (w.nu, phi) of the mesh. At the end of the step (w - u).nu = 0: with what the surface has moved since X* along the
// normal, xi = (Xbar - X*).nu + te w.nu, and c = u* - w* along the surface, w.nu + c.grad xi = u.nu. To take u.nu on X*
// alone would carry waves along the surface explicitly, by which those that little damps grow. Without inertia there
// are none, and xi, where motions fade within a step, is not small.
Eigen::VectorXd StepSolver::mesh_flux(const StepBase& base, const Eigen::VectorXd& u) {
    const Eigen::VectorXd flux = surface_.flux(u, *base.mesh, base.fields);
    if (surface_.law().inertia == 0) return flux;
    using Row = Eigen::Matrix<double, 1, Eigen::Dynamic>;
    const Eigen::SparseMatrix<double>& along = system_.advection;
    const Eigen::VectorXd moved = base.displacement.transpose().reshaped();
    const Row back = surface_.projection()(Row(surface_.flux(moved, *base.mesh, base.fields).transpose()));
    const Eigen::VectorXd b = flux + along * back.transpose();
    Eigen::VectorXd out = b;
    const auto carried = [&](const Eigen::VectorXd& x, Eigen::VectorXd& y) {
        y = x + base.te * (along * surface_.projection()(Row(x.transpose())).transpose());
    };
    const auto as_it_is = [](const Eigen::VectorXd& x, Eigen::VectorXd& y) { y = x; };
    try {
        gmres_.solve(carried, as_it_is, b, out, flux_tolerance, most_carried);
    } catch (const SolveError&) {  // far along the surface in a step
        const Eigen::SparseMatrix<double> mass = mass_matrix(surface_.space(), *base.mesh);
        SparseLuLarge lu;
        lu.factor(mass + base.te * along);
        out = mass * lu.solve(b);
    }
    return out;
}

// How the positions P and multipliers q of beads, theory.md (2.23), follow the surface from X*, to first order. This
// must be implicit: where a viscous membrane is flat, it does not resist motion along its normal. Columns: P and q of
// each bead, then the force that holds the distance beyond the expected one.
void StepSolver::add_beads(const StepBase& base, const Extent& rate, BorderedSolver::Border& border,
                           Eigen::Index& n) const {
    const Eigen::Index first = n, force = n + numbers_of_beads;
    for (int k = 0; k < 2; ++k) {
        const Eigen::Index P = n, q = n + 1;
        const Eigen::VectorXd of_G = system_.beads.col(2 * k), of_slope = system_.beads.col(2 * k + 1);
        const double unit = base.bead_numbers[2 * k + 1], pulls = base.force * unit;  // 1/(dG/dP), and q
        border.C.col(P) = pulls * of_slope, border.C.col(q) = of_G;
        border.D(P, P) = pulls * surface_.bead_bend(*base.mesh, k, base.bead_numbers[2 * k]) / base.te;
        border.D(P, q) = border.D(q, P) = 1 / unit / base.te;
        border.d[P] = pulls * lead(base, of_slope, 0) / base.te, border.d[q] = lead(base, of_G, 0) / base.te;
        n += 2;
    }
    if (surface_.law().holds_distance()) {
        for (const Eigen::Index P : {first, first + 2}) border.D(P, force) = border.D(force, P) = -1 / base.te;
        border.d[force] = lead(base, system_.pulling(base.bead_numbers), 0) / base.te - rate.length;
        ++n;
    }
    const Eigen::Index count = n - first;
    border.C.middleCols(first, count) *= unit_of_beads(base), border.d.segment(first, count) *= unit_of_beads(base);
    border.D.block(first, first, count, count) *= base.te;
    border.R.middleCols(first, count) = border.C.middleCols(first, count);
}

// A number of X*, given by its slope, less that to which the expected motion of the nodes and none of the surface would
// lead.
double StepSolver::lead(const StepBase& base, const Eigen::VectorXd& slope, double by_stretch) const {
    return paired(slope, base.displacement - base.te * base.mesh_velocity, base.fields) +
           base.te * slope.head(base.velocity.size()).dot(base.velocity) + base.stretch * by_stretch;
}

// A functional of velocities, such as the force, of v at the nodes; of its normal part where nothing flows.
double StepSolver::paired(const Eigen::VectorXd& rows, const VectorField& v, const MotionFields& fields) const {
    const int n = surface_.nodes();
    if (!surface_.law().flows) return rows.head(n).dot(v.cwiseProduct(fields.normal).colwise().sum());
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum += rows.segment(i * n, n).dot(v.row(i));
    return sum;
}

// -(b, d) and that of the loads, to first order the free energy that a correction takes.
double StepSolver::work(const MovingSurface::Correction& by, const MotionState& at, const MotionFields& fields) const {
    const int n = surface_.nodes();
    const SurfaceSpace& space = surface_.space();
    const SurfaceLaw& law = surface_.law();
    const CurvedMesh mesh = surface_.mesh(at);
    const double volume = law.pressure_of_volume ? extent(space, mesh).volume : 0;
    Extent moved = extent_rate(space, mesh, by.displacement);
    if (law.beads) moved.length = surface_.distance_rate(mesh, surface_.bead_numbers(mesh), by.displacement);
    double sum = law.potential_rate(at.time, moved, volume);
    if (by.stretch != 0) {
        const StretchTerms& s = system_.stretch;
        double energy = s.energy + law.potential_rate(at.time, s.rate, volume);
        if (unknowns_.H >= 0) energy += s.row.segment(unknowns_.H, n).dot(fields.H);
        if (unknowns_.K >= 0) energy += s.row.segment(unknowns_.K, n).dot(fields.K);
        if (unknowns_.mu >= 0) energy += s.row.segment(unknowns_.mu, n).dot(fields.mu);
        sum += by.stretch * energy;
    }
    return sum - paired(system_.force, by.displacement, fields);
}

}  // namespace tubule::surface3d
