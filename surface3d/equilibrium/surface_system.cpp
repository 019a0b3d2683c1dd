#include "surface3d/equilibrium/surface_system.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "common/solve/dense.hpp"
#include "surface3d/equilibrium/surface_flow.hpp"
#include "surface3d/fem/mesh_quality.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/meshing/remesh.hpp"

namespace tubule::surface3d {
namespace {

constexpr double least_admissible = 0.1, good_quality = 0.45;
// Energy of the penalty, relative to all, beyond which the edges carry what belongs to the triangles.
constexpr double most_kinks = 0.05;
// A motion whose normal part is smaller than this, relative to the largest, only turns or slides the surface in itself.
constexpr double no_motion = 2e-3;

// Where motions turn about, and the length that makes turns and dilations as large as translations.
struct Middle {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double size = 0;

    explicit Middle(const CurvedMesh& mesh) {
        if (mesh.period == 0)
            for (const Eigen::Vector3d& x : mesh.nodes) centre += x / static_cast<double>(mesh.size());
        for (const Eigen::Vector3d& x : mesh.nodes) size = std::max(size, (x - centre).norm());
    }
};

// Normal parts at the nodes: three translations, three turns (of a tube the last alone); a dilation, and three
// conformal maps of space to first order.
Eigen::MatrixXd motions_of(const CurvedMesh& mesh, const VectorField& normal, const Middle& middle, bool dilation,
                           bool conformal) {
    const Eigen::Index n = normal.cols();
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, SurfaceSystem::most_motions);
    for (Eigen::Index i = 0; i < n; ++i) {
        const Eigen::Vector3d x = (mesh.nodes[i] - middle.centre) / middle.size, nu = normal.col(i), turn = x.cross(nu);
        out.row(i).head<3>() = nu.transpose();
        if (mesh.period > 0)
            out(i, 5) = turn.z();
        else
            out.row(i).segment<3>(3) = turn.transpose();
        if (dilation) out(i, 6) = x.dot(nu);
        if (conformal) out.row(i).tail<3>() = (2 * x.dot(nu) * x - x.squaredNorm() * nu).transpose();
    }
    return out;
}

// Whether both have the same first and second derivatives at given multipliers.
bool same_energy(const Bending& a, const Bending& b) {
    if (a.H0 != b.H0 || count_terms(a) != count_terms(b) || a.alpha.has_value() != b.alpha.has_value()) return false;
    for (std::size_t i = 0; i < count_terms(a); ++i)
        if (modulus(a, i) != modulus(b, i)) return false;
    return std::ranges::equal(a.potentials, b.potentials, {}, &Potential::strength, &Potential::strength);
}

}  // namespace

VectorField node_normals(const SurfaceSpace& space, const CurvedMesh& mesh) {
    VectorField out = VectorField::Zero(3, mesh.size());
    const Tabulation at = [&] {
        std::vector<QuadraturePoint> points;
        for (const auto& p : lattice(mesh.order))
            points.push_back({static_cast<double>(p[1]) / mesh.order, static_cast<double>(p[2]) / mesh.order, 1});
        return Tabulation(mesh.order, points);
    }();
    for (int cell = 0; cell < space.cells(); ++cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        for (int a = 0; a < space.width(); ++a) {
            const SurfacePoint<double> p = tangent_point(X, at, a);
            out.col(space.node(cell, a)) += p.area * p.normal;
        }
    }
    out.colwise().normalize();
    return out;
}

SurfaceSystem::SurfaceSystem(const CurvedMesh& base, const StationaryProblem& problem, const Eigen::VectorXd& H0)
    : problem_(problem), H0_(H0) {
    check_problem(problem, base.period);
    directions_.stretch = problem.free_period;
    if (problem.beads) beads_.emplace(problem.beads->width, BeadEquations::in_space);
    set_mesh(base, problem.loads.force);
}

void SurfaceSystem::set_mesh(const CurvedMesh& mesh, double force) {
    energy_ = std::make_shared<DiscreteEnergy>(mesh, problem_.bending);
    ordering_ = nested_dissection(energy_->pattern());
    if (problem_.free_period) ordering_.push_back(space().size());
    set_base(mesh, force);
}

