#include "axisym/equilibrium/continuation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "axisym/curve/curve_measures.hpp"
#include "axisym/graph/graph_mesh.hpp"

namespace tubule::axisym {
namespace {

// A point of the branch on one mesh: unknowns, then the parameter; and the direction of the branch there, of unit
// length in the norm of Follower.
struct Place {
    Eigen::VectorXd w, tangent;
    double parameter() const { return w[w.size() - 1]; }
};

class Follower {
public:
    Follower(const StationaryProblem& problem, const Equilibrium& start, const SetParameter& set,
             const BranchSettings& settings)
        : problem_(problem), set_(set), settings_(settings), range_(std::abs(settings.to - settings.from)) {
        place_.w.resize(start.x.size() + StationarySystem::numbers + 1);
        place_.w << unknowns(start), settings.from;
        size_ = std::sqrt(start.observed.area);
        system_ = std::make_unique<StationarySystem>(start.space, problem, start.gauge);
    }

    Branch run() {
        set_tangent(place_, unit_parameter());
        if ((settings_.to - settings_.from) * place_.tangent[last()] < 0) place_.tangent *= -1;
        remesh_if_needed();
        index_ = index(place_.w);
        const double slack = 1e-9 * range_;
        const double low = std::min(settings_.from, settings_.to) - slack, high = low + range_ + 2 * slack;
        output_at(settings_.from);
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
            if (!record_between(place_, *next, step, low, high))
                return end(Stop::solver_failed,
                           fmt::format("no stationary shape found on the branch between the parameters {:.6g} and "
                                       "{:.6g}",
                                       place_.parameter(), next->parameter()));
            place_ = *next;
            if (!branch_.message.empty()) return end(Stop::self_intersection, branch_.message);
            if (place_.parameter() < low || place_.parameter() > high) return end(Stop::finished, "");
            if (met_itself(system_->space(), curve(place_.w), place_.parameter()))
                return end(Stop::self_intersection, branch_.message);
            if (!remesh_if_needed())
                return end(
                    Stop::resolution_lost,
                    fmt::format("the mesh is too coarse at parameter {1:.6g}, with the largest number of elements, {0}",
                                settings_.shapes.max_elements, place_.parameter()));
            if (iterations <= 4) step = std::min(step * 1.6, 0.2);
        }
        return end(Stop::solver_failed,
                   fmt::format("after {} steps, the largest number allowed, the branch is at parameter {:.6g}",
                               settings_.max_steps, place_.parameter()));
    }

private:
    Branch end(Stop stop, std::string message) {
        branch_.stop = stop, branch_.message = std::move(message);
        return std::move(branch_);
    }
    int last() const { return static_cast<int>(place_.w.size()) - 1; }
    Eigen::VectorXd curve(const Eigen::VectorXd& w) const { return w.head(system_->space().size()); }

    // Mean square of the curve's displacement relative to its size, and of the parameter's relative to its range.
    Eigen::VectorXd covector(const Eigen::VectorXd& t) const {
        const int n = system_->space().size();
        Eigen::VectorXd out = Eigen::VectorXd::Zero(t.size());
        out.head(n) = t.head(n) / (n * size_ * size_);
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
        system_->set_problem(problem_at(parameter));
        return system_->residual(u);
    }
    // [F_u F_parameter; row]. Moduli, alpha, M0 and constraints enter F linearly, H0 as a polynomial of low degree.
    Eigen::SparseMatrix<double> matrix(const Eigen::VectorXd& w, const Eigen::VectorXd& row) {
        const int n = static_cast<int>(w.size()) - 1;
        const double h = 1e-4 * range_;
        const Eigen::VectorXd u = w.head(n);
        const Eigen::VectorXd column = (residual(u, w[n] + h) - residual(u, w[n] - h)) / (2 * h);
        system_->set_problem(problem_at(w[n]));
        const Eigen::SparseMatrix<double> J = system_->jacobian(u);
        Eigen::SparseMatrix<double> out(n + 1, n + 1);
        out.reserve(J.nonZeros() + 2 * n + 1);
        for (int j = 0; j <= n; ++j) {
            out.startVec(j);
            if (j < n)
                for (Eigen::SparseMatrix<double>::InnerIterator it(J, j); it; ++it)
                    out.insertBack(it.row(), j) = it.value();
            else
                for (int i = 0; i < n; ++i) out.insertBack(i, j) = column[i];
            out.insertBack(n, j) = row[j];
        }
        out.finalize();
        return out;
    }

    // The direction of the branch on the side of `along`.
    void set_tangent(Place& place, const Eigen::VectorXd& along) {
        lu_.factor(matrix(place.w, covector(along)));
        const Eigen::VectorXd t = lu_.solve(Eigen::VectorXd::Unit(place.w.size(), last()));
        place.tangent = t / std::sqrt(inner(t, t));
    }

