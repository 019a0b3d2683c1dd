#include "common/equilibrium/stationary_problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/geometry/profile_point.hpp"

namespace tubule {
namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double rounding = 1e-9;                // of the reduced volume of a sphere to begin with
const double sphere_factor = 6 * std::sqrt(pi);  // reduced volume = sphere_factor V / A^(3/2)

// In space that is periodic along an axis, balls and cylinders enclose most (Pedrosa and Ritore, Indiana Univ. Math. J.
// 48, 1999).
double largest_volume(double area, double period) {
    return std::max(std::pow(area, 1.5) / sphere_factor, area * area / (4 * pi * period));
}

void check_values(const StationaryProblem& problem, double period) {
    const Constraints& c = problem.constraints;
    const auto positive = [](const std::optional<double>& value, const char* what) {
        if (value && !(*value > 0))
            throw std::invalid_argument(fmt::format("{} of {} is impossible: it must be positive", what, *value));
    };
    positive(c.area, "an area");
    if (!problem.rings.empty()) return;
    positive(c.volume, "a volume"), positive(c.reduced_volume, "a reduced volume");
    if (period == 0) {
        std::optional<double> v = c.reduced_volume;
        if (c.area && c.volume) v = reduced_volume(*c.area, *c.volume);
        if (v && *v > 1 + rounding)
            throw std::invalid_argument(
                fmt::format("a reduced volume of {:.6g} is impossible: the largest is 1, that of a sphere", *v));
    } else if (c.area && c.volume && !problem.free_period) {
        const double most = largest_volume(*c.area, period);
        if (*c.volume > most)
            throw std::invalid_argument(
                fmt::format("a volume of {:.6g} a period is impossible: an area of {:.6g} encloses at most {:.6g}",
                            *c.volume, *c.area, most));
    }
}

}  // namespace

double reduced_volume(double area, double volume) {
    return sphere_factor * volume / std::pow(area, 1.5);
}

bool hold_axis(const StationaryProblem& problem, double force, double size, double reference_energy) {
    return problem.beads && std::abs(force) * size > 1e-4 * reference_energy;
}

bool scale_free(const StationaryProblem& p) {
    return p.bending.k[term_number("k40")] == 0 && p.bending.k[term_number("k42")] == 0 && p.bending.terms.empty() &&
           p.bending.kg == 0 && p.bending.H0 == 0 && !p.bending.H0_varies() && !p.bending.alpha &&
           p.loads.tension == 0 && p.loads.pressure == 0 && !p.loads.of_volume && p.loads.force == 0 &&
           p.bending.potentials.empty() && !p.beads && p.rings.empty();
}

void check_problem(const StationaryProblem& problem, double period) {
    const Constraints& c = problem.constraints;
    if (!problem.free_period && !problem.beads && problem.loads.force != 0)
        throw std::invalid_argument("a force needs a free period, and a space with one");
    if (problem.free_period && !c.area && !c.volume)
        throw std::invalid_argument("a free period needs a given area or a given volume");
    const bool tension = problem.loads.tension != 0, pressure = problem.loads.pressure != 0 || problem.loads.of_volume;
    if ((c.area && tension) || (c.volume && pressure) || (c.reduced_volume && (tension || pressure)))
        throw std::invalid_argument("a tension needs a free area, a pressure a free volume");
    if (c.reduced_volume && !problem.rings.empty())
        throw std::invalid_argument("a reduced volume is that of a closed surface");
    if (c.reduced_volume && (c.area || c.volume))
        throw std::invalid_argument("the reduced volume cannot be combined with area and volume, which determine it");
    check_values(problem, period);
}

MultiplierEquations multiplier_equations(const StationaryProblem& problem, double area, double volume, double sigma,
                                         double lambda) {
    const Constraints& c = problem.constraints;
    MultiplierEquations out{{}, Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Zero()};
    if (c.reduced_volume) {
        out.F[0] = 2 * sigma * area + 3 * lambda * volume;  // no change with size
        out.F[1] = volume - *c.reduced_volume / sphere_factor * std::pow(area, 1.5);
        out.by_extent << 2 * sigma, 3 * lambda, reduced_volume_slopes(*c.reduced_volume, area).by_area, 1;
        out.by_multipliers(0, 0) = 2 * area, out.by_multipliers(0, 1) = 3 * volume;
        return out;
    }
    out.F[0] = c.area ? area - *c.area : sigma - problem.loads.tension;
    out.F[1] = c.volume ? volume - *c.volume : lambda + problem.loads.pressure_at(volume);
    (c.area ? out.by_extent : out.by_multipliers)(0, 0) = 1;
    (c.volume ? out.by_extent : out.by_multipliers)(1, 1) = 1;
    if (!c.volume) out.by_extent(1, 1) = problem.loads.pressure_slope(volume);
    return out;
}

