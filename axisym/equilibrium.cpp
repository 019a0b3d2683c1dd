#include "axisym/equilibrium.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "axisym/curve_measures.hpp"
#include "axisym/start.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

const double sphere_factor = 6 * std::sqrt(pi);  // reduced volume = sphere_factor V / A^(3/2)

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
    if (c.reduced_volume && (c.area || c.volume))
        throw std::invalid_argument("the reduced volume is held fixed alone: area and volume determine it already");
    const auto positive = [](const std::optional<double>& value, const char* what) {
        if (value && !(*value > 0)) throw std::invalid_argument(fmt::format("{} of {} cannot be met", what, *value));
    };
    positive(c.area, "an area"), positive(c.volume, "a volume"), positive(c.reduced_volume, "a reduced volume");
    if (space_->closed()) {
        std::optional<double> v = c.reduced_volume;
        if (c.area && c.volume) v = reduced_volume(*c.area, *c.volume);
        if (v && *v > 1)
            throw std::invalid_argument(fmt::format("a reduced volume of {:.6g} cannot be met: a sphere has 1", *v));
    }
    problem_ = problem;
    forms_.set_bending(problem.bending);
}

Weights StationarySystem::lagrangian(const Eigen::VectorXd& u) const {
    return {.energy = 1, .area = u[sigma()], .volume = u[P()], .gauge = gauge_};
}

Eigen::VectorXd StationarySystem::residual(const Eigen::VectorXd& u) const {
    const int n = space_->size();
    const Constraints& c = problem_.constraints;
    const Eigen::VectorXd x = u.head(n);
    const CurveObservation o = forms_.observe(x);
    Eigen::VectorXd F = Eigen::VectorXd::Zero(n + 3);
    F.head(n) = u[n + 2] * place_;
    forms_.add_gradient(lagrangian(u), x.data(), F.data());
    if (c.reduced_volume) {
        F[n] = 2 * u[n] * o.area + 3 * u[n + 1] * o.volume;  // no change with size
        F[n + 1] = o.volume - *c.reduced_volume / sphere_factor * std::pow(o.area, 1.5);
    } else {
        F[n] = c.area ? o.area - *c.area : u[n];
        F[n + 1] = c.volume ? o.volume - *c.volume : u[n + 1];
    }
    F[n + 2] = space_->topology() == Topology::cell ? place_.dot(x) : u[n + 2];
    return F;
}

Eigen::SparseMatrix<double> StationarySystem::jacobian(const Eigen::VectorXd& u, double damping) const {
    const int n = space_->size();
    const Constraints& c = problem_.constraints;
    const Eigen::VectorXd x = u.head(n);
    Eigen::SparseMatrix<double> hessian = forms_.hessian(lagrangian(u), x);
    if (damping != 0) hessian += damping * forms_.mass(x);
    const Eigen::VectorXd area = forms_.gradient({.area = 1}, x), volume = forms_.gradient({.volume = 1}, x);
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3, n), corner = Eigen::MatrixXd::Zero(3, 3);
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
    if (space_->topology() == Topology::cell)
        rows.row(2) = place_;
    else
        corner(2, 2) = 1;

    // Columns in order, each with the rows of the Hessian and then all three others, zeros included.
    Eigen::SparseMatrix<double> J(n + 3, n + 3);
    J.reserve(hessian.nonZeros() + 6 * n + 9);
    for (int j = 0; j < n; ++j) {
        J.startVec(j);
        for (Eigen::SparseMatrix<double>::InnerIterator it(hessian, j); it; ++it)
            J.insertBack(it.row(), j) = it.value();
        for (int i = 0; i < 3; ++i) J.insertBack(n + i, j) = rows(i, j);
    }
    for (int j = 0; j < 3; ++j) {
        const Eigen::VectorXd& column = j == 0 ? area : j == 1 ? volume : place_;
        J.startVec(n + j);
        for (int i = 0; i < n; ++i) J.insertBack(i, n + j) = column[i];
        for (int i = 0; i < 3; ++i) J.insertBack(n + i, n + j) = corner(i, j);
    }
    J.finalize();
    return J;
}

double StationarySystem::merit(const Eigen::VectorXd& u) const {
    const Constraints& c = problem_.constraints;
    const CurveObservation o = forms_.observe(u.head(space_->size()));
    double value = o.energy + gauge_ * o.gauge;
    if (c.area) value += u[sigma()] * (o.area - *c.area);
    if (c.volume) value += u[P()] * (o.volume - *c.volume);
    if (c.reduced_volume) value += u[P()] * (o.volume - *c.reduced_volume / sphere_factor * std::pow(o.area, 1.5));
    return value;
}

