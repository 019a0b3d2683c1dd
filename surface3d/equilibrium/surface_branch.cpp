#include "surface3d/equilibrium/surface_branch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/equilibrium/newton.hpp"
#include "surface3d/mesh/curved_intersection.hpp"
#include "surface3d/meshing/remesh.hpp"

namespace tubule::surface3d {
namespace {

constexpr double finer_by = 1.8;      // triangles of a finer mesh over those of the one before
constexpr double refined_bead = 0.5;  // before coarsest_place

// What Follower asks for. The unknowns are displacements of a base that follows the branch.
class SurfaceTier {
public:
    using Shape = SurfaceEquilibrium;
    using Settings = SurfaceEquilibriumSettings;

    // `leaves`: it begins at a bifurcation.
    SurfaceTier(const StationaryProblem& problem, const SurfaceEquilibrium& start, const Settings& settings,
                bool leaves)
        : settings_(settings), system_(start.mesh, problem, start.H0), start_(system_.unknowns_at_base()) {
        start_[system_.sigma()] = start.sigma, start_[system_.lambda()] = start.lambda;
        if (problem.beads) start_.segment<4>(system_.beads()) = start.beads.numbers;
        size_ = system_.size(start_);
        // The penalty on kinks belongs to the base, which was another one. At a bifurcation the matrix may be singular.
        int iterations = 0;
        if (!Newton(system_, start_, iterations).converge(0.1) && !leaves)
            throw SolveError("the first shape cannot be corrected");
        most_kinks_ = std::max(settings.accuracy, 2 * kinks(start_));
        triangles_ = start.mesh.triangles();
    }

    const Eigen::VectorXd& start() const { return start_; }
    SurfaceSystem& system() { return system_; }
    const SurfaceSystem& system() const { return system_; }
    BorderedLdlt factors() const { return system_.factors(1); }
    double size() const { return size_; }
    int index(const Eigen::VectorXd& u) const { return system_.index(u); }
    // One more than asked for: the last one is the least accurate.
    Eigen::VectorXd lowest(const Eigen::VectorXd& u, int count) const { return system_.spectrum(u, count + 1).values; }

    // The displaced shape becomes the base, so that its turns, which were none on a surface of revolution, are held.
    void leave(Place& place, int mode, double far) {
        Eigen::VectorXd u = place.u();
        Eigen::VectorXd along = system_.spectrum(u, mode + 1).vectors.col(mode - 1);
        u.head(along.size()) += far / along.head(system_.space().size()).cwiseAbs().maxCoeff() * along;
        const double parameter = place.parameter();
        system_.rebase(u, &along);
        u.tail(SurfaceSystem::most_motions).setZero();
        place.w.resize(u.size() + 1);
        place.w << u, parameter;
        place.tangent = Eigen::VectorXd::Zero(place.w.size());
        place.tangent.head(along.size()) = along;
    }

    std::string meets_itself(const Eigen::VectorXd& u) const { return where(system_.mesh(u)); }
    std::string meets_itself(const SurfaceEquilibrium& e) const { return where(e.mesh); }

    double energy(const SurfaceEquilibrium& e) const { return e.values.energy; }
    int index_of(const BranchPoint& p, const StationaryProblem&, int before) const {
        return p.kind == PointKind::regular ? p.shape.spectrum.negative : before;
    }

