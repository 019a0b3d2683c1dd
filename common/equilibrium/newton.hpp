// Newton's method and the descent to stationary shapes, on one mesh, for the unknowns of either tier.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/equilibrium/stationary_problem.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse.hpp"

namespace tubule {

// The equations F(u) = 0 of a stationary shape on one mesh: u holds shape_size() coefficients of the shape, then sigma,
// lambda, and what else a system has. The system must outlive the method and offer
//   residual(u), jacobian(u, damping)   F; dF/du with damping times the mass matrix added to the shape's Hessian
//   constraint_residual(u)              F with zeros for the shape
//   merit(u), constraint_error(u)       the Lagrangian; how far area and volume are from what is held, relative
//   extents(u), size(u)                 area, volume and L of the shape; the length that steps are compared with
//   reference_energy(u), admissible(u)  the scale of the merit; whether u is a shape at all
//   set_followers(u)                    makes numbers that follow from the shape those of it, as mu = alpha (M - M0)
//   follow(change, out)                 sets them in `out` to those of a change of u
//   rebase(u)                           may choose other coefficients for the same shape; whether u has another size
//   way_down(u)                         a change of u along which a stationary shape loses energy; empty if none does
//   factors()                           a solver for its Jacobian
//   problem(), set_problem(problem)
template <class System>
class Newton {
public:
    Newton(System& system, Eigen::VectorXd& u, int& iterations)
        : system_(system),
          u_(u),
          iterations_(iterations),
          size_(system.size(u)),
          scale_(system.reference_energy(u)),
          damping_start_(10 * scale_ / std::pow(size_, 4)),
          damping_(damping_start_),
          lu_(system.factors()) {}

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
            const double gain = step.sound ? merit_at(shape(u_), step.to) - system_.merit(step.to) : 0;
            const double noise = 1e-13 * scale_;
            if (!step.sound || (step.feasible && gain < 0.1 * step.predicted - noise)) {
                damping_ *= 5;
                if (damping_ <= 1e12 * damping_start_) continue;
                if (step.feasible || farthest_ < least) return false;
                farthest_ /= 4, damping_ = damping_start_;
                continue;
            }
            const double length = relative(step.to - u_);
            u_ = step.to;
            if (system_.rebase(u_)) lu_ = system_.factors();
            farthest_ = std::min(2 * farthest_, farthest);
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
            lu_.factor(system_.jacobian(u_, 0));
            ++iterations_;
            const Eigen::VectorXd step = -lu_.solve(system_.residual(u_));
            const double length = relative(step);
            if (!(length < longest) || !system_.admissible(u_ + step)) return false;
            u_ += step;
            if (length < 1e-7 || (length < 1e-5 && length > before / 4)) return true;  // quadratic; or rounding reached
            before = length;
        }
        return false;
    }

    // Steps for the sake of area and volume; where no damping makes these sound, as beside a sphere, shorter ones.
    static constexpr double farthest = 0.05, least = 1e-3;

    auto shape(const Eigen::VectorXd& u) const { return u.head(system_.shape_size()); }
    double relative(const Eigen::VectorXd& step) const {
        return shape(step).template lpNorm<Eigen::Infinity>() / size_;
    }
    // The merit of a shape with the multipliers of u.
    double merit_at(const Eigen::VectorXd& x, Eigen::VectorXd u) const {
        u.head(x.size()) = x;
        return system_.merit(u);
    }

    struct Attempt {
        bool sound = false;     // downhill, not too far, and to a shape
        bool feasible = false;  // area and volume are as asked, or nearly
        double predicted = 0;   // gain of the merit
        Eigen::VectorXd to;
    };

    // One damped step, then corrections that bring area and volume to what they were meant to be.
    Attempt attempt() {
        const int n = system_.shape_size();
        Attempt out;
        system_.set_followers(u_);
        try {
            const Eigen::SparseMatrix<double> J = system_.jacobian(u_, damping_);
            lu_.factor(J);
            const Eigen::VectorXd F = system_.residual(u_);
            Eigen::VectorXd force = F, off = F;
            force.tail(F.size() - n).setZero(), off.head(n).setZero();
            const Eigen::VectorXd down = -lu_.solve(force), back = -lu_.solve(off);
            const double off_before = system_.constraint_error(u_), part = std::min(1.0, farthest_ / relative(back));
            const Eigen::VectorXd step = down + part * back;
            // The force of beads changes where a step changes their distance: that is no curvature.
            const Eigen::VectorXd& along = system_.problem().beads ? down : step;
            const Eigen::VectorXd dx = along.head(n);
            Eigen::VectorXd within = Eigen::VectorXd::Zero(u_.size());
            within.head(n) = dx, system_.follow(along, within);
            const double curvature = dx.dot((J * within).head(n));
            if (!(curvature >= 0) || !(relative(step) < 0.3)) return out;
            out.predicted = curvature / 2;
            out.to = u_ + step;
            for (int k = 0; k < 2; ++k) {
                if (!system_.admissible(out.to)) return out;
                system_.set_followers(out.to);
                const Eigen::VectorXd still = system_.constraint_residual(out.to) - (1 - part) * off;
                out.to.head(n) -= lu_.solve(still).head(n);
            }
            if (!system_.admissible(out.to)) return out;
            const double off_after = system_.constraint_error(out.to);
            out.feasible = off_before < 1e-3 && part == 1;
            out.sound = off_after <= (out.feasible ? 1e-3 : (1 - part / 2) * off_before);
        } catch (const SolveError&) {
        }
        return out;
    }

    System& system_;
    Eigen::VectorXd& u_;
    int& iterations_;
    double size_;
    double scale_, damping_start_, damping_;
    double farthest_ = farthest;
    decltype(std::declval<const System&>().factors()) lu_;
};

