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
#include "common/geometry/profile_point.hpp"
#include "common/solve/dense.hpp"
#include "common/solve/pause.hpp"

namespace tubule::axisym {
namespace {

// Radius of a neck, over that of the sphere of the same area, below which no search goes on.
constexpr double closed_neck = 0.003;
constexpr double rounding = 1e-9;  // of the reduced volume of a sphere to begin with

const double sphere_factor = 6 * std::sqrt(pi);  // reduced volume = sphere_factor V / A^(3/2)

// In space that is periodic along an axis, balls and cylinders enclose most (Pedrosa and Ritore, Indiana Univ. Math. J.
// 48, 1999).
double largest_volume(double area, double period) {
    return std::max(std::pow(area, 1.5) / sphere_factor, area * area / (4 * pi * period));
}

}  // namespace

double reduced_volume(double area, double volume) {
    return sphere_factor * volume / std::pow(area, 1.5);
}

StationarySystem::StationarySystem(std::shared_ptr<const CurveSpace> space, const StationaryProblem& problem,
                                   double gauge)
    : space_(std::move(space)), forms_(*space_, problem.bending), gauge_(gauge) {
    set_problem(problem);
    place_ = Eigen::VectorXd::Zero(space_->size());
    if (space_->topology() == Topology::cell) place_.tail(space_->z().size()) = space_->z().mean();
}

void StationarySystem::set_problem(const StationaryProblem& problem) {
    const Constraints& c = problem.constraints;
    if (problem.free_period != space_->free_period() || (!problem.free_period && problem.loads.force != 0))
        throw std::invalid_argument("a force needs a free period, and a space with one");
    if (problem.free_period && !c.area && !c.volume)
        throw std::invalid_argument("a free period needs a given area or a given volume");
    if ((c.area && problem.loads.tension != 0) || (c.volume && problem.loads.pressure != 0) ||
        (c.reduced_volume && (problem.loads.tension != 0 || problem.loads.pressure != 0)))
        throw std::invalid_argument("a tension needs a free area, a pressure a free volume");
    if (c.reduced_volume && (c.area || c.volume))
        throw std::invalid_argument("the reduced volume cannot be combined with area and volume, which determine it");
    const auto positive = [](const std::optional<double>& value, const char* what) {
        if (value && !(*value > 0))
            throw std::invalid_argument(fmt::format("{} of {} is impossible: it must be positive", what, *value));
    };
    positive(c.area, "an area"), positive(c.volume, "a volume"), positive(c.reduced_volume, "a reduced volume");
    if (space_->closed()) {
        std::optional<double> v = c.reduced_volume;
        if (c.area && c.volume) v = reduced_volume(*c.area, *c.volume);
        if (v && *v > 1 + rounding)
            throw std::invalid_argument(
                fmt::format("a reduced volume of {:.6g} is impossible: the largest is 1, that of a sphere", *v));
    } else if (c.area && c.volume && !problem.free_period) {
        const double most = largest_volume(*c.area, space_->length());
        if (*c.volume > most)
            throw std::invalid_argument(
                fmt::format("a volume of {:.6g} a period is impossible: an area of {:.6g} encloses at most {:.6g}",
                            *c.volume, *c.area, most));
    }
    problem_ = problem;
    forms_.set_bending(problem.bending);
}

Weights StationarySystem::lagrangian(const Eigen::VectorXd& u) const {
    return {.energy = 1,
            .area = u[sigma()],
            .volume = u[lambda()],
            .gauge = gauge_,
            .M = problem_.bending.alpha ? u[mu()] : 0};
}

Eigen::VectorXd StationarySystem::residual(const Eigen::VectorXd& u) const {
    const int n = space_->size();
    const Constraints& c = problem_.constraints;
    const Eigen::VectorXd x = u.head(n);
    const CurveObservation o = forms_.observe(x);
    Eigen::VectorXd F = Eigen::VectorXd::Zero(size());
    F.head(n) = u[n + 3] * place_;
    forms_.add_gradient(lagrangian(u), x.data(), F.data());
    if (problem_.free_period) F[n - 1] -= problem_.loads.force * space_->images();
    if (c.reduced_volume) {
        F[n] = 2 * u[n] * o.area + 3 * u[n + 1] * o.volume;  // no change with size
        F[n + 1] = o.volume - *c.reduced_volume / sphere_factor * std::pow(o.area, 1.5);
    } else {
        F[n] = c.area ? o.area - *c.area : u[n] - problem_.loads.tension;
        F[n + 1] = c.volume ? o.volume - *c.volume : u[n + 1] + problem_.loads.pressure;
    }
    F[n + 2] = u[n + 2] - area_difference_force(problem_.bending, o.M);
    F[n + 3] = space_->topology() == Topology::cell ? place_.dot(x) : u[n + 3];
    return F;
}

Eigen::SparseMatrix<double> StationarySystem::jacobian(const Eigen::VectorXd& u, double damping) const {
    const int n = space_->size();
    const Constraints& c = problem_.constraints;
    const Eigen::VectorXd x = u.head(n);
    Eigen::SparseMatrix<double> hessian = forms_.hessian(lagrangian(u), x);
    if (damping != 0) hessian += damping * forms_.mass(x);
    const Eigen::VectorXd columns[]{forms_.gradient({.area = 1}, x), forms_.gradient({.volume = 1}, x), slope_of_M(x),
                                    place_};
    const auto& [area, volume, M, place] = columns;
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(numbers, n), corner = Eigen::MatrixXd::Zero(numbers, numbers);
    if (c.reduced_volume) {
        const CurveObservation o = forms_.observe(x);
        rows.row(0) = 2 * u[n] * area + 3 * u[n + 1] * volume;
        rows.row(1) = volume - *c.reduced_volume / sphere_factor * 1.5 * std::sqrt(o.area) * area;
        corner(0, 0) = 2 * o.area, corner(0, 1) = 3 * o.volume;
    } else {
        if (c.area) rows.row(0) = area;
        if (c.volume) rows.row(1) = volume;
        corner(0, 0) = c.area ? 0 : 1, corner(1, 1) = c.volume ? 0 : 1;
    }
    rows.row(2) = -problem_.bending.alpha.value_or(0) * M, corner(2, 2) = 1;
    if (space_->topology() == Topology::cell)
        rows.row(3) = place;
    else
        corner(3, 3) = 1;

    // Columns in order, each with the rows of the Hessian and then all others, zeros included.
    Eigen::SparseMatrix<double> J(size(), size());
    J.reserve(hessian.nonZeros() + 2 * numbers * n + numbers * numbers);
    for (int j = 0; j < n; ++j) {
        J.startVec(j);
        for (Eigen::SparseMatrix<double>::InnerIterator it(hessian, j); it; ++it)
            J.insertBack(it.row(), j) = it.value();
        for (int i = 0; i < numbers; ++i) J.insertBack(n + i, j) = rows(i, j);
    }
    for (int j = 0; j < numbers; ++j) {
        J.startVec(n + j);
        for (int i = 0; i < n; ++i) J.insertBack(i, n + j) = columns[j][i];
        for (int i = 0; i < numbers; ++i) J.insertBack(n + i, n + j) = corner(i, j);
    }
    J.finalize();
    return J;
}

// Zero where nothing depends on it.
Eigen::VectorXd StationarySystem::slope_of_M(const Eigen::VectorXd& x) const {
    return problem_.bending.alpha ? forms_.gradient({.M = 1}, x) : Eigen::VectorXd::Zero(x.size());
}

double StationarySystem::merit(const Eigen::VectorXd& u) const {
    const Constraints& c = problem_.constraints;
    const CurveObservation o = forms_.observe(u.head(space_->size()));
    double value = o.energy + problem_.loads.energy(o.area, o.volume, length(u)) + gauge_ * o.gauge;
    if (c.area) value += u[sigma()] * (o.area - *c.area);
    if (c.volume) value += u[lambda()] * (o.volume - *c.volume);
    if (c.reduced_volume) value += u[lambda()] * (o.volume - *c.reduced_volume / sphere_factor * std::pow(o.area, 1.5));
    return value;
}

Variation StationarySystem::variation(const Eigen::VectorXd& u, bool vectors) const {
    check_pause();
    const int n = space_->size();
    const Constraints& c = problem_.constraints;
    const Eigen::VectorXd x = u.head(n);
    Eigen::MatrixXd hessian = forms_.hessian(lagrangian(u), x);
    const Eigen::VectorXd area = forms_.gradient({.area = 1}, x), volume = forms_.gradient({.volume = 1}, x),
                          M = slope_of_M(x);
    hessian += problem_.bending.alpha.value_or(0) * M * M.transpose();
    Eigen::MatrixXd fixed(n, 0);
    const auto fix = [&](const Eigen::VectorXd& functional) {
        fixed.conservativeResize(n, fixed.cols() + 1);
        fixed.col(fixed.cols() - 1) = functional;
    };
    if (c.area) fix(area);
    if (c.volume) fix(volume);
    if (c.reduced_volume) {
        const double A = forms_.observe(x).area, factor = *c.reduced_volume / sphere_factor;
        fix(volume - factor * 1.5 * std::sqrt(A) * area);
        hessian -= u[lambda()] * factor * 0.75 / std::sqrt(A) * area * area.transpose();
    }
    if (space_->topology() == Topology::cell) fix(place_);
    const int constraints = static_cast<int>(fixed.cols()), free = n - constraints;
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(constraints > 0 ? fixed : Eigen::MatrixXd::Zero(n, 1));
    if (constraints > 0) {
        hessian.applyOnTheLeft(qr.householderQ().transpose());
        hessian.applyOnTheRight(qr.householderQ());
    }
    const Eigenpairs eigen = eigenpairs(hessian.bottomRightCorner(free, free), vectors);
    Variation out{eigen.values, {}};
    if (!vectors) return out;
    out.lowest = Eigen::VectorXd::Zero(n);
    out.lowest.tail(free) = eigen.vectors.col(0);
    if (constraints > 0) out.lowest.applyOnTheLeft(qr.householderQ());
    return out;
}

namespace {

// Newton's method on one mesh; `size` is the length that steps are compared with.
class Newton {
public:
    Newton(const StationarySystem& system, Eigen::VectorXd& u, int& iterations)
        : system_(system),
          u_(u),
          iterations_(iterations),
          size_(std::sqrt(system.forms().observe(curve()).area)),
          scale_(system.forms().reference_energy(curve())),
          damping_start_(10 * scale_ / std::pow(size_, 4)),
          damping_(damping_start_) {}