Variation StationarySystem::variation(const Eigen::VectorXd& u, bool vectors) const {
    const int n = space_->size();
    const Constraints& c = problem_.constraints;
    const Eigen::VectorXd x = u.head(n);
    Eigen::MatrixXd hessian = forms_.hessian(lagrangian(u), x);
    const Eigen::VectorXd area = forms_.gradient({.area = 1}, x), volume = forms_.gradient({.volume = 1}, x);
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
        hessian -= u[P()] * factor * 0.75 / std::sqrt(A) * area * area.transpose();
    }
    if (space_->topology() == Topology::cell) fix(place_);
    const int constraints = static_cast<int>(fixed.cols()), free = n - constraints;
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(constraints > 0 ? fixed : Eigen::MatrixXd::Zero(n, 1));
    if (constraints > 0) {
        hessian.applyOnTheLeft(qr.householderQ().transpose());
        hessian.applyOnTheRight(qr.householderQ());
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
        hessian.bottomRightCorner(free, free), vectors ? Eigen::ComputeEigenvectors : Eigen::EigenvaluesOnly);
    Variation out{eigen.eigenvalues(), {}};
    if (!vectors) return out;
    out.lowest = Eigen::VectorXd::Zero(n);
    out.lowest.tail(free) = eigen.eigenvectors().col(0);
    if (constraints > 0) out.lowest.applyOnTheLeft(qr.householderQ());
    return out;
}

namespace {

// Newton's method on one mesh; `size` is the length that steps are compared with.
class Newton {
public:
    Newton(const StationarySystem& system, Eigen::VectorXd& u, int& iterations)
        : system_(system), u_(u), iterations_(iterations), size_(std::sqrt(system.forms().observe(curve()).area)) {}

    // Plain steps, to rounding. False if they do not converge.
    bool converge() {
        double before = std::numeric_limits<double>::infinity();
        for (int k = 0; k < 25; ++k) {
            lu_.factor(system_.jacobian(u_));
            ++iterations_;
            const Eigen::VectorXd step = -lu_.solve(system_.residual(u_));
            const double length = relative(step);
            if (!(length < 0.5) || !system_.forms().admissible(head(u_ + step))) return false;
            u_ += step;
            if (length < 1e-7 || (length < 1e-5 && length > before / 4)) return true;  // quadratic; or rounding reached
            before = length;
        }
        return false;
    }

    // Damped steps towards a minimum, until they are shorter than `tolerance`. A step solves the equations of the
    // implicit Euler method for the descent, of a duration that grows while the model predicts the energy well. False
    // if no step makes progress any more.
    bool descend(double tolerance) {
        for (int k = 0; k < 200; ++k) {
            Eigen::VectorXd to;
            double predicted = 0;
            ++iterations_;
            const bool sound = attempt(to, predicted);
            const double length = sound ? relative(to - u_) : 0;
            const double gain = sound ? merit_at(curve(), to) - system_.merit(to) : 0;
            const double noise = 1e-13 * scale_;
            if (sound && gain >= 0.1 * predicted - noise) {
                u_ = to;
                if (length < tolerance && damping_ < 1e-3 * damping_start_) return true;
                damping_ = length < tolerance || gain > 0.6 * predicted ? damping_ / 6 : damping_;
            } else {
                damping_ *= 5;
                if (damping_ > 1e12 * damping_start_) return false;
            }
        }
        return false;
    }

    void begin_descent(double scale) {
        scale_ = scale;
        damping_start_ = 10 * scale / std::pow(size_, 4);
        damping_ = damping_start_;
    }

private:
    Eigen::VectorXd head(const Eigen::VectorXd& u) const { return u.head(system_.space().size()); }
    Eigen::VectorXd curve() const { return head(u_); }
    double relative(const Eigen::VectorXd& step) const {
        return step.head(system_.space().size()).lpNorm<Eigen::Infinity>() / size_;
    }
    // The merit of a curve with the multipliers of u.
    double merit_at(const Eigen::VectorXd& x, Eigen::VectorXd u) const {
        u.head(x.size()) = x;
        return system_.merit(u);
    }