void SurfaceSystem::set_problem(const StationaryProblem& problem) {
    check_problem(problem, base_.period);
    if (!same_energy(problem.bending, problem_.bending)) last_.reset(), sums_.reset();
    problem_ = problem;
}

void SurfaceSystem::set_base(const CurvedMesh& mesh, double force) {
    base_ = mesh;
    directions_.normal = node_normals(space(), base_);
    energy_->set_penalty(base_, problem_.bending);
    mass_ = energy_->mass(base_, directions_);
    last_.reset(), sums_.reset();
    const Eigen::VectorXd u = unknowns_at_base();
    scale_ = reference_energy(u);
    without_cost_.on_axis = hold_axis(problem_, force, size(u), scale_);
    set_motions();
}

void SurfaceSystem::set_motions() {
    const Constraints& c = problem_.constraints;
    const bool free_size = !c.area && !c.volume, any_shape = free_size && !c.reduced_volume && base_.period == 0;
    const bool scales = scale_free(problem_) && free_size && base_.period == 0;
    const Middle middle(base_);
    const Eigen::MatrixXd all = motions_of(base_, directions_.normal, middle, scales, scales && any_shape);
    // Compared with the largest motion of all: where a potential leaves turns alone, these may have no normal part.
    const Eigen::MatrixXd products = all.transpose() * (mass_ * all);
    const double least = no_motion * no_motion * products.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff();
    set_turn(all.leftCols<6>(), middle.centre, middle.size, least);
    for (const bool on_axis : {false, true}) {
        Eigen::MatrixXd& motions = without_cost_.functionals[on_axis];
        motions.resize(shape_size(), 0);
        const Eigen::MatrixXd rigid =
            free_motions(base_, problem_.bending.potentials, on_axis, middle.centre, middle.size);
        Eigen::MatrixXd fields(all.rows(), rigid.cols() + 4);
        fields << all.leftCols<6>() * rigid, all.rightCols<4>();
        const Eigen::MatrixXd image = mass_ * fields;
        const Eigenpairs gram = eigenpairs(fields.transpose() * image, true);
        for (Eigen::Index j = 0; j < fields.cols(); ++j) {
            const double norm2 = gram.values[j];
            if (!(norm2 > least)) continue;
            motions.conservativeResize(shape_size(), motions.cols() + 1);
            motions.rightCols<1>().setZero();
            motions.rightCols<1>().head(mass_.rows()) = image * gram.vectors.col(j) / std::sqrt(norm2);
        }
    }
}

// The combinations of rigid motions without a normal part: of a closed surface of revolution there is one.
void SurfaceSystem::set_turn(const Eigen::MatrixXd& rigid, const Eigen::Vector3d& centre, double size, double least) {
    turn_.reset();
    const Eigen::Index first = base_.period > 0 ? 5 : 0, count = 6 - first;
    const Eigen::MatrixXd fields = rigid.middleCols(first, count);
    const Eigenpairs gram = eigenpairs(fields.transpose() * (mass_ * fields), true);
    if (!(gram.values[0] < least) || (count > 1 && gram.values[1] < least)) return;
    Eigen::VectorXd c = Eigen::VectorXd::Zero(6);
    c.tail(count) = gram.vectors.col(0);
    const Eigen::Vector3d omega = c.tail<3>() / size;
    if (!(omega.norm() * size > 0.1)) return;
    turn_ = {(c.head<3>() - omega.cross(centre)) / omega.norm(), omega.normalized()};
}

std::vector<int> SurfaceSystem::wave_numbers(const Eigen::VectorXd& u, const Eigen::MatrixXd& displacements) const {
    std::vector<int> out(displacements.cols(), -1);
    if (!turn_) return out;
    const CurvedMesh at = mesh(u);
    const Tabulation& table = space().tabulation();
    Eigen::VectorXd turned = Eigen::VectorXd::Zero(displacements.cols()), all = turned;
    for (int cell = 0; cell < space().cells(); ++cell) {
        const CellColumns<3> X = cell_nodes(at, cell);
        Eigen::MatrixXd w(space().width(), displacements.cols());
        for (int a = 0; a < space().width(); ++a) w.row(a) = displacements.row(space().node(cell, a));
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const Eigen::RowVectorXd along =
                (turn_->velocity + turn_->omega.cross(p.x)).transpose() * gradients(p, table, q) * w;
            turned += table.weight[q] * p.area * along.cwiseAbs2().transpose();
            all += table.weight[q] * p.area * (table.value.col(q).transpose() * w).cwiseAbs2().transpose();
        }
    }
    for (Eigen::Index j = 0; j < all.size(); ++j) {
        const double m = std::sqrt(turned[j] / all[j]);  // of w cos(m theta)
        if (std::abs(m - std::round(m)) < 0.1) out[j] = static_cast<int>(std::lround(m));
    }
    return out;
}

