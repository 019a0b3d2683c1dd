#include "surface3d/equilibrium/surface_equilibrium.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/equilibrium/newton.hpp"
#include "surface3d/fem/mesh_quality.hpp"
#include "surface3d/meshing/remesh.hpp"

namespace tubule::surface3d {
namespace {

constexpr double refinement = 1.8;  // triangles of a mesh over those of the one before
constexpr double least_quality = 0.3;
constexpr int most_attempts = 5;  // meshes on which no shape is found
// The error of an energy over that of the penalty: on 19 meshes 1.9 to 5.4, above 3.3 only where the energies of meshes
// differ by more.
constexpr double error_of_kinks = 3.5;

CurvedMesh scaled_to(CurvedMesh mesh, const StationaryProblem& problem) {
    const Constraints& c = problem.constraints;
    if (mesh.period > 0 || !(c.area || c.volume)) return mesh;
    const EnergyValues v = DiscreteEnergy(mesh, problem.bending).values(mesh, problem.bending);
    const double factor = c.area ? std::sqrt(*c.area / v.area) : std::cbrt(*c.volume / v.volume);
    for (Eigen::Vector3d& x : mesh.nodes) x *= factor;
    return mesh;
}

// The search on one mesh after the other.
class Search {
public:
    Search(const StationaryProblem& problem, const SurfaceEquilibriumSettings& settings)
        : problem_(problem), settings_(settings) {}

    SurfaceEquilibrium run(const MakeMesh& initial) {
        const bool given = settings_.triangles > 0;
        int triangles =
            given ? std::max(static_cast<int>(settings_.triangles / refinement), 40) : settings_.first_triangles;
        for (;;) {
            SurfaceSystem system(next_mesh(initial, triangles), problem_);
            Eigen::VectorXd u = system.unknowns_at_base();
            if (rounds_ == 0) {
                first_ = system.extents(u);
                keep(system, u);
                if (out_.mesh.period == 0 && begins_at_sphere(problem_.constraints, first_.area, first_.volume, 1e-4))
                    return end(Stop::solver_failed, why_no_sphere("an ellipsoid or a sphere with waves"));
            }
            if (out_.stop == Stop::finished) u.tail(multipliers_.size()) = multipliers_;
            const bool far = out_.stop != Stop::finished && !settings_.near;
            const bool sound = system.admissible(u);
            bool found = sound && settle(system, u, far, settings_.descend, out_.iterations);
            if (found && problem_.held_distance()) {  // its force, known now, may hold the surface on the axis
                system.rebase(u);
                found = settle(system, u, false, settings_.descend, out_.iterations);
            }
            out_.stop = found ? Stop::finished : sound ? Stop::solver_failed : Stop::mesh_lost;
            keep(system, u);
            ++rounds_;
            const bool enough = given ? rounds_ > 1 : found && out_.estimated_error <= settings_.accuracy && resolved();
            triangles =
                given ? settings_.triangles : static_cast<int>(refinement * std::max(triangles, out_.mesh.triangles()));
            if (enough || triangles > settings_.max_triangles || (!found && !given && rounds_ == most_attempts))
                return found ? finish(system, u) : end(out_.stop, why_none(system, u));
            if (found) remember(system, u);
        }
    }

private:
    // Meshes the shape found last; the initial one where there is none, and where that is nearer than a new mesh of
    // the old one. A mesh that cannot be made coarser for the comparison is replaced in the first round.
    CurvedMesh next_mesh(const MakeMesh& initial, int triangles) const {
        if (out_.stop == Stop::finished && !settings_.near)
            if (auto finer = remeshed(out_.mesh, triangles)) return std::move(*finer);
        CurvedMesh mesh = scaled_to(initial(triangles), problem_);
        if (rounds_ == 0 && settings_.triangles > 0 && mesh.triangles() > 1.3 * triangles)
            if (auto coarser = remeshed(mesh, triangles)) return std::move(*coarser);
        return mesh;
    }

    static std::optional<CurvedMesh> remeshed(const CurvedMesh& mesh, int triangles) {
        auto made = remesh(mesh, Eigen::MatrixXd(0, mesh.size()), {.triangles = triangles, .quality = least_quality});
        if (auto* found = std::get_if<Remeshed>(&made)) return std::move(found->mesh);
        return {};
    }