    // One damped step, then corrections that bring the constraints back. False if it is not downhill or leads nowhere.
    bool attempt(Eigen::VectorXd& to, double& predicted) {
        const int n = system_.space().size();
        try {
            const Eigen::SparseMatrix<double> J = system_.jacobian(u_, damping_);
            lu_.factor(J);
            Eigen::VectorXd step = -lu_.solve(system_.residual(u_));
            const Eigen::VectorXd dx = step.head(n);
            const double curvature = dx.dot(J.topLeftCorner(n, n) * dx);
            if (!(curvature >= 0) || !(relative(step) < 0.3)) return false;
            predicted = curvature / 2;
            to = u_ + step;
            for (int k = 0; k < 2; ++k) {
                if (!system_.forms().admissible(head(to))) return false;
                Eigen::VectorXd off = system_.residual(to);
                off.head(n).setZero();
                const Eigen::VectorXd back = lu_.solve(off);
                to.head(n) -= back.head(n);
            }
            return system_.forms().admissible(head(to));
        } catch (const SolveError&) {
            return false;
        }
    }

    const StationarySystem& system_;
    Eigen::VectorXd& u_;
    int& iterations_;
    double size_;
    double scale_ = 1, damping_ = 0, damping_start_ = 0;
    SparseLu lu_;
};

}  // namespace