CurvedMesh SurfaceSystem::mesh(const Eigen::VectorXd& u) const {
    CurvedMesh out = base_;
    const double stretch = problem_.free_period ? u[shape_size() - 1] : 0;
    for (int i = 0; i < out.size(); ++i) {
        const double z = out.nodes[i].z();
        out.nodes[i] += u[i] * directions_.normal.col(i);
        out.nodes[i].z() += stretch * z;
    }
    out.period *= 1 + stretch;
    return out;
}

Bending SurfaceSystem::bending(const Eigen::VectorXd& u) const {
    Bending out = problem_.bending;
    if (out.alpha) out.mu = u[mu()];
    if (beads_)
        out.potentials.push_back({.kind = Potential::Kind::formula,
                                  .formula = std::make_shared<const Formula>(
                                      parse_formula(beads_->force_density(bead_numbers(u)), Potential::in_space))});
    return out;
}

BeadSurface SurfaceSystem::on(const Eigen::VectorXd& u) const {
    const auto at = std::make_shared<const CurvedMesh>(mesh(u));
    return {[this, at](const Formula& W, double P) { return place_integral(space(), *at, W, P); },
            [this, at](const Formula& W, double P) { return energy_->place_slope(*at, directions_, W, P); }};
}

double SurfaceSystem::bead_coarseness(const Eigen::VectorXd& u) const {
    return beads_ ? surface3d::bead_coarseness(mesh(u), bead_numbers(u), beads_->width()).value : 0;
}

double SurfaceSystem::axial_force(const Eigen::VectorXd& u) const {
    if (!(base_.period > 0)) return bead_force(u);
    if (problem_.free_period) return problem_.loads.force;
    const CurvedMesh at = mesh(u);
    Bending membrane = bending(u);  // what acts at places does not stretch with the period, but is a tension
    membrane.potentials.clear();
    const EnergyDerivatives d =
        energy_->derivatives(at, {directions_.normal, true}, membrane, u[sigma()], u[lambda()], H0_, false);
    double sum = (d.energy + u[sigma()] * d.area + u[lambda()] * d.volume).tail<1>()[0];
    const std::optional<Formula> W = potential_density_in_space(problem_.bending.potentials);
    const Tabulation& table = space().tabulation();
    for (int cell = 0; W && cell < space().cells(); ++cell) {
        const CellColumns<3> X = cell_nodes(at, cell);
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            sum += table.weight[q] * p.area * evaluate(*W, p.x.data()) * (1 - p.normal.z() * p.normal.z());
        }
    }
    return sum / at.period;
}

double SurfaceSystem::length(const Eigen::VectorXd& u) const {
    return beads_ ? BeadEquations::distance(bead_numbers(u)) : mesh(u).period;
}

const EnergyValues& SurfaceSystem::sums(const Eigen::VectorXd& u) const {
    if (!sums_ || sums_at_ != u.head(shape_size())) {
        sums_at_ = u.head(shape_size());
        sums_ = energy_->values(mesh(u), problem_.bending, H0_);
    }
    return *sums_;
}

EnergyValues SurfaceSystem::values(const Eigen::VectorXd& u) const {
    EnergyValues v = sums(u);
    v.energy += area_difference_energy(problem_.bending, v.M);
    return v;
}

void SurfaceSystem::set_followers(Eigen::VectorXd& u) const {
    u[mu()] = problem_.bending.alpha ? area_difference_force(problem_.bending, values(u).M) : 0;
    if (beads_)
        u.segment<4>(beads()) =
            beads_->numbers(on(u), poles(mesh(u)), problem_.held_distance() ? bead_force(u) : problem_.loads.force);
}

