// Branches of stationary shapes in one parameter of the problem, by pseudo-arclength continuation: around folds, with
// folds and bifurcations detected and located, for the unknowns of either tier.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/equilibrium/equilibrium_task.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/solve/sparse.hpp"
#include "common/solve/stop.hpp"

namespace tubule {

// Throws std::invalid_argument for a branch that would not begin at an equilibrium, or end where it begins.
inline void check_branch(Stop start, double from, double to) {
    if (start != Stop::finished) throw std::invalid_argument("a branch must start from an equilibrium");
    if (from == to) throw std::invalid_argument("the start and the end of a branch must differ");
}

enum class PointKind { regular, fold, bifurcation };

// Whether the halves of a branch that leaves at a parameter, which begin at these with amplitudes of opposite sign,
// differ. By symmetry those of a pitchfork begin at the same one.
inline bool transcritical(double leaves, double one, double other) {
    return std::abs(one - other) > 0.05 * (std::abs(one - leaves) + std::abs(other - leaves));
}

template <class Shape>
struct BranchPoint {
    PointKind kind = PointKind::regular;
    double parameter = 0;
    int index = 0;   // negative directions that the continuation counts; at a special point, before it
    int mode = 0;    // at a bifurcation: which eigenvalue vanishes, 1 the lowest
    int branch = 0;  // 0 of the first one, then the number of one that bifurcates from it
    Shape shape;     // at special points to about 1e-6 of the parameter's range
};

template <class Shape, class ShapeSettings>
struct BranchSettings {
    double from = 0, to = 1;      // the branch is left where it leaves the interval
    std::optional<double> begin;  // the parameter of the first shape, if it is not `from`
    std::vector<double> output;   // parameters at which shapes are output, each time the branch passes them
    int max_steps = 500;
    // Not 0: the branch that leaves the first shape along this mode, 1 the lowest of the second variation. It begins
    // where the mode's largest displacement is `amplitude` times the radius of a sphere of the same area.
    int mode = 0;
    double amplitude = 0.05;
    bool branches = false;  // follow_branches() also follows those that bifurcate from it
    ShapeSettings shapes;   // accuracy of each
    // Is given each as soon as it is known.
    std::function<void(const BranchPoint<Shape>&)> found = [](const BranchPoint<Shape>&) {};
};

template <class Shape>
struct Branch {
    std::vector<BranchPoint<Shape>> points;  // in the order of the branch
    int steps = 0;
    Stop stop = Stop::finished;  // or why it ends inside the interval
    std::string message;
    std::vector<std::string> warnings;
};

// A point of the branch on one mesh: unknowns, then the parameter; and the direction of the branch there, of unit
// length in the norm of Follower.
struct Place {
    Eigen::VectorXd w, tangent;
    double parameter() const { return w[w.size() - 1]; }
    Eigen::VectorXd u() const { return w.head(w.size() - 1); }
};

// What became of the unknowns of a place.
enum class Renewal { none, same_size, new_mesh, impossible };

// A change of the number of negative directions that goes with a turn of the parameter is a fold, one without is a
// bifurcation. `Tier` holds the equations on the present mesh and offers
//   Shape, Settings           what is reported, and how accurate
//   system()                  as for Newton's method
//   factors()                 a solver for its Jacobian with one more row and column
//   size()                    the length that displacements are compared with
//   index(u)                  negative directions
//   lowest(u, count)          at least that many lowest eigenvalues of the second variation, ascending
//   leave(place, mode, far)   moves the place by a mode, its largest displacement `far`; this is the tangent then
//   renew(place)              other unknowns for the same shape and tangent, a better mesh where this one is too coarse
//   why_not_renewed(parameter)             words for the latter
//   meets_itself(u), meets_itself(shape)   where, to follow "the shape intersects itself"; empty: nowhere
//   energy(shape)
//   report(place, problem, kind)           the shape; regular ones are found again with the parameter held
//   index_of(point, problem, before)       of a point to report, given the number that the continuation counts
template <class Tier>
class Follower {
public:
    using Shape = typename Tier::Shape;
    using Settings = BranchSettings<Shape, typename Tier::Settings>;
    using Point = BranchPoint<Shape>;

