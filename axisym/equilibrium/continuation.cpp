#include "axisym/equilibrium/continuation.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "axisym/curve/curve_measures.hpp"
#include "axisym/graph/graph_mesh.hpp"

namespace tubule::axisym {
namespace {

// What Follower asks for.
class CurveTier {
public:
    using Shape = Equilibrium;
    using Settings = EquilibriumSettings;

    CurveTier(const StationaryProblem& problem, const Equilibrium& start, const EquilibriumSettings& settings)
        : settings_(settings),
          size_(std::sqrt(start.observed.area)),
          system_(std::make_unique<StationarySystem>(start.space, problem, start.gauge)) {}

    StationarySystem& system() { return *system_; }
    const StationarySystem& system() const { return *system_; }
    SparseLu factors() const { return {}; }
    double size() const { return size_; }
    int index(const Eigen::VectorXd& u) const { return static_cast<int>((lowest(u, 0).array() < 0).count()); }
    Eigen::VectorXd lowest(const Eigen::VectorXd& u, int) const { return system_->variation(u).eigenvalues; }

    void leave(Place& place, int mode, double far) const {
        const int n = system_->space().size();
        const Eigen::VectorXd along = system_->variation(place.u(), mode).vectors.col(mode - 1);
        place.w.head(n) += far / along.cwiseAbs().maxCoeff() * along;
        place.tangent = Eigen::VectorXd::Zero(place.w.size());
        place.tangent.head(n) = along;
    }

    std::string meets_itself(const Eigen::VectorXd& u) const { return where(system_->space(), curve(u)); }
    std::string meets_itself(const Equilibrium& e) const { return where(*e.space, e.x); }

    double energy(const Equilibrium& e) const { return e.observed.energy; }
    int index_of(const BranchPoint& p, const StationaryProblem& problem, int before) const {
        return p.kind == PointKind::regular ? p.shape.negative_directions
                                            : before + directions_without_mirror(problem, p.shape);
    }

    // Regular shapes on meshes of their own; on this one where Newton's method fails there, as beside a fold.
    Equilibrium report(const Place& place, const StationaryProblem& problem, PointKind kind) const {
        const int n = system_->space().size();
        Equilibrium e;
        e.space = system_->space_handle(), e.x = curve(place.w), e.gauge = system_->gauge();
        e.sigma = place.w[n], e.lambda = place.w[n + 1], e.mu = place.w[system_->mu()];
        if (problem.beads) e.beads = place.w.segment<4>(system_->beads());
        e.rim = place.w.segment(system_->rim(), condition_count(problem.rings));
        std::vector<double> mesh_loss;
        e.observed = system_->forms().observe(e.x, &mesh_loss);
        e.length = system_->length(place.u());
        e.reference_energy = system_->forms().reference_energy(e.x);
        e.estimated_error = lost(mesh_loss) / e.reference_energy;
        e.stop = Stop::finished;
        if (kind != PointKind::regular) return e;
        EquilibriumSettings settings = settings_;
        settings.descend = false;
        Equilibrium better = find_equilibrium(problem, e, settings);
        if (better.stop == Stop::finished) return better;
        e.negative_directions = directions_down(*system_, place.u(), e, settings.accuracy);
        if (e.negative_directions < 0) e.estimated_error = 1;  // nothing is known
        return e;
    }

    // Other elements when these are too coarse.
    Renewal renew(Place& place) {
        const Eigen::VectorXd x = curve(place.w);
        std::vector<double> mesh_loss;
        system_->forms().observe(x, &mesh_loss);
        const double allowed = std::max(settings_.accuracy, 1e-11) * system_->forms().reference_energy(x);
        if (lost(mesh_loss) <= allowed) return Renewal::none;
        const SplineSpace& splines = system_->space().splines();
        std::vector<double> breaks = adapted_breaks(splines, mesh_loss, 0.02 * allowed, 8 / system_->space().images(),
                                                    settings_.max_elements + 1);
        if (static_cast<int>(breaks.size()) - 1 > settings_.max_elements) return Renewal::impossible;
        const auto finer =
            std::make_shared<CurveSpace>(system_->space().topology(), breaks, splines.degree(), splines.smoothness(),
                                         system_->space().length(), system_->space().free_period());
        const int n = system_->space().size(), m = finer->size();
        const Eigen::VectorXd y = finer->prolong(system_->space(), x);
        const Eigen::VectorXd ahead = finer->prolong(system_->space(), x + place.tangent.head(n));
        const int others = system_->numbers() + 1;
        Place moved{Eigen::VectorXd(m + others), Eigen::VectorXd(m + others)};
        moved.w << y, place.w.tail(others);
        moved.tangent << ahead - y, place.tangent.tail(others);
        place = std::move(moved);
        system_ = std::make_unique<StationarySystem>(finer, system_->problem(), system_->gauge());
        return Renewal::new_mesh;
    }
    std::string why_not_renewed(double parameter) const {
        return fmt::format("the mesh is too coarse at parameter {:.6g}, with the largest number of elements, {}",
                           parameter, settings_.max_elements);
    }

private:
    Eigen::VectorXd curve(const Eigen::VectorXd& w) const { return w.head(system_->space().size()); }

    static std::string where(const CurveSpace& space, const Eigen::VectorXd& x) {
        const auto at = self_intersection(space, x);
        if (!at) return {};
        const CurveSample p = space.evaluate(x, (*at)[0]);
        return fmt::format(" or crosses the axis at r = {:.4g}, z = {:.4g}", p.r, p.z);
    }

    // The error of the mesh, estimated from its jumps, which show a fifth of it on meshes that are just fine enough.
    static double lost(const std::vector<double>& mesh_loss) {
        double sum = 0;
        for (double d : mesh_loss) sum += d;
        return 5 * sum;
    }

    const EquilibriumSettings& settings_;
    double size_;
    std::unique_ptr<StationarySystem> system_;
};

}  // namespace

Branch follow_branch(const StationaryProblem& problem, const Equilibrium& start, const SetParameter& set,
                     const BranchSettings& settings) {
    check_branch(start.stop, settings.from, settings.to);
    CurveTier tier(problem, start, settings.shapes);
    return Follower(tier, problem, unknowns(problem, start), set, settings).run();
}

}  // namespace tubule::axisym