const EnergyDerivatives& SurfaceSystem::derivatives(const Eigen::VectorXd& u) const {
    if (!last_ || at_ != u) {
        at_ = u;
        last_ = energy_->derivatives(mesh(u), directions_, bending(u), u[sigma()], u[lambda()], H0_);
    }
    return *last_;
}

MultiplierEquations SurfaceSystem::equations(const EnergyValues& v, const Eigen::VectorXd& u) const {
    return multiplier_equations(problem_, v.area, v.volume, u[sigma()], u[lambda()]);
}

void SurfaceSystem::set_constraints(const EnergyValues& v, const Eigen::VectorXd& u, Eigen::VectorXd& F) const {
    F.segment<2>(sigma()) = equations(v, u).F;
    F[mu()] = u[mu()] - area_difference_force(problem_.bending, v.M);
    const Eigen::Index held = held_motions();
    F.tail(most_motions) = u.tail(most_motions);
    F.segment(motions(), held) = without_cost_.functionals[without_cost_.on_axis].transpose() * u.head(shape_size());
    if (beads_) F.segment<4>(beads()) = beads_->residual(on(u), bead_load(), bead_numbers(u));
}

Eigen::VectorXd SurfaceSystem::constraint_residual(const Eigen::VectorXd& u) const {
    Eigen::VectorXd F = Eigen::VectorXd::Zero(unknowns());
    set_constraints(values(u), u, F);
    return F;
}

double SurfaceSystem::constraint_error(const Eigen::VectorXd& u) const {
    const EnergyValues v = values(u);
    const double held = tubule::constraint_error(problem_.constraints, equations(v, u), std::sqrt(v.area));
    const std::optional<double> distance = problem_.held_distance();
    return distance ? std::max(held, std::abs(length(u) - *distance) / std::sqrt(v.area)) : held;
}

Eigen::VectorXd SurfaceSystem::residual(const Eigen::VectorXd& u) const {
    const bool known = last_ && at_ == u;
    const EnergyDerivatives first =
        known ? EnergyDerivatives{}
              : energy_->derivatives(mesh(u), directions_, bending(u), u[sigma()], u[lambda()], H0_, false);
    const EnergyDerivatives& d = known ? *last_ : first;
    Eigen::VectorXd F(unknowns());
    F.head(shape_size()) = d.energy + u[sigma()] * d.area + u[lambda()] * d.volume +
                           without_cost_.functionals[without_cost_.on_axis] * u.segment(motions(), held_motions());
    if (problem_.free_period) F[shape_size() - 1] -= problem_.loads.force * base_.period;
    set_constraints(d.values, u, F);
    return F;
}

Eigen::SparseMatrix<double> SurfaceSystem::jacobian(const Eigen::VectorXd& u, double damping) const {
    const EnergyDerivatives& d = derivatives(u);
    const int N = space().size(), n = shape_size();
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(n, unknowns() - n), rows = columns.transpose();
    Eigen::MatrixXd corner = Eigen::MatrixXd::Identity(rows.rows(), rows.rows());
    const MultiplierEquations e = equations(d.values, u);
    columns.col(0) = d.area, columns.col(1) = d.volume;
    for (int i = 0; i < 2; ++i) rows.row(i) = (e.by_extent(i, 0) * d.area + e.by_extent(i, 1) * d.volume).transpose();
    corner.topLeftCorner<2, 2>() = e.by_multipliers;
    if (problem_.bending.alpha) columns.col(2) = d.M, rows.row(2) = -*problem_.bending.alpha * d.M.transpose();
    const Eigen::Index held = held_motions();
    const int first = motions() - n;
    columns.middleCols(first, held) = without_cost_.functionals[without_cost_.on_axis];
    rows.middleRows(first, held) = without_cost_.functionals[without_cost_.on_axis].transpose();
    corner.diagonal().segment(first, held).setZero();
    if (beads_) {
        const BeadEquations::Slopes s = beads_->slopes(on(u), bead_load(), bead_numbers(u));
        columns.middleCols<4>(3) = s.force_by_numbers, rows.middleRows<4>(3) = s.equations_by_shape;
        corner.block<4, 4>(3, 3) = s.equations_by_numbers;
    }

    Eigen::SparseMatrix<double> J(unknowns(), unknowns());
    const Eigen::SparseMatrix<double> H = damping != 0 ? d.hessian + damping * mass_ : d.hessian;
    J.reserve(H.nonZeros() + 2 * (unknowns() - N) * unknowns());
    for (int j = 0; j < N; ++j) {
        J.startVec(j);
        for (Eigen::SparseMatrix<double>::InnerIterator it(H, j); it; ++it) J.insertBack(it.row(), j) = it.value();
        if (problem_.free_period) J.insertBack(N, j) = d.with_stretch[j];
        for (int i = 0; i < rows.rows(); ++i) J.insertBack(n + i, j) = rows(i, j);
    }
    if (problem_.free_period) {
        J.startVec(N);
        for (int i = 0; i < N; ++i) J.insertBack(i, N) = d.with_stretch[i];
        J.insertBack(N, N) = d.stretch_twice + damping * d.values.area * base_.period * base_.period;
        for (int i = 0; i < rows.rows(); ++i) J.insertBack(n + i, N) = rows(i, N);
    }
    for (int j = 0; j < columns.cols(); ++j) {
        J.startVec(n + j);
        for (int i = 0; i < n; ++i) J.insertBack(i, n + j) = columns(i, j);
        for (int i = 0; i < rows.rows(); ++i) J.insertBack(n + i, n + j) = corner(i, j);
    }
    J.finalize();
    return J;
}