double lagrangian(const StationaryProblem& problem, double energy, double area, double volume, double length,
                  double sigma, double lambda) {
    const Constraints& c = problem.constraints;
    double value = energy + problem.loads.energy(area, volume, length);
    if (c.area) value += sigma * (area - *c.area);
    if (c.volume) value += lambda * (volume - *c.volume);
    if (c.reduced_volume) value += lambda * (volume - *c.reduced_volume / sphere_factor * std::pow(area, 1.5));
    return value;
}

ReducedVolumeSlopes reduced_volume_slopes(double reduced_volume, double area) {
    const double factor = reduced_volume / sphere_factor;
    return {-factor * 1.5 * std::sqrt(area), -factor * 0.75 / std::sqrt(area)};
}

double constraint_error(const Constraints& c, const MultiplierEquations& equations, double length) {
    const double area = c.area ? std::abs(equations.F[0]) / (length * length) : 0;
    const double volume = c.volume || c.reduced_volume ? std::abs(equations.F[1]) / (length * length * length) : 0;
    return std::max(area, volume);
}

double reference_energy(const StationaryProblem& problem, double energy, double magnitude, const Extents& at) {
    const Loads& loads = problem.loads;
    return std::max(std::abs(energy + loads.energy(at.area, at.volume, at.length)),
                    magnitude + loads.scale(at.area, at.volume, at.length));
}

// The volume of a patch and the distance of its bead may be zero: from there they change by equal steps.
StationaryProblem between(const StationaryProblem& goal, const Extents& from, double part) {
    const auto on_the_way = [&](const std::optional<double>& wanted, double is) -> std::optional<double> {
        if (!wanted) return wanted;
        return goal.rings.empty() ? is * std::pow(*wanted / is, part) : is + part * (*wanted - is);
    };
    const Constraints& c = goal.constraints;
    StationaryProblem out = goal;
    out.constraints = {on_the_way(c.area, from.area), on_the_way(c.volume, from.volume),
                       on_the_way(c.reduced_volume, reduced_volume(from.area, from.volume))};
    if (const auto held = on_the_way(goal.held_distance(), from.length))
        out.beads->extension = Ramp(*held - goal.bead_distance);
    return out;
}

double distance(const StationaryProblem& goal, const Extents& from) {
    const Constraints& c = goal.constraints;
    const double size = std::sqrt(from.area);
    const auto off = [&](const std::optional<double>& wanted, double is, double scale) {
        if (!wanted) return 0.0;
        return goal.rings.empty() ? std::abs(std::log(*wanted / is)) : std::abs(*wanted - is) / scale;
    };
    return std::max({off(c.area, from.area, from.area), off(c.volume, from.volume, size * from.area),
                     off(c.reduced_volume, reduced_volume(from.area, from.volume), 1),
                     off(goal.held_distance(), from.length, size)});
}

bool begins_at_sphere(const Constraints& goal, double area, double volume, double rounding) {
    if (!goal.reduced_volume && !(goal.area && goal.volume)) return false;
    const double wanted = goal.reduced_volume ? *goal.reduced_volume : reduced_volume(*goal.area, *goal.volume);
    return reduced_volume(area, volume) > 1 - rounding && wanted < 1 - rounding;
}

std::string why_no_sphere(const char* shape) {
    return fmt::format("a sphere leads to no other area and volume, since all directions are alike: start at {}",
                       shape);
}

std::string why_none(const Constraints& goal, const Extents& first, const Extents& last, bool descended,
                     int iterations) {
    std::string missed;
    const auto compare = [&](const char* what, const std::optional<double>& wanted, double from, double to) {
        if (!wanted || !descended) return;
        const double scale = std::max(std::abs(*wanted), std::abs(from));
        if (!(std::abs(to - *wanted) < 0.01 * scale) && missed.empty())
            missed = fmt::format(
                "no shape with {} {:.6g} was found: the initial shape has {:.6g}, and the descent from there ended at "
                "{:.6g}",
                what, *wanted, from, to);
    };
    compare("area", goal.area, first.area, last.area);
    compare("volume", goal.volume, first.volume, last.volume);
    compare("reduced volume", goal.reduced_volume, reduced_volume(first.area, first.volume),
            reduced_volume(last.area, last.volume));
    return missed.empty() ? fmt::format("Newton's method does not converge ({} iterations)", iterations) : missed;
}

}  // namespace tubule