    // Plain steps, to rounding. False, and u as it was, if they do not converge or one is longer than `longest`.
    bool converge(double longest) {
        const Eigen::VectorXd start = u_;
        try {
            if (plain_steps(longest)) return true;
        } catch (const SolveError&) {
        }
        u_ = start;
        return false;
    }

    // Damped steps towards a minimum, until they are shorter than `tolerance`. A step solves the equations of the
    // implicit Euler method for the descent, of a duration that grows while the model predicts the energy well. Far
    // from the required area and volume, a step brings them nearer, and the energy may increase. False if no
    // step makes further progress.
    bool descend(double tolerance, int most = 200) {
        for (int k = 0; k < most; ++k) {
            ++iterations_;
            const Attempt step = attempt();
            const double gain = step.sound ? merit_at(curve(), step.to) - system_.merit(step.to) : 0;
            const double noise = 1e-13 * scale_;
            if (!step.sound || (step.feasible && gain < 0.1 * step.predicted - noise)) {
                damping_ *= 5;
                if (damping_ > 1e12 * damping_start_) return false;
                continue;
            }
            const double length = relative(step.to - u_);
            u_ = step.to;
            if (!step.feasible) continue;
            if (length < tolerance && damping_ < 1e-3 * damping_start_) return true;
            if (length < tolerance || gain > 0.6 * step.predicted) damping_ /= 6;
        }
        return false;
    }

private:
    bool plain_steps(double longest) {
        double before = std::numeric_limits<double>::infinity();
        for (int k = 0; k < 25; ++k) {
            lu_.factor(system_.jacobian(u_));
            ++iterations_;
            const Eigen::VectorXd step = -lu_.solve(system_.residual(u_));
            const double length = relative(step);
            if (!(length < longest) || !system_.forms().admissible(head(u_ + step))) return false;
            u_ += step;
            if (length < 1e-7 || (length < 1e-5 && length > before / 4)) return true;  // quadratic; or rounding reached
            before = length;
        }
        return false;
    }