double SurfaceSystem::merit(const Eigen::VectorXd& u) const {
    const EnergyValues v = values(u);
    const double value = lagrangian(problem_, v.energy, v.area, v.volume, length(u), u[sigma()], u[lambda()]);
    return beads_ ? value + beads_->lagrangian(on(u), bead_load(), bead_numbers(u)) : value;
}

Extents SurfaceSystem::extents(const Eigen::VectorXd& u) const {
    const EnergyValues v = values(u);
    return {v.area, v.volume, length(u)};
}

double SurfaceSystem::size(const Eigen::VectorXd& u) const {
    return std::sqrt(extents(u).area);
}

double SurfaceSystem::reference_energy(const Eigen::VectorXd& u) const {
    const CurvedMesh at = mesh(u);
    const Tabulation& table = space().tabulation();
    const std::optional<Formula> W = potential_density_in_space(problem_.bending.potentials);
    double sum = 0;
    for (int cell = 0; cell < space().cells(); ++cell) {
        const CellColumns<3> X = cell_nodes(at, cell);
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = curved_point(X, table, q);
            if (W) sum += table.weight[q] * p.area * std::abs(evaluate(*W, p.x.data()));
            const double H0 = H0_.size() > 0 ? space().gather(H0_, cell).dot(table.value.col(q)) : problem_.bending.H0;
            sum += table.weight[q] * p.area * magnitude(problem_.bending, H0, p.H, p.K);
        }
    }
    const EnergyValues v = values(u);
    return std::max(std::abs(v.energy), sum + area_difference_energy(problem_.bending, v.M));
}

bool SurfaceSystem::admissible(const Eigen::VectorXd& u) const {
    if (!u.allFinite()) return false;
    const CurvedMesh at = mesh(u);
    if ((base_.period > 0 && !(at.period > 0)) || !(mesh_quality(at).worst > least_admissible)) return false;
    if (!(wall_distance(at, problem_.bending.potentials).value > 0)) return false;
    const EnergyValues& v = sums(u);
    return std::isfinite(v.energy) && v.kinks < most_kinks * scale_;
}

bool SurfaceSystem::rebase(Eigen::VectorXd& u, Eigen::VectorXd* along, int triangles) {
    const CurvedMesh next = mesh(u);
    const int N = space().size();
    if (along && problem_.free_period) (*along)[N] /= 1 + u[N];
    if (H0_.size() == 0 && (triangles > 0 || mesh_quality(next).worst < good_quality) &&
        take_new_mesh(next, triangles, u, along))
        return true;
    const VectorField before = directions_.normal;
    set_base(next, bead_force(u));
    u.head(shape_size()).setZero();
    if (along) along->head(N).array() *= before.cwiseProduct(directions_.normal).colwise().sum().transpose().array();
    return false;
}

