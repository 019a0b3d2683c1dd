#include "surface3d/motion/step_solver.hpp"

#include "common/solve/parallel.hpp"

namespace tubule::surface3d {
namespace {

// H of a mesh answers to waves of its own size by up to .06, .07, .08 |B| (width of a triangle) more than L_H for k =
// 2, 3, 4; what little damps would grow in long steps.
constexpr double curvature_stabilisation = 0.08;
constexpr double flux_tolerance = 1e-7;  // how well the mesh follows the surface, relative
constexpr int most_iterations = 20;      // of that, before it is factored

}  // namespace

StepSolver::StepSolver(MovingSurface& surface)
    : surface_(surface),
      unknowns_(surface.mesh(), surface.law(), surface.bending()),
      solver_(unknowns_.pattern(), unknowns_.node_of_unknown()),
      gmres_(unknowns_.nodes()) {}

StageSolution StepSolver::solve(const Stage& stage, const Extent& rate) {
    const CurvedMesh at = surface_.mesh(stage.X);
    StepBase base{&at,      surface_.fields(at),    stage.X - stage.Xbar, stage.w, stage.u, stage.ubar,
                  stage.te, curvature_stabilisation};
    StageSolution out;
    out.keeps_volume = surface_.law().keeps_volume && !surface_.area_is_volume(at, base.fields);
    const Eigen::VectorXd x = solve(base, rate, out.keeps_volume, out.lambda);
    out.u = x.head(stage.u.size());
    if (unknowns_.p >= 0) out.p = x.tail(unknowns_.size() - unknowns_.p);
    out.w = surface_.mesh_velocity(at, base.fields, mesh_flux(base, out.u), stage.relaxation);
    out.X = stage.Xbar + stage.te * out.w;
    out.fields = std::move(base.fields);
    return out;
}

KeptExtent StepSolver::keep_extent(const StageSolution& solved, MotionState& to) const {
    const auto [displacement, lacked] = surface_.correction(to.X, solved.fields, solved.keeps_volume);
    to.X += displacement;
    return {work(displacement, solved.fields), lacked};
}

// The evolution of H and K, times -f_HH/te and -f_KK/te, is the transpose of the force but for terms without
// derivatives, the variation of these factors, what is carried along the surface, and the stabilisation of L_H.
void StepSolver::make_symmetric(const StepBase& base) {
    const Bending& bending = surface_.bending();
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(unknowns_.size());
    for (int i = 0; i < surface_.nodes(); ++i) {
        const CurvatureJet<double> f = density(bending, base.fields.H[i], base.fields.K[i]);
        const auto factor = [&](double second) { return second > 0 ? -second / base.te : -1 / base.te; };
        if (unknowns_.H >= 0) scale[unknowns_.H + i] = factor(f.HH);
        if (unknowns_.K >= 0) scale[unknowns_.K + i] = factor(f.KK);
    }
    Eigen::SparseMatrix<double>& A = system_.A;
    parallel_for(static_cast<std::size_t>(A.cols()), [&](std::size_t j) {
        for (int k = A.outerIndexPtr()[j]; k < A.outerIndexPtr()[j + 1]; ++k)
            A.valuePtr()[k] *= scale[A.innerIndexPtr()[k]];
    });
    system_.b.array() *= scale.array();
}

// With the given rates of area and volume, where they are kept.
Eigen::VectorXd StepSolver::solve(const StepBase& base, const Extent& rate, bool with_lambda, double& lambda) {
    const SurfaceLaw& law = surface_.law();
    const MotionControl& control = surface_.control();
    assemble(surface_.space(), unknowns_, law, surface_.bending(), base, system_);
    if (law.inextensible && control.area) system_.b -= rate.area / *control.area * system_.pressure_load;
    make_symmetric(base);
    const Eigen::MatrixXd rigid = surface_.open_rigid_motions(*base.mesh);
    Eigen::MatrixXd border = Eigen::MatrixXd::Zero(unknowns_.size(), rigid.cols() + with_lambda);
    border.topLeftCorner(rigid.rows(), rigid.cols()) = rigid;
    Eigen::VectorXd held = Eigen::VectorXd::Zero(border.cols());
    if (with_lambda) {
        border.rightCols<1>() = system_.flux;
        if (control.volume) held.tail<1>()[0] = rate.volume;
    }
    const auto [x, y] = solver_.solve(system_.A, system_.b, border, held);
    lambda = with_lambda ? y.tail<1>()[0] : 0;
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
    const Row back = base.displacement.cwiseProduct(base.fields.normal).colwise().sum();
    const Eigen::VectorXd b = flux + along * back.transpose();
    Eigen::VectorXd out = b;
    const auto carried = [&](const Eigen::VectorXd& x, Eigen::VectorXd& y) {
        y = x + base.te * (along * surface_.projection()(Row(x.transpose())).transpose());
    };
    const auto as_it_is = [](const Eigen::VectorXd& x, Eigen::VectorXd& y) { y = x; };
    try {
        gmres_.solve(carried, as_it_is, b, out, flux_tolerance, most_iterations);
    } catch (const SolveError&) {  // far along the surface in a step
        const Eigen::SparseMatrix<double> mass = mass_matrix(surface_.space(), *base.mesh);
        SparseLuLarge lu;
        lu.factor(mass + base.te * along);
        out = mass * lu.solve(b);
    }
    return out;
}

// -(b, d), to first order the energy that a displacement of the nodes takes.
double StepSolver::work(const VectorField& d, const MotionFields& fields) const {
    const int n = surface_.nodes();
    if (!surface_.law().flows) return -system_.force.head(n).dot(d.cwiseProduct(fields.normal).colwise().sum());
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum -= system_.force.segment(i * n, n).dot(d.row(i));
    return sum;
}

}  // namespace tubule::surface3d