    Eigen::VectorXd head(const Eigen::VectorXd& u) const { return u.head(system_.space().size()); }
    Eigen::VectorXd curve() const { return head(u_); }
    double relative(const Eigen::VectorXd& step) const {
        return step.head(system_.space().size()).lpNorm<Eigen::Infinity>() / size_;
    }
    // Deviation of area and volume from the required values, in units of the size; 0 for what is not held.
    double constraint_error(const Eigen::VectorXd& F) const {
        const Constraints& c = system_.problem().constraints;
        const double area = c.area ? std::abs(F[system_.sigma()]) / (size_ * size_) : 0;
        const double volume =
            c.volume || c.reduced_volume ? std::abs(F[system_.lambda()]) / (size_ * size_ * size_) : 0;
        return std::max(area, volume);
    }
    // The merit of a curve with the multipliers of u.
    double merit_at(const Eigen::VectorXd& x, Eigen::VectorXd u) const {
        u.head(x.size()) = x;
        return system_.merit(u);
    }

    struct Attempt {
        bool sound = false;     // downhill, not too far, and to a curve
        bool feasible = false;  // area and volume are as asked, or nearly
        double predicted = 0;   // gain of the merit
        Eigen::VectorXd to;
    };

    // One damped step, then corrections that bring area and volume to what they were meant to be.
    Attempt attempt() {
        constexpr double farthest = 0.05;  // for the sake of area and volume
        const int n = system_.space().size();
        Attempt out;
        system_.set_mu(u_);
        try {
            const Eigen::SparseMatrix<double> J = system_.jacobian(u_, damping_);
            lu_.factor(J);
            const Eigen::VectorXd F = system_.residual(u_);
            Eigen::VectorXd force = F, off = F;
            force.tail(system_.numbers).setZero(), off.head(n).setZero();
            const Eigen::VectorXd down = -lu_.solve(force), back = -lu_.solve(off);
            const double off_before = constraint_error(F), part = std::min(1.0, farthest / relative(back));
            const Eigen::VectorXd step = down + part * back, dx = step.head(n);
            Eigen::VectorXd within = Eigen::VectorXd::Zero(u_.size());
            within.head(n) = dx, within[system_.mu()] = step[system_.mu()];
            const double curvature = dx.dot((J * within).head(n));
            if (!(curvature >= 0) || !(relative(step) < 0.3)) return out;
            out.predicted = curvature / 2;
            out.to = u_ + step;
            for (int k = 0; k < 2; ++k) {
                if (!system_.forms().admissible(head(out.to))) return out;
                system_.set_mu(out.to);
                Eigen::VectorXd still = system_.residual(out.to) - (1 - part) * off;
                still.head(n).setZero();
                out.to.head(n) -= lu_.solve(still).head(n);
            }
            const double off_after = constraint_error(system_.residual(out.to));
            out.feasible = off_before < 1e-3 && part == 1;
            out.sound = system_.forms().admissible(head(out.to)) &&
                        off_after <= (out.feasible ? 1e-3 : (1 - part / 2) * off_before);
        } catch (const SolveError&) {
        }
        return out;
    }