// False if there is no good one.
bool SurfaceSystem::take_new_mesh(const CurvedMesh& shape, int triangles, Eigen::VectorXd& u, Eigen::VectorXd* along) {
    const int N = space().size(), before = shape_size();
    const Eigen::MatrixXd fields = along ? Eigen::MatrixXd(along->head(N).transpose()) : Eigen::MatrixXd(0, N);
    RemeshOptions options;
    options.quality = good_quality, options.triangles = triangles;
    auto better = remesh(shape, fields, options);
    auto* found = std::get_if<Remeshed>(&better);
    if (!found) return false;
    const Eigen::VectorXd multipliers = u.tail(u.size() - before);
    set_mesh(found->mesh, bead_force(u));
    u.setZero(unknowns());
    u.tail(multipliers.size()) = multipliers;
    if (along) {
        const double stretch = along->tail(1)[0];
        *along = Eigen::VectorXd::Constant(shape_size(), stretch);
        along->head(space().size()) = found->fields.row(0).transpose();
    }
    return true;
}

Eigen::VectorXd SurfaceSystem::unknowns_at_base() const {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(unknowns());
    u[sigma()] = problem_.loads.tension, u[lambda()] = -problem_.loads.pressure_at(values(u).volume);
    set_followers(u);
    return u;
}

ConstrainedForm SurfaceSystem::second_variation(const Eigen::VectorXd& u, const Constraints& c) const {
    const EnergyDerivatives& d = derivatives(u);
    const int N = space().size(), n = shape_size();
    ConstrainedForm A;
    const auto extended = [&](const Eigen::SparseMatrix<double>& M, bool form) {
        if (n == N) return M;
        Eigen::SparseMatrix<double> out(n, n);
        std::vector<Eigen::Triplet<double>> entries;
        for (int j = 0; j < N; ++j) {
            for (Eigen::SparseMatrix<double>::InnerIterator it(M, j); it; ++it)
                entries.emplace_back(it.row(), j, it.value());
            entries.emplace_back(N, j, form ? d.with_stretch[j] : 0),
                entries.emplace_back(j, N, form ? d.with_stretch[j] : 0);
        }
        entries.emplace_back(N, N, form ? d.stretch_twice : 0);
        out.setFromTriplets(entries.begin(), entries.end());
        return out;
    };
    A.form = extended(d.hessian, true), A.mass = extended(mass_, false);
    A.constraints = without_cost_.functionals[is_on_axis(u)];
    const auto append = [](Eigen::MatrixXd& to, const Eigen::VectorXd& column) {
        to.conservativeResize(column.size(), to.cols() + 1);
        to.col(to.cols() - 1) = column;
    };
    const auto weigh = [&](double weight) {
        A.weights.conservativeResize(A.weights.size() + 1);
        A.weights[A.weights.size() - 1] = weight;
    };
    if (c.area) append(A.constraints, d.area);
    if (c.volume) append(A.constraints, d.volume);
    A.low_rank.resize(n, 0);
    if (c.reduced_volume) {
        const ReducedVolumeSlopes slopes = reduced_volume_slopes(*c.reduced_volume, d.values.area);
        append(A.constraints, d.volume + slopes.by_area * d.area);
        if (const double weight = u[lambda()] * slopes.by_area_twice; weight != 0)
            append(A.low_rank, d.area), weigh(weight);
    }
    if (problem_.bending.alpha.value_or(0) != 0) append(A.low_rank, d.M), weigh(*problem_.bending.alpha);
    if (const double slope = problem_.loads.pressure_slope(d.values.volume); slope != 0)
        append(A.low_rank, d.volume), weigh(-slope);
    if (!beads_) return A;
    const BeadSurface at = on(u);
    const auto [columns, weights] = beads_->following(at, bead_numbers(u));
    for (Eigen::Index i = 0; i < weights.size(); ++i)
        if (weights[i] != 0) append(A.low_rank, columns.col(i)), weigh(weights[i]);
    if (problem_.held_distance()) append(A.constraints, beads_->distance_slope(at, bead_numbers(u)));
    return A;
}

double SurfaceSystem::stiffness(const Eigen::VectorXd& u) const {
    return reference_energy(u) / std::pow(derivatives(u).values.area, 2);
}

SurfaceSpectrum SurfaceSystem::spectrum(const Eigen::VectorXd& u, int count) const {
    return lowest_eigenvalues(second_variation(u), ordering_, count, stiffness(u));
}

