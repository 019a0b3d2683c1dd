// The equations of a stationary surface on one mesh, for Newton's method (common/equilibrium/newton.hpp).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "common/equilibrium/stationary_problem.hpp"
#include "common/solve/bordered_ldlt.hpp"
#include "surface3d/equilibrium/discrete_energy.hpp"
#include "surface3d/equilibrium/surface_spectrum.hpp"
#include "surface3d/fem/places.hpp"

namespace tubule::surface3d {

// The beads of a surface, zeros without any; of a tube the force that holds its period.
struct BeadState {
    BeadNumbers numbers = BeadNumbers::Zero();
    double force = 0, coarseness = 0;  // see fem/places.hpp
};

// u holds the displacements w_i along the normals of a base mesh, of a free period the stretch, then sigma, lambda, mu
// = alpha (M - M0), the numbers of beads, if there are any, and one multiplier for each motion that costs no energy and
// is held: rigid ones, and where the energy has them dilations and conformal maps. These multipliers vanish up to the
// error of the mesh.
class SurfaceSystem {
public:
    static constexpr int most_motions = 10;

    // Throws as check_problem(). H0: at the nodes, where it varies.
    SurfaceSystem(const CurvedMesh& base, const StationaryProblem& problem, const Eigen::VectorXd& H0 = {});

    const StationaryProblem& problem() const { return problem_; }
    void set_problem(const StationaryProblem& problem);
    int unknowns() const { return motions() + most_motions; }
    int shape_size() const { return space().size() + problem_.free_period; }
    int sigma() const { return shape_size(); }
    int lambda() const { return shape_size() + 1; }
    int mu() const { return shape_size() + 2; }
    int beads() const { return mu() + 1; }
    int motions() const { return beads() + (beads_ ? 4 : 0); }
    void set_followers(Eigen::VectorXd& u) const;
    void follow(const Eigen::VectorXd& change, Eigen::VectorXd& out) const {
        out.segment(mu(), motions() - mu()) = change.segment(mu(), motions() - mu());
    }

    Eigen::VectorXd residual(const Eigen::VectorXd& u) const;
    Eigen::SparseMatrix<double> jacobian(const Eigen::VectorXd& u, double damping) const;
    Eigen::VectorXd constraint_residual(const Eigen::VectorXd& u) const;
    double constraint_error(const Eigen::VectorXd& u) const;
    double merit(const Eigen::VectorXd& u) const;
    Extents extents(const Eigen::VectorXd& u) const;
    double size(const Eigen::VectorXd& u) const;
    double length(const Eigen::VectorXd& u) const;  // L of theory.md (3.16)
    BeadNumbers bead_numbers(const Eigen::VectorXd& u) const {
        return beads_ ? BeadNumbers(u.segment<4>(beads())) : BeadNumbers(BeadNumbers::Zero());
    }
    // The longest edge near a bead, over the width of its weight and the order: how far apart nodes are there.
    double bead_coarseness(const Eigen::VectorXd& u) const;
    double bead_force(const Eigen::VectorXd& u) const { return beads_ ? beads_->force(on(u), bead_numbers(u)) : 0; }
    // Between beads, or dE/dL of a tube with its multipliers; theory.md (3.19).
    double axial_force(const Eigen::VectorXd& u) const;
    BeadState bead_state(const Eigen::VectorXd& u) const {
        return {bead_numbers(u), axial_force(u), bead_coarseness(u)};
    }
    double reference_energy(const Eigen::VectorXd& u) const;
    bool admissible(const Eigen::VectorXd& u) const;
    // Makes the shape the base; on a new mesh where its triangles have become bad, or about this many are asked for.
    // Whether that was so, and u has another size. `along`, a change of the shape's unknowns, stays the same motion.
    bool rebase(Eigen::VectorXd& u, Eigen::VectorXd* along = nullptr, int triangles = 0);
    Eigen::VectorXd way_down(const Eigen::VectorXd& u) const;
    BorderedLdlt factors(int more = 0) const { return BorderedLdlt(ordering_, unknowns() - shape_size() + more); }