    // The point of the branch at this distance along the tangent, by Newton's method across it.
    std::optional<Place> advance(const Place& from, double distance, int& iterations) {
        Place to{from.w + distance * from.tangent, from.tangent};
        const int n = static_cast<int>(to.w.size()) - 1;
        const Eigen::VectorXd row = covector(from.tangent);
        double before = 1;
        try {
            for (iterations = 1; iterations <= 12; ++iterations) {
                if (!system_->forms().admissible(curve(to.w))) return std::nullopt;
                lu_.factor(matrix(to.w, row));
                Eigen::VectorXd F(n + 1);
                F << system_->residual(to.w.head(n)), row.dot(to.w - from.w) - distance;
                const Eigen::VectorXd step = lu_.solve(F);
                to.w -= step;
                const double length = std::sqrt(inner(step, step));
                // Quadratic convergence; or, on fine meshes, that of rounding errors.
                const bool converged = length < 1e-8 || (length < 1e-6 && length > before / 4);
                if (!(length < 0.5) || (iterations > 4 && length > 10 * before)) return std::nullopt;
                before = length;
                if (converged) {
                    set_tangent(to, from.tangent);
                    return to;
                }
            }
        } catch (const SolveError&) {
        } catch (const std::invalid_argument&) {  // the parameter has left what is possible
        }
        return std::nullopt;
    }

    Eigen::VectorXd spectrum(const Eigen::VectorXd& w) {
        system_->set_problem(problem_at(w[w.size() - 1]));
        return system_->variation(w.head(w.size() - 1)).eigenvalues;
    }
    int index(const Eigen::VectorXd& w) { return static_cast<int>((spectrum(w).array() < 0).count()); }

    // Where f, of opposite signs at a and at distance `step` from it, vanishes in between: regula falsi (Illinois).
    template <class F>
    std::optional<std::pair<double, Place>> locate(const Place& a, double step, double at_a, double at_b, F&& f) {
        double low = 0, high = step;
        const double scale = std::abs(at_a) + std::abs(at_b);
        std::optional<std::pair<double, Place>> best;
        for (int k = 0; k < 25 && high - low > 1e-10 * step; ++k) {
            const double middle = (low * at_b - high * at_a) / (at_b - at_a);
            int iterations = 0;
            const auto place = advance(a, middle, iterations);
            if (!place) return best;
            best = {middle, *place};
            const double value = f(*place);
            if (std::abs(value) < 1e-9 * scale) break;
            if ((value < 0) == (at_a < 0)) {
                low = middle, at_a = value, at_b /= 2;
            } else {
                high = middle, at_b = value, at_a /= 2;
            }
        }
        return best;
    }

    // Everything to report between two points of the branch, in its order. False if a point is not found.
    bool record_between(const Place& a, const Place& b, double step, double low, double high) {
        std::vector<std::pair<double, BranchPoint>> found;
        bool complete = true;
        const auto note = [&](std::optional<std::pair<double, Place>> at, PointKind kind) {
            if (!at) complete = false;
            if (!at || at->second.parameter() < low || at->second.parameter() > high) return;
            found.emplace_back(at->first, point(at->second, kind));
        };
        const bool turned = a.tangent[last()] * b.tangent[last()] < 0;
        if (turned)
            note(locate(a, step, a.tangent[last()], b.tangent[last()],
                        [&](const Place& p) { return p.tangent[last()]; }),
                 PointKind::fold);
        const int before = index_, after = index(b.w);
        if (after != before && (!turned || std::abs(after - before) > 1)) {
            const int which = std::min(before, after);  // ascending: the eigenvalue that changes its sign
            note(locate(a, step, spectrum(a.w)[which], spectrum(b.w)[which],
                        [&](const Place& p) { return spectrum(p.w)[which]; }),
                 PointKind::bifurcation);
        }
        for (double wanted : settings_.output) {
            const double left = a.parameter() - wanted, right = b.parameter() - wanted;
            if (wanted != settings_.from || branch_.steps > 1)
                if (left * right < 0 || right == 0) {
                    auto at = locate(a, step, left, right, [&](const Place& p) { return p.parameter() - wanted; });
                    if (at) at->second.w[last()] = wanted;
                    note(at, PointKind::regular);
                }
        }
        std::sort(found.begin(), found.end(), [](const auto& x, const auto& y) { return x.first < y.first; });
        for (auto& [distance, p] : found) {
            if (met_itself(*p.shape.space, p.shape.x, p.parameter)) break;
            p.index = p.kind == PointKind::regular
                          ? p.shape.negative_directions
                          : before + directions_without_mirror(problem_at(p.parameter), p.shape);
            branch_.points.push_back(std::move(p));
            settings_.found(branch_.points.back());
        }
        index_ = after;
        return complete;
    }