    // `problem` and `start`, of unknowns u, belong to the parameter `from`.
    Follower(Tier& tier, const StationaryProblem& problem, const Eigen::VectorXd& start, const SetParameter& set,
             const Settings& settings)
        : tier_(tier),
          problem_(problem),
          set_(set),
          settings_(settings),
          range_(std::abs(settings.to - settings.from)),
          lu_(tier.factors()) {
        const double slack = 1e-9 * range_;
        low_ = std::min(settings.from, settings.to) - slack, high_ = low_ + range_ + 2 * slack;
        place_.w.resize(start.size() + 1);
        place_.w << start, settings.begin.value_or(settings.from);
    }

    Branch<Shape> run() {
        if (settings_.mode > 0) {
            if (auto stop = leave()) return end(stop->first, std::move(stop->second));
        } else {
            set_tangent(place_, unit_parameter());
            if ((settings_.to - settings_.from) * place_.tangent[last()] < 0) place_.tangent *= -1;
            renew();
            index_ = index(place_);
            output_at(settings_.from);
        }
        double step = 0.02;
        while (branch_.steps < settings_.max_steps) {
            int iterations = 0;
            const std::optional<Place> next = advance(place_, step, iterations);
            // A direction that turns too far may belong to another branch.
            if (!next || inner(next->tangent, place_.tangent) < 0.8) {
                step /= 2;
                if (step < 1e-7)
                    return end(Stop::solver_failed, "the branch cannot be followed further: the step became too small");
                continue;
            }
            ++branch_.steps;
            const double before = place_.parameter();
            if (!record_between(place_, *next, step))
                return end(Stop::solver_failed,
                           fmt::format("no stationary shape found on the branch between the parameters {:.6g} and "
                                       "{:.6g}",
                                       before, next->parameter()));
            place_ = *next;
            if (auto stop = check()) return end(stop->first, std::move(stop->second));
            if (iterations <= 4) step = std::min(step * 1.6, 0.2);
        }
        return end(Stop::solver_failed,
                   fmt::format("after {} steps, the largest number allowed, the branch is at parameter {:.6g}",
                               settings_.max_steps, place_.parameter()));
    }

private:
    using At = std::pair<double, Place>;  // a place, and its distance along the tangent

    Branch<Shape> end(Stop stop, std::string message) {
        branch_.stop = stop, branch_.message = std::move(message);
        return std::move(branch_);
    }
    int last() const { return static_cast<int>(place_.w.size()) - 1; }

    // From the first shape to the branch that bifurcates along a mode: at a given distance along it, with the parameter
    // to be found. The branch of the first shape, where the mode's amplitude is zero, is excluded.
    std::optional<std::pair<Stop, std::string>> leave() {
        const Place first = place_;
        double far = settings_.amplitude * tier_.size() / std::sqrt(4 * pi);
        for (int attempt = 0; attempt < 4; ++attempt, far /= 2) {
            place_ = first;
            tier_.system().set_problem(problem_at(first.parameter()));
            tier_.leave(place_, settings_.mode, far);
            place_.tangent *= std::copysign(1 / std::sqrt(inner(place_.tangent, place_.tangent)), far);
            lu_ = tier_.factors();
            int iterations = 0;
            const auto found = advance(place_, 0, iterations, 2);  // the bifurcation may be at the other end
            if (!found) continue;
            place_ = *found;
            // It may begin a little outside of the interval, and lead into it.
            low_ = std::min(low_, place_.parameter()), high_ = std::max(high_, place_.parameter());
            renew();
            index_ = index(place_);
            record(point(place_, PointKind::bifurcation), index_);
            return std::nullopt;
        }
        return {
            {Stop::solver_failed, fmt::format("no branch was found along mode {} of the first shape: its eigenvalue "
                                              "must be nearly zero",
                                              settings_.mode)}};
    }

