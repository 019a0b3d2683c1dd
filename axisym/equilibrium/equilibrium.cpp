#include "axisym/equilibrium/equilibrium.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "axisym/curve/curve_measures.hpp"
#include "axisym/equilibrium/mode_stability.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/equilibrium/newton.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/solve/dense.hpp"
#include "common/solve/pause.hpp"

namespace tubule::axisym {
namespace {

// Radius of a neck, over that of the sphere of the same area, below which no search goes on.
constexpr double closed_neck = 0.003;

}  // namespace

StationarySystem::StationarySystem(std::shared_ptr<const CurveSpace> space, const StationaryProblem& problem,
                                   double gauge)
    : space_(std::move(space)), forms_(*space_, problem.bending), gauge_(gauge) {
    set_problem(problem);
    if (problem.beads) bead_forms_.emplace(bead_forms(*space_, problem));
    place_ = Eigen::VectorXd::Zero(space_->size());
    if (space_->topology() == Topology::cell) place_.tail(space_->z().size()) = space_->z().mean();
}

void StationarySystem::set_problem(const StationaryProblem& problem) {
    if (problem.free_period != space_->free_period())
        throw std::invalid_argument("a force needs a free period, and a space with one");
    check_problem(problem, space_->closed() ? 0 : space_->length());
    problem_ = problem;
    rim_ = rim_functionals(*space_, problem.rings);
    forms_.set_bending(problem.bending);
}

void StationarySystem::set_followers(Eigen::VectorXd& u) const {
    u[mu()] = area_difference_force(problem_.bending, forms_.M(u.data()));
    if (!bead_forms_) return;
    const double force =
        problem_.held_distance() ? bead_forms_->force(u.data(), bead_numbers(u)) : problem_.loads.force;
    u.segment<4>(beads()) = bead_forms_->numbers(u.data(), force);
}

void StationarySystem::follow(const Eigen::VectorXd& change, Eigen::VectorXd& out) const {
    out[mu()] = change[mu()];
    if (bead_forms_) out.segment<4>(beads()) = change.segment<4>(beads());
}

double StationarySystem::length(const Eigen::VectorXd& u) const {
    return bead_forms_ ? BeadEquations::distance(bead_numbers(u)) : space_->length(u.data());
}

Weights StationarySystem::weights(const Eigen::VectorXd& u) const {
    return {.energy = 1,
            .area = u[sigma()],
            .volume = u[lambda()],
            .gauge = gauge_,
            .M = problem_.bending.alpha ? u[mu()] : 0};
}

// The last equations, for the numbers beside the curve.
void StationarySystem::set_constraints(const CurveObservation& o, const Eigen::VectorXd& u, Eigen::VectorXd& F) const {
    const int n = space_->size();
    F.segment<2>(n) = equations(o, u).F;
    F[n + 2] = u[n + 2] - area_difference_force(problem_.bending, o.M);
    F[n + 3] = drifts() ? place_.dot(u.head(n)) : u[n + 3];
    if (bead_forms_)
        F.segment<4>(beads()) =
            bead_forms_->equations().residual(bead_forms_->on(u.data()), bead_load(), bead_numbers(u));
    F.tail(rim_.cols()) = rim_.transpose() * u.head(n) - rim_values(problem_.rings);
}

Eigen::VectorXd StationarySystem::constraint_residual(const Eigen::VectorXd& u) const {
    Eigen::VectorXd F = Eigen::VectorXd::Zero(unknowns());
    set_constraints(forms_.observe(curve(u)), u, F);
    return F;
}

double StationarySystem::constraint_error(const Eigen::VectorXd& u) const {
    const CurveObservation o = forms_.observe(curve(u));
    const double size = std::sqrt(o.area), held = tubule::constraint_error(problem_.constraints, equations(o, u), size);
    const std::optional<double> distance = problem_.held_distance();
    double off = distance ? std::abs(length(u) - *distance) : 0;
    if (rim_.cols() > 0)
        off = std::max(off, (rim_.transpose() * curve(u) - rim_values(problem_.rings)).lpNorm<Eigen::Infinity>());
    return std::max(held, off / size);
}

Extents StationarySystem::extents(const Eigen::VectorXd& u) const {
    const CurveObservation o = forms_.observe(curve(u));
    return {o.area, o.volume, length(u)};
}

double StationarySystem::size(const Eigen::VectorXd& u) const {
    return std::sqrt(forms_.observe(curve(u)).area);
}

Eigen::VectorXd StationarySystem::residual(const Eigen::VectorXd& u) const {
    const int n = space_->size();
    const Eigen::VectorXd x = curve(u);
    Eigen::VectorXd F = Eigen::VectorXd::Zero(unknowns());
    F.head(n) = u[n + 3] * place_ + rim_ * u.tail(rim_.cols());
    forms_.add_gradient(weights(u), x.data(), F.data());
    if (bead_forms_) bead_forms_->add_force(x.data(), bead_numbers(u), F.data());
    if (problem_.free_period) F[n - 1] -= problem_.loads.force * space_->images();
    set_constraints(forms_.observe(x), u, F);
    return F;
}

Eigen::SparseMatrix<double> StationarySystem::hessian(const Eigen::VectorXd& u) const {
    const Eigen::VectorXd x = curve(u);
    Eigen::SparseMatrix<double> out = forms_.hessian(weights(u), x);
    if (!bead_forms_) return out;
    Eigen::SparseMatrix<double> of_beads = forms_.pattern();
    bead_forms_->add_hessian(x.data(), bead_numbers(u), forms_.slots(), of_beads.valuePtr());
    return out + of_beads;
}

Eigen::SparseMatrix<double> StationarySystem::jacobian(const Eigen::VectorXd& u, double damping) const {
    const int n = space_->size(), more = numbers();
    const Eigen::VectorXd x = curve(u);
    Eigen::SparseMatrix<double> hessian = this->hessian(u);
    if (damping != 0) hessian += damping * forms_.mass(x);
    Eigen::MatrixXd columns(n, more), rows = Eigen::MatrixXd::Zero(more, n), corner = Eigen::MatrixXd::Zero(more, more);
    const Eigen::VectorXd area = forms_.gradient({.area = 1}, x), volume = forms_.gradient({.volume = 1}, x),
                          M = slope_of_M(x);
    columns.leftCols<4>() << area, volume, M, place_;
    const MultiplierEquations e = equations(forms_.observe(x), u);
    for (int i = 0; i < 2; ++i) rows.row(i) = e.by_extent(i, 0) * area + e.by_extent(i, 1) * volume;
    corner.topLeftCorner<2, 2>() = e.by_multipliers;
    rows.row(2) = -problem_.bending.alpha.value_or(0) * M, corner(2, 2) = 1;
    if (drifts())
        rows.row(3) = place_;
    else
        corner(3, 3) = 1;
    if (bead_forms_) {
        const BeadEquations::Slopes s =
            bead_forms_->equations().slopes(bead_forms_->on(x.data()), bead_load(), bead_numbers(u));
        columns.middleCols<4>(4) = s.force_by_numbers, rows.middleRows<4>(4) = s.equations_by_shape;
        corner.block<4, 4>(4, 4) = s.equations_by_numbers;
    }
    columns.rightCols(rim_.cols()) = rim_, rows.bottomRows(rim_.cols()) = rim_.transpose();
    return bordered(hessian, columns, rows, corner);
}

// Zero where nothing depends on it.
Eigen::VectorXd StationarySystem::slope_of_M(const Eigen::VectorXd& x) const {
    return problem_.bending.alpha ? forms_.gradient({.M = 1}, x) : Eigen::VectorXd::Zero(x.size());
}

double StationarySystem::merit(const Eigen::VectorXd& u) const {
    const CurveObservation o = forms_.observe(curve(u));
    double value =
        lagrangian(problem_, o.energy, o.area, o.volume, length(u), u[sigma()], u[lambda()]) + gauge_ * o.gauge;
    value += u.tail(rim_.cols()).dot(rim_.transpose() * curve(u) - rim_values(problem_.rings));
    if (!bead_forms_) return value;
    return value + bead_forms_->equations().lagrangian(bead_forms_->on(u.data()), bead_load(), bead_numbers(u));
}

Eigen::VectorXd StationarySystem::way_down(const Eigen::VectorXd& u) const {
    const Variation v = variation(u, 1);
    if (v.eigenvalues[0] >= -1e-9 * reference_energy(u)) return {};
    return v.vectors.col(0);
}

Variation StationarySystem::variation(const Eigen::VectorXd& u, int vectors) const {
    check_pause();
    const int n = space_->size();
    const Constraints& c = problem_.constraints;
    const Eigen::VectorXd x = u.head(n);
    Eigen::MatrixXd hessian = this->hessian(u);
    const Eigen::VectorXd area = forms_.gradient({.area = 1}, x), volume = forms_.gradient({.volume = 1}, x),
                          M = slope_of_M(x);
    hessian += problem_.bending.alpha.value_or(0) * M * M.transpose() -
               problem_.loads.pressure_slope(forms_.observe(x).volume) * volume * volume.transpose();
    Eigen::MatrixXd fixed(n, 0);
    const auto fix = [&](const Eigen::VectorXd& functional) {
        fixed.conservativeResize(n, fixed.cols() + 1);
        fixed.col(fixed.cols() - 1) = functional;
    };
    if (c.area) fix(area);
    if (c.volume) fix(volume);
    if (c.reduced_volume) {
        const ReducedVolumeSlopes slopes = reduced_volume_slopes(*c.reduced_volume, forms_.observe(x).area);
        fix(volume + slopes.by_area * area);
        hessian += u[lambda()] * slopes.by_area_twice * area * area.transpose();
    }
    if (drifts()) fix(place_);
    for (int k = 0; k < rim_.cols(); ++k) fix(rim_.col(k));
    if (bead_forms_) {
        const BeadSurface on = bead_forms_->on(x.data());
        const auto [columns, factors] = bead_forms_->equations().following(on, bead_numbers(u));
        hessian += columns * factors.asDiagonal() * columns.transpose();
        if (problem_.held_distance()) fix(bead_forms_->equations().distance_slope(on, bead_numbers(u)));
    }
    const int constraints = static_cast<int>(fixed.cols()), free = n - constraints;
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(constraints > 0 ? fixed : Eigen::MatrixXd::Zero(n, 1));
    if (constraints > 0) {
        hessian.applyOnTheLeft(qr.householderQ().transpose());
        hessian.applyOnTheRight(qr.householderQ());
    }
    const Eigenpairs eigen = eigenpairs(hessian.bottomRightCorner(free, free), vectors > 0);
    Variation out{eigen.values, {}};
    if (vectors == 0) return out;
    out.vectors = Eigen::MatrixXd::Zero(n, std::min(vectors, free));
    out.vectors.bottomRows(free) = eigen.vectors.leftCols(out.vectors.cols());
    if (constraints > 0) out.vectors.applyOnTheLeft(qr.householderQ());
    return out;
}

namespace {

constexpr int coarsest = 8;  // elements of a whole cell or period

// The topology and the period of another space.
std::shared_ptr<const CurveSpace> space_like(const CurveSpace& other, std::vector<double> breaks, int degree) {
    return std::make_shared<CurveSpace>(other.topology(), std::move(breaks), degree, degree - 1, other.length(),
                                        other.free_period());
}

// These breaks, or more where beads need them, of a curve of this length.
std::vector<double> breaks_for(const StationaryProblem& problem, Topology topology, std::vector<double> breaks,
                               double length) {
    return problem.beads ? refined_at_beads(topology, breaks, problem.beads->width, length) : breaks;
}

// Scales a closed curve to the required area (or volume, if that alone is held).
void scale_to(const CurveForms& forms, const Constraints& c, Eigen::VectorXd& x) {
    if (!forms.space().closed() || !(c.area || c.volume)) return;
    const CurveObservation o = forms.observe(x);
    x *= c.area ? std::sqrt(*c.area / o.area) : std::cbrt(*c.volume / o.volume);
}

// Estimates the error on the last mesh from the energies on a sequence of meshes.
class MeshComparison {
public:
    // Infinite until there are two in a row. The error falls with this power of the number of elements, or less.
    double operator()(double energy, int elements, int power) {
        double error = std::numeric_limits<double>::infinity();
        if (elements_ > 0) {
            const double change = std::abs(energy - energy_), expected = change_ * falls_;
            falls_ = std::pow(static_cast<double>(elements_) / elements, power);
            // Two energies may be close by accident: what is expected by the change before bounds the error, too.
            const double slower = expected > 0 ? std::max(change / expected, 1.0) : unseen;
            error = std::min(falls_ * slower, 1.0) * std::max(change, expected);
            change_ = change;
        }
        energy_ = energy, elements_ = elements;
        return error;
    }
    void restart() { elements_ = 0, change_ = 0; }

private:
    static constexpr double unseen = 2;           // two meshes do not show the order
    double energy_ = 0, change_ = 0, falls_ = 1;  // the change to the last mesh, and by how much the next one is less
    int elements_ = 0;
};

// A mesh for the state on the present one. The jumps that the mesh loss is read from underestimate the error on a
// coarse mesh: where a shape was `found`, take at least half as many elements again.
std::vector<double> next_breaks(const CurveSpace& space, const std::vector<double>& mesh_loss, double allowed,
                                int max_elements, bool found) {
    const int elements = space.splines().elements();
    const std::vector<double> breaks = adapted_breaks(space.splines(), mesh_loss, 0.1 * allowed,
                                                      std::max(coarsest, elements / 4) / space.images(), max_elements);
    const int wanted = std::max(static_cast<int>(breaks.size()) - 1, elements + (found ? (elements + 1) / 2 : 0));
    return regraded(breaks, std::min({wanted, 2 * elements, max_elements}));
}

// From the first shape and the last of a search.
std::string why_none(const Constraints& goal, const CurveObservation& first, const CurveObservation& last,
                     bool descended, int iterations) {
    const double symbol = std::min(first.symbol, last.symbol);
    if (!(symbol > 0))
        return fmt::format(
            "the energy has no minimum there: ever shorter waves lower it (its principal symbol falls "
            "to {:.3g}; see the moduli in [energy])",
            symbol);
    return tubule::why_none(goal, {first.area, first.volume, 0}, {last.area, last.volume, 0}, descended, iterations);
}

double free_energy(const StationaryProblem& problem, const CurveObservation& o, double length) {
    return o.energy + problem.loads.energy(o.area, o.volume, length);
}

// The radius of the narrowest neck of a closed curve; infinite where it has none.
double neck_radius(const CurveSpace& space, const Eigen::VectorXd& x) {
    double narrowest = HUGE_VAL;
    if (space.topology() != Topology::cell) return narrowest;
    constexpr int per_element = 4;
    const std::vector<double>& breaks = space.splines().breaks();
    double before = 0, here = 0;
    for (std::size_t e = 0; e + 1 < breaks.size(); ++e)
        for (int i = 0; i < per_element; ++i) {
            const double r = space.evaluate(x, breaks[e] + (breaks[e + 1] - breaks[e]) * (i + 1) / per_element).r;
            if (here > 0 && here <= before && here < r) narrowest = std::min(narrowest, here);
            before = here, here = r;
        }
    return narrowest;
}

// Counts the axisymmetric directions that lower the energy twice: by the second variation of the curve's coefficients,
// and by that of the energy in normal displacements. A mesh that does not resolve the shape may have a minimum where
// the energy has none; the counts differ then. Directions whose eigenvalue is zero up to the error count as either.
// Half a curve knows the directions that mirror themselves; the others are counted by displacements alone.
struct DirectionCount {
    int by_coefficients = 0, by_displacements = 0;
    bool agrees = true;
};

DirectionCount count_directions(const StationaryProblem& problem, const StationarySystem& system,
                                const Eigen::VectorXd& u, const Equilibrium& shape, double accuracy) {
    const double per_area = std::max(accuracy, 1e-9) * shape.reference_energy / shape.observed.area;
    const auto count = [](const auto& values, double from) {
        return static_cast<int>(std::count_if(values.begin(), values.end(), [&](double v) { return v > from; }));
    };
    const Eigen::VectorXd falls = -system.variation(u).eigenvalues;
    DirectionCount out;
    out.by_coefficients = count(falls, 0.0);
    if (problem.free_period || problem.bending.H0_varies())
        return out;  // displacements keep the period; H0 is constant
    const double neutral = per_area / static_cast<double>(falls.size()), neutral_rate = per_area / shape.observed.area;
    const ModeStability stability(problem, shape);
    const std::vector<double> rates = stability.axisymmetric_rates(true, out.by_coefficients + 2);
    out.by_displacements = count(rates, 0.0);
    out.agrees =
        count(falls, neutral) <= count(rates, -neutral_rate) && count(rates, neutral_rate) <= count(falls, -neutral);
    return out;
}

// Whether the search ends on this mesh, and how; `out` is the state there and what is known of it.
std::optional<std::pair<Stop, std::string>> verdict(const StationaryProblem& problem, const StationarySystem& system,
                                                    const Eigen::VectorXd& u, bool found,
                                                    const EquilibriumSettings& settings, Equilibrium& out) {
    const int elements = out.space->splines().elements();
    if (const double radius = found ? HUGE_VAL : neck_radius(*out.space, out.x);
        radius < closed_neck * std::sqrt(out.observed.area / (4 * pi)))
        return {{Stop::resolution_lost, fmt::format("a neck closes: its radius is {:.2g}", radius)}};
    std::string unknown = std::isfinite(out.estimated_error)
                              ? fmt::format("the error of the energy is still {:.1e}", out.estimated_error)
                              : "the error of the energy is not known yet";
    if (out.observed.coarse > 1)
        unknown = "elements are longer than sqrt(2 kg/|f_HH + 2 f_HK x + f_KK x^2|), too long for waves that grow";
    else if (out.estimated_error <= settings.accuracy) {
        if (const auto where = self_intersection(*out.space, out.x)) {
            const CurveSample p = out.space->evaluate(out.x, (*where)[0]);
            return {{Stop::self_intersection,
                     fmt::format("the stationary shape intersects itself or crosses the axis at r = {:.4g}, z = {:.4g}",
                                 p.r, p.z)}};
        }
        const DirectionCount directions = count_directions(problem, system, u, out, settings.accuracy);
        out.negative_directions = directions.by_coefficients + directions_without_mirror(problem, out);
        if (directions.agrees) return {{Stop::finished, ""}};
        unknown = fmt::format(
            "the stability is undetermined: the energy falls in {} directions by the coefficients of the profile, in "
            "{} by normal displacements",
            directions.by_coefficients, directions.by_displacements);
    }
    if (elements < settings.max_elements) return std::nullopt;
    return {{Stop::resolution_lost, fmt::format("with {} elements, {}", elements, unknown)}};
}

// Newton on meshes that follow the shape found on the one before, until their energies agree.
Equilibrium solve(const StationaryProblem& problem, std::shared_ptr<const CurveSpace> space, Eigen::VectorXd u,
                  double gauge, const EquilibriumSettings& settings) {
    Equilibrium out;
    const auto end = [&](Stop stop, std::string message) {
        out.stop = stop, out.message = std::move(message);
        if (!std::isfinite(out.estimated_error)) out.estimated_error = 1;  // nothing is known
        return out;
    };
    CurveObservation first, last;
    MeshComparison compare;
    bool found = false;
    // Where a neck is narrow, a descent takes thousands of short steps: what one mesh does not find, the next may.
    for (int round = 0; round < 16; ++round) {
        StationarySystem system(space, problem, gauge);
        const int n = space->size(), elements = space->splines().elements();
        out.space = space, out.x = u.head(n), out.gauge = gauge;
        out.length = system.length(u);
        const CurveObservation at = system.forms().observe(out.x);
        out.reference_energy = reference_energy(problem, at.energy, system.forms().reference_energy(out.x),
                                                {at.area, at.volume, out.length});
        if (round == 0) first = last = out.observed = at;
        if (round == 0 && space->closed() && begins_at_sphere(problem.constraints, first.area, first.volume, 1e-6)) {
            out.estimated_error = 1;
            return end(Stop::solver_failed,
                       why_no_sphere("a spheroid or a sphere with waves, or by equilibrium.family"));
        }
        found = settle(system, u, !found, settings.descend, out.iterations);
        const Eigen::VectorXd x = u.head(n);
        if (system.forms().admissible(x)) last = system.forms().observe(x);
        if (!system.forms().admissible(x) || (!found && !settings.descend)) break;
        std::vector<double> mesh_loss;
        out.x = x, out.sigma = u[system.sigma()], out.lambda = u[system.lambda()], out.mu = u[system.mu()];
        out.observed = system.forms().observe(x, &mesh_loss);
        out.length = system.length(u);
        if (problem.beads) out.beads = u.segment<4>(system.beads());
        out.rim = u.tail(condition_count(problem.rings));
        if (!found) compare.restart();
        const int power = std::min(2 * (settings.degree - (problem.bending.kg != 0 ? 2 : 1)), 8);
        const double error = found ? compare(free_energy(problem, out.observed, out.length), elements, power)
                                   : std::numeric_limits<double>::infinity();
        // The spline's loss, and what the shape gives up for the gauge, can be seen on one mesh too.
        const double lost = std::accumulate(mesh_loss.begin(), mesh_loss.end(), 0.0);
        out.estimated_error = std::max({error, lost, 3 * gauge * out.observed.gauge}) / out.reference_energy;
        if (auto ended = verdict(problem, system, u, found, settings, out))
            return end(ended->first, std::move(ended->second));
        const auto finer = space_like(
            *space,
            breaks_for(
                problem, space->topology(),
                next_breaks(*space, mesh_loss, settings.accuracy * out.reference_energy, settings.max_elements, found),
                out.observed.length),
            settings.degree);
        Eigen::VectorXd next(finer->size() + system.numbers());
        next << finer->prolong(*space, x), u.tail(system.numbers());
        space = finer, u = next;
    }
    return end(Stop::solver_failed, why_none(problem.constraints, first, last, settings.descend, out.iterations));
}

}  // namespace

Eigen::VectorXd unknowns(const StationaryProblem& problem, const Equilibrium& shape) {
    Eigen::VectorXd u(shape.x.size() + StationarySystem::numbers(problem));
    u.head(shape.x.size()) = shape.x;
    u.segment<4>(shape.x.size()) << shape.sigma, shape.lambda, shape.mu, 0;
    if (problem.beads) u.segment<4>(shape.x.size() + 4) = shape.beads;
    u.tail(shape.rim.size()) = shape.rim;
    return u;
}

BeadForms bead_forms(const CurveSpace& space, const StationaryProblem& problem) {
    const std::optional<double> foot = problem.rings.empty() ? std::nullopt : std::optional(problem.rings.front().z);
    return {space, problem.beads->width, foot};
}

double axial_force(const StationaryProblem& problem, const Equilibrium& shape) {
    if (shape.space->topology() == Topology::strip) return -shape.rim[condition_of_height(problem.rings)];
    if (problem.beads) return bead_forms(*shape.space, problem).force(shape.x.data(), shape.beads);
    if (problem.free_period || shape.length == 0) return problem.loads.force;
    const CurveForms forms(*shape.space, problem.bending);
    return forms.stretch_slope({.energy = 1, .area = shape.sigma, .volume = shape.lambda, .M = shape.mu}, shape.x) /
           shape.length;
}

int directions_down(const StationarySystem& system, const Eigen::VectorXd& u, const Equilibrium& shape,
                    double accuracy) {
    const StationaryProblem& problem = system.problem();
    const DirectionCount count = count_directions(problem, system, u, shape, accuracy);
    return count.agrees ? count.by_coefficients + directions_without_mirror(problem, shape) : -1;
}

int directions_without_mirror(const StationaryProblem& problem, const Equilibrium& shape) {
    if (shape.space->images() == 1 || problem.free_period || problem.bending.H0_varies()) return 0;
    constexpr int most = 10;
    const double neutral = 1e-9 * shape.reference_energy / (shape.observed.area * shape.observed.area);
    const std::vector<double> rates = ModeStability(problem, shape).axisymmetric_rates(false, most);
    return static_cast<int>(std::count_if(rates.begin(), rates.end(), [&](double rate) { return rate > neutral; }));
}

Equilibrium find_equilibrium(const StationaryProblem& problem, const Curve& start,
                             const EquilibriumSettings& settings) {
    if (start.topology == Topology::tube)
        throw std::invalid_argument(
            "equilibria of a periodic tube need a mirror-symmetric initial shape, given as half a period");
    const int images = start.images(), elements = std::max(settings.elements, coarsest);
    const ArcLength arc(start);
    const auto space = std::make_shared<CurveSpace>(
        start.topology, breaks_for(problem, start.topology, equal_breaks(elements / images), arc.total()),
        settings.degree, settings.degree - 1, start.length, problem.free_period);
    const CurveForms forms(*space, problem.bending);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(space->size() + StationarySystem::numbers(problem)), x = fit(*space, arc);
    scale_to(forms, problem.constraints, x);
    u.head(space->size()) = x;
    u[space->size()] = problem.loads.tension;
    u[space->size() + 1] = -problem.loads.pressure_at(forms.observe(x).volume);
    u[space->size() + 2] = area_difference_force(problem.bending, forms.M(x.data()));
    if (problem.beads)
        u.segment<4>(space->size() + 4) = bead_forms(*space, problem).numbers(x.data(), problem.loads.force);
    return solve(problem, space, u, settings.gauge * forms.reference_energy(x), settings);
}

Equilibrium find_equilibrium(const StationaryProblem& problem, const Equilibrium& nearby,
                             const EquilibriumSettings& settings) {
    // Fewer elements first, as the mesh that confirms the first one has more: a chain of shapes keeps its size.
    const CurveSpace& old = *nearby.space;
    const int elements = std::max(static_cast<int>(0.6 * old.splines().elements()), coarsest / old.images());
    const auto coarser = space_like(
        old, breaks_for(problem, old.topology(), regraded(old.splines().breaks(), elements), nearby.observed.length),
        settings.degree);
    const Eigen::VectorXd before = unknowns(problem, nearby);
    const int numbers = StationarySystem::numbers(problem);
    Eigen::VectorXd u(coarser->size() + numbers);
    u << coarser->prolong(old, nearby.x), before.tail(numbers);
    const Equilibrium found = solve(problem, coarser, u, nearby.gauge, settings);
    if (found.stop != Stop::solver_failed) return found;
    return solve(problem, nearby.space, before, nearby.gauge, settings);
}

}  // namespace tubule::axisym