namespace {

constexpr int coarsest = 8;  // elements of a whole cell or period

std::shared_ptr<const CurveSpace> make_space(Topology topology, double length, std::vector<double> breaks, int degree) {
    return std::make_shared<CurveSpace>(topology, std::move(breaks), degree, degree - 1, length);
}

// Scales a closed curve to the area (or the volume, if that alone is held) that is asked for.
void scale_to(const CurveForms& forms, const Constraints& c, Eigen::VectorXd& x) {
    if (!forms.space().closed() || !(c.area || c.volume)) return;
    const CurveObservation o = forms.observe(x);
    x *= c.area ? std::sqrt(*c.area / o.area) : std::cbrt(*c.volume / o.volume);
}

// Descends on one mesh; area and volume go from those of the start to the asked ones in steps.
bool descend(StationarySystem& system, Eigen::VectorXd& u, double scale, int& iterations) {
    const StationaryProblem goal = system.problem();
    const CurveObservation o = system.forms().observe(u.head(system.space().size()));
    const double v = reduced_volume(o.area, o.volume);
    const auto off = [](const std::optional<double>& wanted, double is) {
        return wanted ? std::abs(std::log(*wanted / is)) : 0;
    };
    const double distance = std::max({off(goal.constraints.area, o.area), off(goal.constraints.volume, o.volume),
                                      off(goal.constraints.reduced_volume, v)});
    const int stages = 1 + static_cast<int>(distance / 0.03);
    bool done = false;
    for (int k = 1; k <= stages; ++k) {
        const auto between = [&](const std::optional<double>& wanted, double is) -> std::optional<double> {
            if (!wanted) return wanted;
            return k < stages ? is * std::pow(*wanted / is, static_cast<double>(k) / stages) : *wanted;
        };
        StationaryProblem stage = goal;
        stage.constraints = {between(goal.constraints.area, o.area), between(goal.constraints.volume, o.volume),
                             between(goal.constraints.reduced_volume, v)};
        system.set_problem(stage);
        Newton newton(system, u, iterations);
        newton.begin_descent(scale);
        done = newton.descend(k < stages ? 0.03 : 1e-3);
    }
    return done;
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

// Newton on meshes that follow the shape found on the one before, until two of them, the second with half as many
// elements again, agree in the energy.
Equilibrium solve(const StationaryProblem& problem, std::shared_ptr<const CurveSpace> space, Eigen::VectorXd u,
                  double gauge, const EquilibriumSettings& settings) {
    Equilibrium out;
    const auto fail = [&](Stop stop, std::string message) {
        out.stop = stop, out.message = std::move(message);
        return out;
    };
    std::optional<double> energy_before;
    bool found = false;
    for (int round = 0; round < 16; ++round) {
        StationarySystem system(space, problem, gauge);
        const int n = space->size(), elements = space->splines().elements();
        out.space = space, out.x = u.head(n), out.gauge = gauge;
        out.reference_energy = system.forms().reference_energy(out.x);
        const auto converge = [&] {
            try {
                return Newton(system, u, out.iterations).converge();
            } catch (const SolveError&) {
                return false;
            }
        };
        const bool settled = found || !settings.descend;
        found = settled || descend(system, u, out.reference_energy, out.iterations);
        found = converge() && found;
        // Newton's last steps, or a symmetry of the start, may lead to a saddle: leave it downhill.
        for (int k = 0; k < 3 && found && settings.descend; ++k) {
            const Variation variation = system.variation(u, true);
            if (variation.eigenvalues[0] >= -1e-9 * out.reference_energy) break;
            const double size = std::sqrt(system.forms().observe(u.head(n)).area);
            u.head(n) += 0.01 * size / variation.lowest.lpNorm<Eigen::Infinity>() * variation.lowest;
            found = descend(system, u, out.reference_energy, out.iterations) && converge();
        }
        const Eigen::VectorXd x = u.head(n);
        if (!system.forms().admissible(x) || (!found && !settings.descend) || (!found && round > 4)) break;
        std::vector<double> defect;
        out.x = x, out.sigma = u[n], out.P = u[n + 1];
        out.observed = system.forms().observe(x, &defect);
        double lost = 0;
        for (double d : defect) lost += d;
        if (energy_before) lost = std::max(lost, std::abs(out.observed.energy - *energy_before));
        out.estimated_error = lost / out.reference_energy;
        if (found && energy_before && out.estimated_error <= settings.accuracy) {
            if (const auto where = self_intersection(*space, x))
                return fail(Stop::self_intersection,
                            fmt::format("the stationary shape meets itself at s = {:.4f} and {:.4f}", (*where)[0],
                                        (*where)[1]));
            out.stop = Stop::finished;
            return out;
        }
        if (elements >= settings.max_elements)
            return fail(Stop::resolution_lost, fmt::format("{} elements leave an error of {:.1e} of the energy",
                                                           elements, out.estimated_error));
        // The jumps that the defect is read from tell less than there is to lose on a coarse mesh: never fewer
        // elements than before, and half as many again to compare with.
        const double target = 0.1 * settings.accuracy * out.reference_energy;
        std::vector<double> breaks =
            adapted_breaks(space->splines(), defect, target, std::max(coarsest / space->images(), elements));
        const int wanted = std::max(static_cast<int>(breaks.size()) - 1, elements + (elements + 1) / 2);
        breaks = regraded(breaks, std::min({wanted, 2 * elements, settings.max_elements}));
        energy_before = std::nullopt;
        if (found) energy_before = out.observed.energy;
        const auto finer = make_space(space->topology(), space->length(), breaks, settings.degree);
        Eigen::VectorXd next(finer->size() + 3);
        next << finer->prolong(*space, x), u.tail(3);
        space = finer, u = next;
    }
    return fail(Stop::solver_failed,
                fmt::format("Newton's method does not converge ({} iterations); try another start", out.iterations));
}

}  // namespace

Eigen::VectorXd unknowns(const Equilibrium& shape) {
    Eigen::VectorXd u(shape.x.size() + 3);
    u << shape.x, shape.sigma, shape.P, 0;
    return u;
}

int negative_directions(const StationaryProblem& problem, const Equilibrium& shape) {
    const StationarySystem system(shape.space, problem, shape.gauge);
    return static_cast<int>((system.variation(unknowns(shape)).eigenvalues.array() < 0).count());
}

Equilibrium find_equilibrium(const StationaryProblem& problem, const Meridian& start,
                             const EquilibriumSettings& settings) {
    if (start.topology == Topology::tube)
        throw std::invalid_argument("equilibria of a period need a start that mirrors itself, and half of it");
    const int images = start.topology == Topology::cell ? 1 : 2;
    const auto space = make_space(start.topology, start.length,
                                  equal_breaks(std::max(settings.elements, coarsest) / images), settings.degree);
    const CurveForms forms(*space, problem.bending);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(space->size() + 3), x = fit(*space, start);
    scale_to(forms, problem.constraints, x);
    u.head(space->size()) = x;
    return solve(problem, space, u, settings.gauge * forms.reference_energy(x), settings);
}

Equilibrium find_equilibrium(const StationaryProblem& problem, const Equilibrium& nearby,
                             const EquilibriumSettings& settings) {
    // Fewer elements first, as the mesh that confirms the first one has more: a chain of shapes keeps its size.
    const CurveSpace& old = *nearby.space;
    const int elements = std::max(static_cast<int>(0.6 * old.splines().elements()), coarsest / old.images());
    const auto coarser =
        make_space(old.topology(), old.length(), regraded(old.splines().breaks(), elements), settings.degree);
    Eigen::VectorXd u(coarser->size() + 3);
    u << coarser->prolong(old, nearby.x), nearby.sigma, nearby.P, 0;
    const Equilibrium found = solve(problem, coarser, u, nearby.gauge, settings);
    if (found.stop != Stop::solver_failed) return found;
    return solve(problem, nearby.space, unknowns(nearby), nearby.gauge, settings);
}

}  // namespace tubule::axisym