    void record(Point p, int index) {
        p.index = index;
        const bool with_last =
            !branch_.points.empty() && std::abs(p.parameter - branch_.points.back().parameter) < 1e-6 * range_;
        if (!with_last) repeated_ = is_known(p) ? repeated_ + 1 : 0;
        branch_.points.push_back(std::move(p));
        settings_.found(branch_.points.back());
    }

    // Whether the branch ends at the place reached; if not, with new unknowns where that is better.
    std::optional<std::pair<Stop, std::string>> check() {
        const double p = place_.parameter();
        if (!branch_.message.empty()) return {{Stop::self_intersection, branch_.message}};
        if (p < low_ || p > high_) return {{Stop::finished, ended_at(p < low_ ? low_ : high_)}};
        if (repeated_ > 1) return {{Stop::finished, ended_at(p)}};
        if (met_itself(tier_.meets_itself(place_.u()), p)) return {{Stop::self_intersection, branch_.message}};
        if (!renew()) return {{Stop::resolution_lost, tier_.why_not_renewed(p)}};
        return std::nullopt;
    }

    // In words, and a warning where the branch that was asked for does not reach its end.
    std::string ended_at(double parameter) {
        if (std::abs(parameter - settings_.to) < 1e-6 * range_)
            return fmt::format("the branch reached the parameter {:.6g}", settings_.to);
        const auto fold = std::ranges::find(branch_.points.rbegin(), branch_.points.rend(), PointKind::fold,
                                            &BranchPoint<Shape>::kind);
        const std::string turned =
            fold == branch_.points.rend() ? "" : fmt::format("turned at the fold at {:.6g} and ", fold->parameter);
        const std::string ended = repeated_ > 1 ? fmt::format("repeats its shapes at the parameter {:.6g}", parameter)
                                                : fmt::format("ended at the parameter {:.6g}", settings_.from);
        const std::string out = fmt::format("the branch {}{}: it did not reach {:.6g}", turned, ended, settings_.to);
        if (settings_.mode == 0) branch_.warnings.push_back(out);
        return out;
    }

    // A branch that is closed, or that Newton's method has turned around on a coarse mesh, comes to its shapes again.
    bool is_known(const Point& p) const {
        return p.kind != PointKind::fold && std::ranges::any_of(branch_.points, [&](const Point& before) {
                   const double energy = tier_.energy(before.shape);
                   return std::abs(p.parameter - before.parameter) < 1e-6 * range_ &&
                          std::abs(tier_.energy(p.shape) - energy) < 1e-6 * std::abs(energy);
               });
    }