// Velocities of those that cost no energy, numbered component by component, a column each; orthonormal.
Eigen::MatrixXd SurfaceSystem::rigid_motions(const CurvedMesh& mesh, bool on_axis) const {
    const Middle middle(mesh);
    const int n = mesh.size();
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(3 * n, 6);
    for (int i = 0; i < n; ++i) {
        const Eigen::Vector3d x = (mesh.nodes[i] - middle.centre) / middle.size;
        for (int k = 0; k < 3; ++k) {
            const Eigen::Vector3d turn = Eigen::Vector3d::Unit(k).cross(x);
            for (int d = 0; d < 3; ++d) {
                all(d * n + i, k) = d == k;
                if (mesh.period == 0 || k == 2) all(d * n + i, 3 + k) = turn[d];
            }
        }
    }
    all = (all * free_motions(mesh, problem_.bending.potentials, on_axis, middle.centre, middle.size)).eval();
    const Eigenpairs gram = eigenpairs(all.transpose() * all, true);
    const Eigen::Index none = (gram.values.array() <= 1e-8 * n).count(), some = all.cols() - none;
    return all * gram.vectors.rightCols(some) * gram.values.tail(some).cwiseSqrt().cwiseInverse().asDiagonal();
}

SurfaceSpectrum SurfaceSystem::modes(const Eigen::VectorXd& u, const MotionLaw& law, int count) const {
    if (!law.inextensible || count == 0) return spectrum(u, count);
    const EnergyDerivatives& d = derivatives(u);
    // Where H is the same everywhere both are one constraint.
    const double alike = std::abs(d.area.dot(d.volume)) / (d.area.norm() * d.volume.norm());
    const bool one = !law.reservoir && 1 - alike < 1e-6;
    Constraints held;
    if (!law.reservoir) held.area = d.values.area;
    if ((law.keeps_volume || problem_.constraints.volume) && !one) held.volume = d.values.volume;
    ConstrainedForm A = second_variation(u, held);
    SurfaceSpectrum still = lowest_eigenvalues(A, ordering_, count, stiffness(u));  // without what flows
    A.constraints =
        A.constraints.rightCols(A.constraints.cols() - without_cost_.functionals[is_on_axis(u)].cols()).eval();
    const CurvedMesh at = mesh(u);
    const FlowForm flow =
        flow_form(A, space(), at, directions_.normal, law, rigid_motions(at, is_on_axis(u)), stiffness(u));
    // That of a sphere has modes of this friction, or less.
    const double drag = law.friction + 16 * pi * law.viscosity / d.values.area;
    const double G = still.values.cwiseAbs().maxCoeff(), slow = 2 * G / (drag + std::sqrt(drag * drag + 4 * G));
    SurfaceSpectrum out =
        law.inertia == 0 ? lowest_of_flow(flow, count, G / drag) : slowest_of_fluid(flow, count, slow);
    const auto growing = static_cast<int>((out.values.array() < 1e-4 * slow).count());
    if (law.inertia != 0 && growing < std::min(count, still.negative))
        out.doubt = fmt::format("{} rates grow, {} by the inertia of the form", growing, still.negative);
    out.negative = index(u);
    if (out.doubt.empty()) out.doubt = std::move(still.doubt);
    return out;
}

int SurfaceSystem::index(const Eigen::VectorXd& u) const {
    const ConstrainedForm A = second_variation(u);
    try {
        return count_negative(A, ordering_, stiffness(u));
    } catch (const SolveError&) {  // no factors without pivoting
        return lowest_eigenvalues(A, ordering_, 12, stiffness(u)).negative;
    }
}

Eigen::VectorXd SurfaceSystem::way_down(const Eigen::VectorXd& u) const {
    const ConstrainedForm A = second_variation(u);
    const double scale = stiffness(u), level = -1e-6 * scale;
    try {
        if (count_below(A, ordering_, level) == 0) return {};
    } catch (const SolveError&) {  // no factors without pivoting
    }
    const SurfaceSpectrum s = lowest_eigenvalues(A, ordering_, 1, scale);
    if (s.values[0] > level) return {};
    return s.vectors.col(0);
}

}  // namespace tubule::surface3d