    // Whether the shape intersects itself; if so, sets the message of the branch.
    bool met_itself(const CurveSpace& space, const Eigen::VectorXd& x, double parameter) {
        const auto where = self_intersection(space, x);
        if (!where) return false;
        const CurveSample p = space.evaluate(x, (*where)[0]);
        branch_.message = fmt::format(
            "at parameter {:.6g} the shape intersects itself or crosses the axis at "
            "r = {:.4g}, z = {:.4g}",
            parameter, p.r, p.z);
        return true;
    }

    void output_at(double parameter) {
        for (double wanted : settings_.output)
            if (wanted == parameter) {
                branch_.points.push_back(point(place_, PointKind::regular));
                branch_.points.back().index = index_;
                settings_.found(branch_.points.back());
            }
    }

    // A shape to report; regular ones are found again with the parameter held, on meshes of their own.
    BranchPoint point(const Place& place, PointKind kind) {
        const int n = system_->space().size();
        BranchPoint out;
        out.kind = kind, out.parameter = place.parameter();
        const StationaryProblem problem = problem_at(out.parameter);
        system_->set_problem(problem);
        Equilibrium& e = out.shape;
        e.space = system_->space_handle(), e.x = curve(place.w), e.gauge = system_->gauge();
        e.sigma = place.w[n], e.lambda = place.w[n + 1], e.mu = place.w[system_->mu()];
        std::vector<double> defect;
        e.observed = system_->forms().observe(e.x, &defect);
        e.length = e.space->length(e.x.data());
        e.reference_energy = system_->forms().reference_energy(e.x);
        e.estimated_error = lost(defect) / e.reference_energy;
        e.stop = Stop::finished;
        if (kind == PointKind::regular) {
            EquilibriumSettings settings = settings_.shapes;
            settings.descend = false;
            const Equilibrium better = find_equilibrium(problem, e, settings);
            if (better.stop == Stop::finished) e = better;
        }
        return out;
    }

    // The error of the mesh, estimated from its jumps, which show a fifth of it on meshes that are just fine enough.
    static double lost(const std::vector<double>& defect) {
        double sum = 0;
        for (double d : defect) sum += d;
        return 5 * sum;
    }

    // Other elements when these are too coarse. False if there are none.
    bool remesh_if_needed() {
        const Eigen::VectorXd x = curve(place_.w);
        std::vector<double> defect;
        system_->forms().observe(x, &defect);
        const double allowed = std::max(settings_.shapes.accuracy, 1e-11) * system_->forms().reference_energy(x);
        if (lost(defect) <= allowed) return true;
        const SplineSpace& splines = system_->space().splines();
        std::vector<double> breaks = adapted_breaks(splines, defect, 0.02 * allowed, 8 / system_->space().images(),
                                                    settings_.shapes.max_elements + 1);
        if (static_cast<int>(breaks.size()) - 1 > settings_.shapes.max_elements) return false;
        const auto finer =
            std::make_shared<CurveSpace>(system_->space().topology(), breaks, splines.degree(), splines.smoothness(),
                                         system_->space().length(), system_->space().free_period());
        const int n = system_->space().size(), m = finer->size();
        const Eigen::VectorXd y = finer->prolong(system_->space(), x);
        const Eigen::VectorXd ahead = finer->prolong(system_->space(), x + place_.tangent.head(n));
        constexpr int others = StationarySystem::numbers + 1;
        Place moved{Eigen::VectorXd(m + others), Eigen::VectorXd(m + others)};
        moved.w << y, place_.w.tail(others);
        moved.tangent << ahead - y, place_.tangent.tail(others);
        const auto old = std::move(system_);
        system_ = std::make_unique<StationarySystem>(finer, old->problem(), old->gauge());
        place_ = moved;
        int iterations = 0;
        const auto corrected = advance(moved, 0, iterations);
        if (!corrected) return false;
        place_ = *corrected;
        return true;
    }

    StationaryProblem problem_;
    const SetParameter& set_;
    const BranchSettings& settings_;
    double range_, size_ = 1;
    std::unique_ptr<StationarySystem> system_;
    Place place_;
    int index_ = 0;
    SparseLu lu_;
    Branch branch_;
};

}  // namespace

Branch follow_branch(const StationaryProblem& problem, const Equilibrium& start, const SetParameter& set,
                     const BranchSettings& settings) {
    if (start.stop != Stop::finished) throw std::invalid_argument("a branch must start from an equilibrium");
    if (settings.from == settings.to) throw std::invalid_argument("the start and the end of a branch must differ");
    return Follower(problem, start, set, settings).run();
}

}  // namespace tubule::axisym