    void keep(const SurfaceSystem& system, const Eigen::VectorXd& u) {
        out_.mesh = system.mesh(u);
        out_.sigma = u[system.sigma()], out_.lambda = u[system.lambda()], out_.mu = u[system.mu()];
        out_.beads = system.bead_state(u);
        out_.values = system.values(u);
        out_.reference_energy = reference_energy(problem_, system, u);
        out_.held_motions = system.held_motions();
        multipliers_ = u.tail(u.size() - system.shape_size());
        if (out_.stop != Stop::finished) {
            before_.reset(), out_.estimated_error = 1;
            return;
        }
        if (before_) {
            // A mesh may be no better than the coarser one, but its edges say so.
            const double apart = error_since(Eigen::VectorXd::Constant(1, before_->energy),
                                             Eigen::VectorXd::Constant(1, energy_of(system, u)))[0];
            out_.estimated_error = std::max(apart, error_of_kinks * out_.values.kinks) / out_.reference_energy;
        }
    }

    double energy_of(const SurfaceSystem& system, const Eigen::VectorXd& u) const {
        return out_.values.energy + problem_.loads.energy(out_.values.area, out_.values.volume, system.length(u));
    }

    Eigen::VectorXd error_since(const Eigen::VectorXd& before, const Eigen::VectorXd& now) const {
        return errors_between(before, before_->triangles, now, out_.mesh.triangles(), out_.mesh.order);
    }

    // What the next mesh is compared with.
    void remember(const SurfaceSystem& system, const Eigen::VectorXd& u) {
        before_ = {energy_of(system, u), out_.mesh.triangles(), {}};
        if (settings_.modes > 0) try {
                before_->spectrum = system.modes(u, settings_.law, settings_.modes);
            } catch (const SolveError&) {  // the errors remain unknown
            }
    }

    SurfaceEquilibrium finish(const SurfaceSystem& system, const Eigen::VectorXd& u) {
        try {
            out_.spectrum = system.modes(u, settings_.law, settings_.modes);
            if (before_)
                set_errors(before_->spectrum, before_->triangles, out_.spectrum, out_.mesh.triangles(),
                           out_.mesh.order);
            if (settings_.modes > 0)
                out_.wave_numbers = system.wave_numbers(u, out_.spectrum.vectors.topRows(out_.mesh.size()));
        } catch (const SolveError& error) {
            return end(Stop::solver_failed, fmt::format("the second variation: {}", error.what()));
        }
        if (settings_.triangles == 0 && out_.estimated_error > settings_.accuracy)
            return end(Stop::resolution_lost, fmt::format("with {} triangles, the error of the energy is still {:.1e}",
                                                          out_.mesh.triangles(), out_.estimated_error));
        if (!resolved())
            return end(Stop::resolution_lost,
                       fmt::format("with {} triangles, nodes near a bead are {:.2g} times model.bead_width apart",
                                   out_.mesh.triangles(), out_.beads.coarseness));
        if (!out_.spectrum.doubt.empty())
            return end(Stop::resolution_lost, "the stability is undetermined: " + out_.spectrum.doubt);
        return end(Stop::finished, "");
    }

    bool resolved() const { return out_.beads.coarseness <= coarsest_place; }

    SurfaceEquilibrium end(Stop stop, std::string message) {
        out_.stop = stop, out_.message = std::move(message);
        return std::move(out_);
    }

    std::string why_none(const SurfaceSystem& system, const Eigen::VectorXd& u) const {
        if (out_.stop == Stop::mesh_lost)
            return fmt::format(
                "the mesh of the initial shape has bad triangles (quality {:.2g}) or kinks, or is behind a wall",
                mesh_quality(out_.mesh).worst);
        return tubule::why_none(problem_.constraints, first_, system.extents(u), true, out_.iterations);
    }

    const StationaryProblem& problem_;
    const SurfaceEquilibriumSettings& settings_;
    SurfaceEquilibrium out_;
    Extents first_{};
    int rounds_ = 0;
    Eigen::VectorXd multipliers_;
    struct Before {
        double energy;
        int triangles;
        SurfaceSpectrum spectrum;
    };
    std::optional<Before> before_;  // on the mesh before
};

}  // namespace

SurfaceEquilibrium find_equilibrium(const StationaryProblem& problem, const MakeMesh& initial,
                                    const SurfaceEquilibriumSettings& settings) {
    return Search(problem, settings).run(initial);
}

double reference_energy(const StationaryProblem& problem, const SurfaceSystem& system, const Eigen::VectorXd& u) {
    const EnergyValues v = system.values(u);
    return reference_energy(problem, v.energy, system.reference_energy(u), {v.area, v.volume, system.length(u)});
}

}  // namespace tubule::surface3d