    SurfaceEquilibrium report(const Place& place, const StationaryProblem& problem, PointKind kind) const {
        const Eigen::VectorXd u = place.u();
        SurfaceEquilibrium e;
        e.mesh = system_.mesh(u);
        e.sigma = u[system_.sigma()], e.lambda = u[system_.lambda()], e.mu = u[system_.mu()];
        e.beads = system_.bead_state(u);
        e.values = system_.values(u);
        e.reference_energy = reference_energy(problem, system_, u);
        e.estimated_error = std::max(settings_.accuracy, e.values.kinks / e.reference_energy);
        e.held_motions = system_.held_motions();
        e.stop = Stop::finished;
        if (kind == PointKind::regular) {
            Settings settings = settings_;
            settings.descend = false, settings.near = true;
            settings.first_triangles = static_cast<int>(e.mesh.triangles() / finer_by);
            SurfaceEquilibrium better = find_equilibrium(
                problem, [&](int triangles) { return meshed(e.mesh, triangles); }, settings);
            // Close to a bifurcation other meshes may lead to the other branch.
            const bool found = better.stop == Stop::finished;
            if (found && better.spectrum.negative == system_.index(u)) return better;
            const double apart = std::abs(better.values.energy - e.values.energy) / e.reference_energy;
            e.estimated_error = std::max(e.estimated_error, found ? apart : better.estimated_error);
        }
        e.spectrum = system_.modes(u, settings_.law, settings_.modes);
        if (settings_.modes > 0) e.wave_numbers = system_.wave_numbers(u, e.spectrum.vectors.topRows(e.mesh.size()));
        return e;
    }

    Renewal renew(Place& place) {
        Eigen::VectorXd u = place.u();
        Eigen::VectorXd along = place.tangent.head(system_.shape_size());
        Eigen::VectorXd others = place.tangent.tail(place.tangent.size() - along.size());
        others.segment(system_.motions() - system_.shape_size(), SurfaceSystem::most_motions).setZero();
        const bool finer = kinks(u) > most_kinks_ || system_.bead_coarseness(u) > refined_bead;
        const int triangles = finer ? static_cast<int>(finer_by * system_.base().triangles()) : triangles_;
        if (triangles > settings_.max_triangles) return Renewal::impossible;
        const double parameter = place.parameter();
        const bool remeshed = system_.rebase(u, &along, finer ? triangles : 0);
        if (finer && !remeshed) return Renewal::impossible;
        u.tail(SurfaceSystem::most_motions).setZero();
        place.w.resize(u.size() + 1), place.tangent.resize(u.size() + 1);
        place.w << u, parameter;
        place.tangent << along, others;
        return remeshed ? Renewal::new_mesh : Renewal::same_size;
    }
    std::string why_not_renewed(double parameter) const {
        return fmt::format(
            "the mesh of {} triangles does not resolve the shape at parameter {:.6g}, and there is no "
            "better one of at most {}",
            system_.base().triangles(), parameter, settings_.max_triangles);
    }

private:
    double kinks(const Eigen::VectorXd& u) const { return system_.values(u).kinks / system_.reference_energy(u); }

    static std::string where(const CurvedMesh& mesh) {
        const auto x = first_intersection(mesh);
        return x ? fmt::format(" near ({:.4g}, {:.4g}, {:.4g})", (*x)[0], (*x)[1], (*x)[2]) : "";
    }
    // The shape itself where it cannot be meshed otherwise.
    static CurvedMesh meshed(const CurvedMesh& shape, int triangles) {
        auto made = remesh(shape, Eigen::MatrixXd(0, shape.size()), {.triangles = triangles});
        auto* found = std::get_if<Remeshed>(&made);
        return found ? std::move(found->mesh) : shape;
    }

    const Settings& settings_;
    SurfaceSystem system_;
    Eigen::VectorXd start_;
    double size_ = 1;
    double most_kinks_ = 0;  // energy of the penalty, relative to all, that a mesh may have
    int triangles_ = 0;
};

}  // namespace

Branch follow_branch(const StationaryProblem& problem, const SurfaceEquilibrium& start, const SetParameter& set,
                     const BranchSettings& settings) {
    check_branch(start.stop, settings.from, settings.to);
    try {
        SurfaceTier tier(problem, start, settings.shapes, settings.mode > 0);
        return Follower(tier, problem, tier.start(), set, settings).run();
    } catch (const SolveError& error) {
        Branch broken;
        broken.stop = Stop::solver_failed, broken.message = error.what();
        return broken;
    }
}

}  // namespace tubule::surface3d