    // Mean square of the shape's displacement relative to its size, and of the parameter's relative to its range.
    Eigen::VectorXd covector(const Eigen::VectorXd& t) const {
        const int n = tier_.system().shape_size();
        const double size = tier_.size();
        Eigen::VectorXd out = Eigen::VectorXd::Zero(t.size());
        out.head(n) = t.head(n) / (n * size * size);
        out[t.size() - 1] = t[t.size() - 1] / (range_ * range_);
        return out;
    }
    double inner(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const { return covector(a).dot(b); }
    Eigen::VectorXd unit_parameter() const { return Eigen::VectorXd::Unit(place_.w.size(), last()) * range_; }

    StationaryProblem problem_at(double parameter) const {
        StationaryProblem p = problem_;
        set_(p, parameter);
        return p;
    }
    Eigen::VectorXd residual(const Eigen::VectorXd& u, double parameter) {
        tier_.system().set_problem(problem_at(parameter));
        return tier_.system().residual(u);
    }
    // [F_u F_parameter; row]. Moduli, alpha, M0 and constraints enter F linearly, H0 as a polynomial of low degree.
    Eigen::SparseMatrix<double> matrix(const Eigen::VectorXd& w, const Eigen::VectorXd& row) {
        const int n = static_cast<int>(w.size()) - 1;
        const double h = 1e-4 * range_;
        const Eigen::VectorXd u = w.head(n);
        const Eigen::VectorXd column = (residual(u, w[n] + h) - residual(u, w[n] - h)) / (2 * h);
        tier_.system().set_problem(problem_at(w[n]));
        return bordered(tier_.system().jacobian(u, 0), column, row.head(n).transpose(), row.tail(1));
    }

    // The direction of the branch on the side of `along`.
    void set_tangent(Place& place, const Eigen::VectorXd& along) {
        lu_.factor(matrix(place.w, covector(along)));
        const Eigen::VectorXd t = lu_.solve(Eigen::VectorXd::Unit(place.w.size(), last()));
        place.tangent = t / std::sqrt(inner(t, t));
    }

    // The point of the branch at this distance along the tangent, by Newton's method across it in steps below `most`.
    std::optional<Place> advance(const Place& from, double distance, int& iterations, double most = 0.5) {
        Place to{from.w + distance * from.tangent, from.tangent};
        const int n = static_cast<int>(to.w.size()) - 1;
        const Eigen::VectorXd row = covector(from.tangent);
        double before = 1;
        try {
            for (iterations = 1; iterations <= 12; ++iterations) {
                // A shape on a new mesh may have kinks, which the first iterations smooth.
                if (distance != 0 && !tier_.system().admissible(to.u())) return std::nullopt;
                lu_.factor(matrix(to.w, row));
                Eigen::VectorXd F(n + 1);
                F << tier_.system().residual(to.u()), row.dot(to.w - from.w) - distance;
                const Eigen::VectorXd step = lu_.solve(F);
                const double length = std::sqrt(inner(step, step));
                to.w -= (distance == 0 && length > 1e-4 ? downhill_part(to.w, step, F.head(n).norm()) : 1) * step;
                // Quadratic convergence; or, on fine meshes, that of rounding errors.
                const bool converged = length < 1e-8 || (length < 1e-6 && length > before / 4);
                if (!(length < most) || (iterations > 4 && length > 10 * before)) return std::nullopt;
                before = length;
                if (converged) {
                    if (!tier_.system().admissible(to.u())) return std::nullopt;
                    set_tangent(to, from.tangent);
                    return to;
                }
            }
        } catch (const SolveError&) {
        } catch (const std::invalid_argument&) {  // the parameter has left what is possible
        }
        return std::nullopt;
    }

    // How much of Newton's step reduces the force. All of it is too much where a new mesh has strong kinks.
    double downhill_part(const Eigen::VectorXd& w, const Eigen::VectorXd& step, double force) {
        double part = 1;
        for (; part > 0.01; part /= 2) {
            const Eigen::VectorXd to = w - part * step;
            if (residual(to.head(last()), to[last()]).norm() < force) break;
        }
        return part;
    }

    int index(const Place& p) {
        tier_.system().set_problem(problem_at(p.parameter()));
        return tier_.index(p.u());
    }
    double eigenvalue(const Place& p, int which) {
        tier_.system().set_problem(problem_at(p.parameter()));
        return tier_.lowest(p.u(), which + 1)[which];
    }

    // Where f vanishes between a and b, at distance `step` from it, up to this fraction of its change: regula falsi
    // (Illinois).
    template <class F>
    std::optional<At> locate(const Place& a, const Place& b, double step, F&& f, double tolerance = 1e-9) {
        double low = 0, high = step, at_a = f(a), at_b = f(b);
        // Another mesh has moved a zero past an end.
        if ((at_a < 0) == (at_b < 0)) return std::abs(at_a) < std::abs(at_b) ? At{0, a} : At{step, b};
        const double scale = std::abs(at_a) + std::abs(at_b);
        std::optional<At> best;
        for (int k = 0; k < 25 && high - low > 1e-10 * step; ++k) {
            const double middle = (low * at_b - high * at_a) / (at_b - at_a);
            int iterations = 0;
            const auto place = advance(a, middle, iterations);
            if (!place) return best ? best : beside(a, middle, (high - low) / 100, f);
            best = {middle, *place};
            const double value = f(*place);
            if (std::abs(value) < tolerance * scale) break;
            if ((value < 0) == (at_a < 0)) {
                low = middle, at_a = value, at_b /= 2;
            } else {
                high = middle, at_b = value, at_a /= 2;
            }
        }
        return best;
    }

    // A zero of f at which Newton's method fails, at this distance from a: interpolated between two places beside it.
    template <class F>
    std::optional<At> beside(const Place& a, double distance, double apart, const F& f) {
        int iterations = 0;
        const auto before = advance(a, distance - apart, iterations), after = advance(a, distance + apart, iterations);
        if (!before || !after) return std::nullopt;
        const double first = f(*before), last = f(*after);
        if ((first < 0) == (last < 0)) return std::nullopt;
        const double part = first / (first - last);
        Place between = *before;
        between.w += part * (after->w - before->w);
        return At{distance + (2 * part - 1) * apart, std::move(between)};
    }

    // The place at a parameter between those of a and b: near it, then by Newton's method with the parameter held,
    // which only a fold close by prevents.
    std::optional<At> at_parameter(const Place& a, const Place& b, double step, double wanted) {
        const auto past = [&](const Place& p) { return p.parameter() - wanted; };
        std::optional<At> at = locate(a, b, step, past, 1e-2);
        if (!at) return at;
        Place held{at->second.w, unit_parameter()};
        if (at->second.tangent[last()] < 0) held.tangent *= -1;
        held.w[last()] = wanted;
        int iterations = 0;
        if (auto exact = advance(held, 0, iterations)) return At{at->first, std::move(*exact)};
        at = locate(a, b, step, past);
        if (at) at->second.w[last()] = wanted;
        return at;
    }

    // Everything to report between two points of the branch, in its order. False if a point is not found.
    bool record_between(const Place& a, Place b, double step) {
        // Nothing is looked for beyond the end of the interval.
        const double end = std::clamp(b.parameter(), low_, high_);
        if (end != b.parameter())
            if (const auto at = at_parameter(a, b, step, end)) step = at->first, b = at->second;
        std::vector<std::pair<double, Point>> found;
        bool complete = true;
        const auto note = [&](const std::optional<At>& at, PointKind kind, int mode = 0) {
            if (!at) complete = false;
            if (!at || at->second.parameter() < low_ || at->second.parameter() > high_) return;
            found.emplace_back(at->first, point(at->second, kind));
            found.back().second.mode = mode;
        };
        const bool turned = a.tangent[last()] * b.tangent[last()] < 0;
        if (turned) note(locate(a, b, step, [&](const Place& p) { return p.tangent[last()]; }), PointKind::fold);
        const int after = index(b), before = index_;
        if (after != before && (!turned || std::abs(after - before) > 1)) {
            const int which = std::min(before, after);  // ascending: the eigenvalue that changes its sign
            auto at = locate(a, b, step, [&](const Place& p) { return eigenvalue(p, which); });
            if (!at) {  // Newton's method fails beside it, or a mesh without the shape's symmetry has smeared it out
                branch_.warnings.push_back(
                    fmt::format("a bifurcation between the parameters {:.6g} and {:.6g} could not be located: it is "
                                "written at the latter",
                                a.parameter(), b.parameter()));
                at = {step, b};
            }
            note(at, PointKind::bifurcation, which + 1);
        }
        for (double wanted : settings_.output) {
            const double left = a.parameter() - wanted, right = b.parameter() - wanted;
            if (wanted != settings_.from || branch_.steps > 1 || settings_.mode > 0)
                if (left * right < 0 || right == 0) {
                    const auto at = at_parameter(a, b, step, wanted);
                    if (at)
                        note(at, PointKind::regular);
                    else  // a bifurcation is too close for Newton's method
                        branch_.warnings.push_back(fmt::format(
                            "no shape was found at the parameter {:.6g}, beside a special point: it is left out",
                            wanted));
                }
        }
        std::sort(found.begin(), found.end(), [](const auto& x, const auto& y) { return x.first < y.first; });
        for (auto& [distance, p] : found) {
            if (met_itself(tier_.meets_itself(p.shape), p.parameter)) break;
            const int counted = tier_.index_of(p, problem_at(p.parameter), before);
            record(std::move(p), counted);
        }
        index_ = after;
        return complete;
    }

    // Whether the shape intersects itself; if so, sets the message of the branch.
    bool met_itself(const std::string& where, double parameter) {
        if (where.empty()) return false;
        branch_.message = fmt::format("at parameter {:.6g} the shape intersects itself{}", parameter, where);
        return true;
    }

    void output_at(double parameter) {
        for (double wanted : settings_.output)
            if (wanted == parameter) record(point(place_, PointKind::regular), index_);
    }

    Point point(const Place& place, PointKind kind) {
        const StationaryProblem problem = problem_at(place.parameter());
        tier_.system().set_problem(problem);
        return {kind, place.parameter(), 0, 0, 0, tier_.report(place, problem, kind)};
    }

    // Other unknowns where these are not the best. False if there are none.
    bool renew() {
        tier_.system().set_problem(problem_at(place_.parameter()));
        switch (tier_.renew(place_)) {
            case Renewal::none:
                return true;
            case Renewal::same_size:
                place_.tangent /= std::sqrt(inner(place_.tangent, place_.tangent));
                return true;
            case Renewal::impossible:
                return false;
            case Renewal::new_mesh:
                break;
        }
        lu_ = tier_.factors();
        int iterations = 0;
        const auto corrected = advance(place_, 0, iterations);
        if (!corrected) return false;
        place_ = *corrected;
        return true;
    }

    Tier& tier_;
    StationaryProblem problem_;
    const SetParameter& set_;
    const Settings& settings_;
    double range_, low_ = 0, high_ = 0;
    decltype(std::declval<Tier&>().factors()) lu_;
    Place place_;
    int index_ = 0;     // at the place
    int repeated_ = 0;  // how many of the last points have been there before
    Branch<Shape> branch_;
};

// The branch and, if settings.branches, those that bifurcate from it: of a pitchfork the half that its symmetry maps to
// the other one, of a transcritical bifurcation both halves. `follow(problem, start, set, settings)` follows one. Its
// end is that of the first; how others end too early is a warning.
template <class Shape, class ShapeSettings, class Follow>
Branch<Shape> follow_branches(const StationaryProblem& problem, const Shape& start, const SetParameter& set,
                              const BranchSettings<Shape, ShapeSettings>& settings, Follow&& follow) {
    if (!settings.branches) return follow(problem, start, set, settings);
    std::vector<BranchPoint<Shape>> bifurcations;
    BranchSettings<Shape, ShapeSettings> one = settings;
    one.found = [&](const BranchPoint<Shape>& p) {
        if (p.mode > 0) bifurcations.push_back(p);
        settings.found(p);
    };
    Branch<Shape> all = follow(problem, start, set, one);
    int branch = 0;
    for (const BranchPoint<Shape>& from : bifurcations) {
        StationaryProblem here = problem;
        set(here, from.parameter);
        one.mode = from.mode, one.begin = from.parameter;
        std::optional<double> begins;  // of the first half
        for (const double side : {1, -1}) {
            one.amplitude = side * settings.amplitude;
            if (begins) {
                one.max_steps = 0, one.found = [](const BranchPoint<Shape>&) {};
                const auto points = follow(here, from.shape, set, one).points;
                if (points.empty() || !transcritical(from.parameter, *begins, points.front().parameter)) break;
            }
            ++branch;
            one.max_steps = settings.max_steps;
            one.found = [&](BranchPoint<Shape> p) {
                p.branch = branch;
                settings.found(p);
                all.points.push_back(std::move(p));
            };
            Branch<Shape> found = follow(here, from.shape, set, one);
            all.steps += found.steps;
            std::move(found.warnings.begin(), found.warnings.end(), std::back_inserter(all.warnings));
            if (found.stop != Stop::finished)
                all.warnings.push_back(fmt::format("branch {}, which leaves at the parameter {:.6g}, ends: {}", branch,
                                                   from.parameter, found.message));
            if (found.points.empty()) break;
            begins = found.points.front().parameter;
        }
    }
    return all;
}

}  // namespace tubule