    // The multipliers of the given shape, by least squares: u with w = 0.
    Eigen::VectorXd unknowns_at_base() const;
    CurvedMesh mesh(const Eigen::VectorXd& u) const;
    const CurvedMesh& base() const { return base_; }
    const DiscreteEnergy& energy() const { return *energy_; }
    const SurfaceSpace& space() const { return energy_->space(); }
    // E, without multipliers; area differences included.
    EnergyValues values(const Eigen::VectorXd& u) const;
    // The second variation under what is held, of displacements that are no held motion; `count` lowest.
    SurfaceSpectrum spectrum(const Eigen::VectorXd& u, int count) const;
    // The slowest modes of a law, minus their rates as values: of gradient flow those above, else of the flow that
    // follows, which keeps what the law keeps.
    SurfaceSpectrum modes(const Eigen::VectorXd& u, const MotionLaw& law, int count) const;
    // Its negative directions alone.
    int index(const Eigen::VectorXd& u) const;
    // The wave number m around the axis of a surface of revolution of each displacement of the nodes, one column each,
    // if that has one; -1 where there is none.
    std::vector<int> wave_numbers(const Eigen::VectorXd& u, const Eigen::MatrixXd& displacements) const;
    int held_motions() const { return static_cast<int>(without_cost_.functionals[without_cost_.on_axis].cols()); }

private:
    Bending bending(const Eigen::VectorXd& u) const;
    BeadSurface on(const Eigen::VectorXd& u) const;
    BeadLoad bead_load() const { return {problem_.loads.force, problem_.held_distance()}; }
    MultiplierEquations equations(const EnergyValues& v, const Eigen::VectorXd& u) const;
    void set_constraints(const EnergyValues& v, const Eigen::VectorXd& u, Eigen::VectorXd& F) const;
    const EnergyDerivatives& derivatives(const Eigen::VectorXd& u) const;
    const EnergyValues& sums(const Eigen::VectorXd& u) const;  // without area differences
    ConstrainedForm second_variation(const Eigen::VectorXd& u, const Constraints& held) const;
    ConstrainedForm second_variation(const Eigen::VectorXd& u) const {
        return second_variation(u, problem_.constraints);
    }
    Eigen::MatrixXd rigid_motions(const CurvedMesh& mesh, bool on_axis) const;
    bool is_on_axis(const Eigen::VectorXd& u) const { return hold_axis(problem_, bead_force(u), size(u), scale_); }
    double stiffness(const Eigen::VectorXd& u) const;  // a size of its eigenvalues
    bool take_new_mesh(const CurvedMesh& shape, int triangles, Eigen::VectorXd& u, Eigen::VectorXd* along);
    void set_mesh(const CurvedMesh& mesh, double force);
    void set_base(const CurvedMesh& mesh, double force);
    void set_motions();
    void set_turn(const Eigen::MatrixXd& rigid, const Eigen::Vector3d& centre, double size, double least);

    StationaryProblem problem_;
    CurvedMesh base_;
    Eigen::VectorXd H0_;
    std::shared_ptr<DiscreteEnergy> energy_;
    std::optional<BeadEquations> beads_;
    Ordering ordering_;  // of the shape's unknowns
    Directions directions_;
    Eigen::SparseMatrix<double> mass_;
    // The turn x -> velocity + omega x x, |omega| = 1, that leaves the base as it is, if there is exactly one.
    struct Turn {
        Eigen::Vector3d velocity, omega;
    };
    std::optional<Turn> turn_;
    // Functionals of w, one column each, that hold the motions without cost; orthonormal. The second ones are for beads
    // that hold the surface on their axis, as those of the base do or, as far as their force is known, do not.
    struct {
        std::array<Eigen::MatrixXd, 2> functionals;
        bool on_axis = false;
    } without_cost_;
    double scale_ = 0;  // reference energy of the base
    // The last derivatives and sums, and where they were taken: these at a shape.
    mutable Eigen::VectorXd at_, sums_at_;
    mutable std::optional<EnergyDerivatives> last_;
    mutable std::optional<EnergyValues> sums_;
};

// Unit normals at the nodes: means over the triangles around them.
VectorField node_normals(const SurfaceSpace& space, const CurvedMesh& mesh);

}  // namespace tubule::surface3d