    const StationarySystem& system_;
    Eigen::VectorXd& u_;
    int& iterations_;
    double size_;
    double scale_, damping_start_, damping_;
    SparseLu lu_;
};

constexpr int coarsest = 8;  // elements of a whole cell or period

// The topology and the period of another space.
std::shared_ptr<const CurveSpace> space_like(const CurveSpace& other, std::vector<double> breaks, int degree) {
    return std::make_shared<CurveSpace>(other.topology(), std::move(breaks), degree, degree - 1, other.length(),
                                        other.free_period());
}

// Scales a closed curve to the required area (or volume, if that alone is held).
void scale_to(const CurveForms& forms, const Constraints& c, Eigen::VectorXd& x) {
    if (!forms.space().closed() || !(c.area || c.volume)) return;
    const CurveObservation o = forms.observe(x);
    x *= c.area ? std::sqrt(*c.area / o.area) : std::cbrt(*c.volume / o.volume);
}

}  // namespace

std::vector<double> regraded(const std::vector<double>& breaks, int elements) {
    const int n = static_cast<int>(breaks.size()) - 1;
    std::vector<double> out(elements + 1);
    for (int i = 0; i <= elements; ++i) {
        const double at = static_cast<double>(i) * n / elements;
        const int e = std::min(static_cast<int>(at), n - 1);
        out[i] = breaks[e] + (at - e) * (breaks[e + 1] - breaks[e]);
    }
    out.back() = 1;
    return out;
}

namespace {

// Descends on one mesh; area and volume change from the initial to the required ones in steps.
bool descend(StationarySystem& system, Eigen::VectorXd& u, double tolerance, int& iterations) {
    const StationaryProblem goal = system.problem();
    const CurveObservation o = system.forms().observe(u.head(system.space().size()));
    if (!(o.area > 0 && o.volume > 0)) return false;  // turned inside out by an earlier attempt
    const double v = reduced_volume(o.area, o.volume);
    const auto off = [](const std::optional<double>& wanted, double is) {
        return wanted ? std::abs(std::log(*wanted / is)) : 0;
    };
    const double distance = std::max({off(goal.constraints.area, o.area), off(goal.constraints.volume, o.volume),
                                      off(goal.constraints.reduced_volume, v)});
    const int stages = 1 + static_cast<int>(distance / 0.03);
    for (int k = 1; k < stages; ++k) {
        const auto between = [&](const std::optional<double>& wanted, double is) -> std::optional<double> {
            if (!wanted) return wanted;
            return is * std::pow(*wanted / is, static_cast<double>(k) / stages);
        };
        StationaryProblem stage = goal;
        stage.constraints = {between(goal.constraints.area, o.area), between(goal.constraints.volume, o.volume),
                             between(goal.constraints.reduced_volume, v)};
        system.set_problem(stage);
        Newton(system, u, iterations).descend(std::max(0.03, tolerance), 30);
    }
    system.set_problem(goal);
    return Newton(system, u, iterations).descend(tolerance);
}

// The stationary shape on one mesh; with `from_afar`, and wherever plain Newton steps fail, after a descent. False, and
// u an intermediate state, if none is found.
bool settle(StationarySystem& system, Eigen::VectorXd& u, bool from_afar, const EquilibriumSettings& settings,
            Equilibrium& out) {
    const int n = system.space().size();
    if (!settings.descend) return Newton(system, u, out.iterations).converge(0.5);
    bool found = !from_afar && Newton(system, u, out.iterations).converge(0.1);
    for (double tolerance = 1e-3; !found && tolerance > 1e-6; tolerance *= 0.03)
        found = descend(system, u, tolerance, out.iterations) && Newton(system, u, out.iterations).converge(0.1);
    // Newton's last steps, or a symmetry of the initial shape, may lead to a saddle: leave it downhill.
    for (int k = 0; k < 3 && found; ++k) {
        const Variation variation = system.variation(u, true);
        if (variation.eigenvalues[0] >= -1e-9 * out.reference_energy) break;
        const double size = std::sqrt(system.forms().observe(u.head(n)).area);
        u.head(n) += 0.01 * size / variation.lowest.lpNorm<Eigen::Infinity>() * variation.lowest;
        found = descend(system, u, 1e-3, out.iterations) && Newton(system, u, out.iterations).converge(0.1);
    }
    return found;
}

// Estimates the error on the last mesh but one from the energies on a sequence of meshes.
class MeshComparison {
public:
    // Infinite until there are two in a row.
    double operator()(double energy, int elements, int degree) {
        double error = std::numeric_limits<double>::infinity();
        if (elements_ > 0) {
            const double change = std::abs(energy - energy_);
            // Two energies may be close by accident. The previous change, reduced by the order of convergence (at most
            // 8), bounds the error, too.
            const int order = std::min(2 * (degree - 1), 8);
            error = std::max(change, change_ * std::pow(static_cast<double>(elements_) / elements, order));
            change_ = change;
        }
        energy_ = energy, elements_ = elements;
        return error;
    }
    void restart() { elements_ = 0, change_ = 0; }

private:
    double energy_ = 0, change_ = 0;
    int elements_ = 0;
};

// A mesh for the state on the present one. The jumps that the defect is read from underestimate the error on a coarse
// mesh: where a shape was `found`, take at least half as many elements again.
std::vector<double> next_breaks(const CurveSpace& space, const std::vector<double>& defect, double allowed,
                                int max_elements, bool found) {
    const int elements = space.splines().elements();
    const std::vector<double> breaks = adapted_breaks(space.splines(), defect, 0.1 * allowed,
                                                      std::max(coarsest, elements / 4) / space.images(), max_elements);
    const int wanted = std::max(static_cast<int>(breaks.size()) - 1, elements + (found ? (elements + 1) / 2 : 0));
    return regraded(breaks, std::min({wanted, 2 * elements, max_elements}));
}

// Why no shape was found, from the first one and the last.
std::string why_none(const Constraints& goal, const CurveObservation& first, const CurveObservation& last,
                     int iterations) {
    const double symbol = std::min(first.symbol, last.symbol);
    if (!(symbol > 0))
        return fmt::format(
            "the energy has no minimum there: ever shorter waves lower it (its principal symbol falls "
            "to {:.3g}; see the moduli in [energy])",
            symbol);
    std::string missed;
    const auto compare = [&](const char* what, const std::optional<double>& wanted, double from, double to) {
        if (wanted && !(std::abs(std::log(to / *wanted)) < 0.01) && missed.empty())
            missed = fmt::format(
                "no shape with {} {:.6g} was found: the start has {:.6g}, and the descent from there "
                "came to {:.6g}",
                what, *wanted, from, to);
    };
    compare("area", goal.area, first.area, last.area);
    compare("volume", goal.volume, first.volume, last.volume);
    compare("reduced volume", goal.reduced_volume, reduced_volume(first.area, first.volume),
            reduced_volume(last.area, last.volume));
    return missed.empty() ? fmt::format("Newton's method does not converge ({} iterations)", iterations) : missed;
}

double free_energy(const StationaryProblem& problem, const CurveObservation& o, double length) {
    return o.energy + problem.loads.energy(o.area, o.volume, length);
}

// E_ref, theory.md (11.1).
double reference_energy_of(const StationaryProblem& problem, const CurveForms& forms, const Eigen::VectorXd& x) {
    const CurveObservation o = forms.observe(x);
    const Loads& loads = problem.loads;
    const double length = forms.space().length(x.data());
    return std::max(std::abs(free_energy(problem, o, length)),
                    forms.reference_energy(x) + std::abs(loads.tension) * o.area + std::abs(loads.pressure * o.volume) +
                        std::abs(loads.force) * length);
}

// Whether the search is to lead from a sphere to a smaller reduced volume: there area and volume have one gradient.
bool begins_at_sphere(const Constraints& goal, const CurveObservation& start) {
    constexpr double near = 1e-6;  // of a spline
    if (!goal.reduced_volume && !(goal.area && goal.volume)) return false;
    const double wanted = goal.reduced_volume ? *goal.reduced_volume : reduced_volume(*goal.area, *goal.volume);
    return reduced_volume(start.area, start.volume) > 1 - near && wanted < 1 - near;
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
    if (out.estimated_error <= settings.accuracy) {
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
    for (int round = 0; round < 16; ++round) {
        StationarySystem system(space, problem, gauge);
        const int n = space->size(), elements = space->splines().elements();
        out.space = space, out.x = u.head(n), out.gauge = gauge;
        if (round == 0) first = last = out.observed = system.forms().observe(out.x);
        out.reference_energy = reference_energy_of(problem, system.forms(), out.x);
        if (round == 0 && space->closed() && begins_at_sphere(problem.constraints, first)) {
            out.estimated_error = 1;
            return end(
                Stop::solver_failed,
                "a sphere leads to no other area and volume, since all directions are alike: start at a spheroid "
                "or a sphere with waves, or by equilibrium.family");
        }
        found = settle(system, u, !found, settings, out);
        const Eigen::VectorXd x = u.head(n);
        if (system.forms().admissible(x)) last = system.forms().observe(x);
        if (!system.forms().admissible(x) || (!found && !settings.descend) || (!found && round > 7)) break;
        std::vector<double> defect;
        out.x = x, out.sigma = u[system.sigma()], out.lambda = u[system.lambda()], out.mu = u[system.mu()];
        out.observed = system.forms().observe(x, &defect);
        out.length = space->length(x.data());
        if (!found) compare.restart();
        const double error = found ? compare(free_energy(problem, out.observed, out.length), elements, settings.degree)
                                   : std::numeric_limits<double>::infinity();
        // The spline's loss, and what the shape gives up for the gauge, can be seen on one mesh too.
        const double lost = std::accumulate(defect.begin(), defect.end(), 0.0);
        out.estimated_error = std::max({error, lost, 3 * gauge * out.observed.gauge}) / out.reference_energy;
        if (auto ended = verdict(problem, system, u, found, settings, out))
            return end(ended->first, std::move(ended->second));
        const auto finer = space_like(
            *space, next_breaks(*space, defect, settings.accuracy * out.reference_energy, settings.max_elements, found),
            settings.degree);
        Eigen::VectorXd next(finer->size() + system.numbers);
        next << finer->prolong(*space, x), u.tail(system.numbers);
        space = finer, u = next;
    }
    return end(Stop::solver_failed, why_none(problem.constraints, first, last, out.iterations));
}

}  // namespace

Eigen::VectorXd unknowns(const Equilibrium& shape) {
    Eigen::VectorXd u(shape.x.size() + StationarySystem::numbers);
    u << shape.x, shape.sigma, shape.lambda, shape.mu, 0;
    return u;
}

double axial_force(const StationaryProblem& problem, const Equilibrium& shape) {
    if (problem.free_period || shape.length == 0) return problem.loads.force;
    const CurveForms forms(*shape.space, problem.bending);
    return forms.stretch_slope({.energy = 1, .area = shape.sigma, .volume = shape.lambda, .M = shape.mu}, shape.x) /
           shape.length;
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
            "equilibria of a periodic tube need a mirror-symmetric start, given as half a period");
    const int images = start.topology == Topology::cell ? 1 : 2;
    const auto space =
        std::make_shared<CurveSpace>(start.topology, equal_breaks(std::max(settings.elements, coarsest) / images),
                                     settings.degree, settings.degree - 1, start.length, problem.free_period);
    const CurveForms forms(*space, problem.bending);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(space->size() + StationarySystem::numbers), x = fit(*space, start);
    scale_to(forms, problem.constraints, x);
    u.head(space->size()) = x;
    u[space->size()] = problem.loads.tension, u[space->size() + 1] = -problem.loads.pressure;
    u[space->size() + 2] = area_difference_force(problem.bending, forms.M(x.data()));
    return solve(problem, space, u, settings.gauge * forms.reference_energy(x), settings);
}

Equilibrium find_equilibrium(const StationaryProblem& problem, const Equilibrium& nearby,
                             const EquilibriumSettings& settings) {
    // Fewer elements first, as the mesh that confirms the first one has more: a chain of shapes keeps its size.
    const CurveSpace& old = *nearby.space;
    const int elements = std::max(static_cast<int>(0.6 * old.splines().elements()), coarsest / old.images());
    const auto coarser = space_like(old, regraded(old.splines().breaks(), elements), settings.degree);
    Eigen::VectorXd u(coarser->size() + StationarySystem::numbers);
    u << coarser->prolong(old, nearby.x), unknowns(nearby).tail(StationarySystem::numbers);
    const Equilibrium found = solve(problem, coarser, u, nearby.gauge, settings);
    if (found.stop != Stop::solver_failed) return found;
    return solve(problem, nearby.space, unknowns(nearby), nearby.gauge, settings);
}

}  // namespace tubule::axisym