// Descends on one mesh; area, volume and the distance of beads change from the initial to the required ones in steps.
template <class System>
bool descend(System& system, Eigen::VectorXd& u, double tolerance, int& iterations) {
    const StationaryProblem goal = system.problem();
    const Extents from = system.extents(u);
    // Turned inside out by an earlier attempt; the volume of a patch may have either sign.
    if (!(from.area > 0 && (from.volume > 0 || !goal.rings.empty()))) return false;
    const int stages = 1 + static_cast<int>(distance(goal, from) / 0.03);
    for (int k = 1; k < stages; ++k) {
        system.set_problem(between(goal, from, static_cast<double>(k) / stages));
        Newton(system, u, iterations).descend(std::max(0.03, tolerance), 30);
    }
    system.set_problem(goal);
    return Newton(system, u, iterations).descend(tolerance);
}

// Goes a hundredth of the size along this direction, or less where a narrow neck allows no more: downhill.
template <class System>
void leave_saddle(const System& system, Eigen::VectorXd& u, const Eigen::VectorXd& down) {
    const int n = system.shape_size();
    const double size = system.size(u), before = system.merit(u);
    Eigen::VectorXd to = u;
    for (double part = 0.01; part > 1e-6; part /= 4) {
        to.head(n) = u.head(n) + part * size / down.head(n).template lpNorm<Eigen::Infinity>() * down.head(n);
        if (system.admissible(to) && system.merit(to) < before) break;
    }
    u = to;
}

// The stationary shape on one mesh; with `from_afar`, and wherever plain Newton steps fail, after a descent. Without
// `may_descend`, by plain steps alone. False, and u an intermediate state, if none is found.
template <class System>
bool settle(System& system, Eigen::VectorXd& u, bool from_afar, bool may_descend, int& iterations) {
    if (!may_descend) return Newton(system, u, iterations).converge(0.5);
    const auto search = [&](double tolerance) {
        return descend(system, u, tolerance, iterations) && Newton(system, u, iterations).converge(0.1);
    };
    bool found = !from_afar && Newton(system, u, iterations).converge(0.1);
    for (double tolerance = 1e-3; !found && tolerance > 1e-6; tolerance *= 0.03) found = search(tolerance);
    // Newton's last steps, or a symmetry of the initial shape, may lead to a saddle: leave it downhill.
    for (int k = 0; k < 3 && found; ++k) {
        const Eigen::VectorXd down = system.way_down(u);
        if (down.size() == 0) break;
        leave_saddle(system, u, down);
        system.rebase(u);
        found = search(1e-3);
    }
    return found;
}

}  // namespace tubule
