// Stationary shapes of the bending energy, at given area, volume and period, or at a given tension, pressure and axial
// force of what is free: E + sigma A + lambda V - force L stationary.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>

#include "axisym/curve/bead_forms.hpp"
#include "axisym/curve/curve_forms.hpp"
#include "axisym/curve/rim_conditions.hpp"
#include "axisym/splines/arc_length.hpp"
#include "common/equilibrium/stationary_problem.hpp"
#include "common/solve/sparse.hpp"
#include "common/solve/stop.hpp"

namespace tubule::axisym {

// Eigenvalues, ascending, of which only the signs have a meaning of their own; and the directions of the first ones.
struct Variation {
    Eigen::VectorXd eigenvalues;
    Eigen::MatrixXd vectors;
};

// The equations F(u) = 0 of a stationary shape on one mesh; u holds the coefficients of the curve (the last of them the
// rise of a free period), then sigma, lambda, mu = alpha (M - M0) and the force that holds a whole cell in place along
// the axis (zero in the end), the numbers of beads, if there are any, and the multipliers of rim_functionals(). `gauge`
// is the weight of the gauge energy (CurveForms): the shape does not depend on it, up to the error of the mesh.
class StationarySystem {
public:
    // How many unknowns stand beside the curve.
    static int numbers(const StationaryProblem& problem) {
        return (problem.beads ? 8 : 4) + condition_count(problem.rings);
    }
    int numbers() const { return numbers(problem_); }
    // Throws as set_problem().
    StationarySystem(std::shared_ptr<const CurveSpace> space, const StationaryProblem& problem, double gauge);

    const CurveSpace& space() const { return *space_; }
    const std::shared_ptr<const CurveSpace>& space_handle() const { return space_; }
    const CurveForms& forms() const { return forms_; }
    const StationaryProblem& problem() const { return problem_; }
    // Throws as check_problem(), and where the period of the space is not free as the problem says.
    void set_problem(const StationaryProblem& problem);
    double gauge() const { return gauge_; }
    int unknowns() const { return space_->size() + numbers(); }
    int shape_size() const { return space_->size(); }
    int sigma() const { return space_->size(); }  // places in u
    int lambda() const { return space_->size() + 1; }
    int mu() const { return space_->size() + 2; }
    int beads() const { return space_->size() + 4; }
    int rim() const { return unknowns() - condition_count(problem_.rings); }
    // Makes mu and the positions of beads those of the curve; where their force is given, their multipliers, too.
    void set_followers(Eigen::VectorXd& u) const;
    // Those numbers of a change of u, zeros for the others.
    void follow(const Eigen::VectorXd& change, Eigen::VectorXd& out) const;

    // F(u), of unknowns() numbers.
    Eigen::VectorXd residual(const Eigen::VectorXd& u) const;
    // dF/du, with `damping` times the mass matrix added to the Hessian; compressed, of one pattern.
    Eigen::SparseMatrix<double> jacobian(const Eigen::VectorXd& u, double damping = 0) const;
    // E + gauge J + multipliers times the constraints they belong to: its derivative is F, where the constraints hold.
    double merit(const Eigen::VectorXd& u) const;
    // The second variation of that on the displacements (of coefficients) which keep the constraints and the place,
    // with this many of its vectors.
    Variation variation(const Eigen::VectorXd& u, int vectors = 0) const;

    // What Newton's method asks for (common/equilibrium/newton.hpp).
    Eigen::VectorXd constraint_residual(const Eigen::VectorXd& u) const;
    double constraint_error(const Eigen::VectorXd& u) const;
    Extents extents(const Eigen::VectorXd& u) const;
    double size(const Eigen::VectorXd& u) const;
    double length(const Eigen::VectorXd& u) const;  // L of theory.md (3.16)
    double reference_energy(const Eigen::VectorXd& u) const { return forms_.reference_energy(curve(u)); }
    bool admissible(const Eigen::VectorXd& u) const { return forms_.admissible(curve(u)); }
    bool rebase(const Eigen::VectorXd&) const { return false; }
    Eigen::VectorXd way_down(const Eigen::VectorXd& u) const;
    SparseLu factors() const { return {}; }

private:
    Eigen::VectorXd curve(const Eigen::VectorXd& u) const { return u.head(space_->size()); }
    MultiplierEquations equations(const CurveObservation& o, const Eigen::VectorXd& u) const {
        return multiplier_equations(problem_, o.area, o.volume, u[sigma()], u[lambda()]);
    }
    // Nothing but an equation holds a whole cell in its place.
    bool drifts() const {
        return space_->topology() == Topology::cell &&
               std::ranges::none_of(problem_.bending.potentials, &Potential::acts_along_axis);
    }
    void set_constraints(const CurveObservation& o, const Eigen::VectorXd& u, Eigen::VectorXd& F) const;
    Weights weights(const Eigen::VectorXd& u) const;
    Eigen::SparseMatrix<double> hessian(const Eigen::VectorXd& u) const;
    Eigen::VectorXd slope_of_M(const Eigen::VectorXd& x) const;
    BeadLoad bead_load() const { return {problem_.loads.force, problem_.held_distance()}; }
    BeadNumbers bead_numbers(const Eigen::VectorXd& u) const { return u.segment<4>(beads()); }

    std::shared_ptr<const CurveSpace> space_;
    StationaryProblem problem_;
    CurveForms forms_;
    std::optional<BeadForms> bead_forms_;
    double gauge_;
    Eigen::VectorXd place_;  // functional of the mean height
    Eigen::MatrixXd rim_;    // rim_functionals()
};

struct EquilibriumSettings {
    double accuracy = 1e-9;  // of the energy, relative to E_ref
    int degree = 5;
    int elements = 16;       // to begin with, of a whole cell
    int max_elements = 400;  // more are never taken
    double gauge = 0.01;     // weight of the gauge energy relative to E_ref; docs/decisions/equilibria.md
    bool descend = true;     // look for a minimum, from any start; if not, for any stationary shape near a good one
};

// Many fields: a shape, its multipliers, and how it was found.
struct Equilibrium {
    std::shared_ptr<const CurveSpace> space;
    Eigen::VectorXd x;
    double sigma = 0, lambda = 0, mu = 0;
    BeadNumbers beads = BeadNumbers::Zero();
    Eigen::VectorXd rim{};  // multipliers of rim_functionals()
    double gauge = 0;
    CurveObservation observed;
    double length = 0;                                 // L of theory.md (3.16): of the period, or of beads; else 0
    double reference_energy = 0, estimated_error = 0;  // the latter relative to the former
    int iterations = 0;                                // of Newton, over all meshes
    // Axisymmetric displacements, under what is held, that lower the energy: 0 at a minimum. Of a shape that was found.
    int negative_directions = 0;
    // finished; or why this is not an equilibrium: solver_failed, resolution_lost, self_intersection.
    Stop stop = Stop::solver_failed;
    std::string message;
};

// From a curve. A problem without constraints is that of a free membrane. Throws std::invalid_argument
// for constraints that contradict each other or cannot be met, and for a period that is not half a tube.
Equilibrium find_equilibrium(const StationaryProblem& problem, const Curve& start,
                             const EquilibriumSettings& settings = {});
// From an equilibrium of a nearby problem: its mesh and its parametrisation.
Equilibrium find_equilibrium(const StationaryProblem& problem, const Equilibrium& nearby,
                             const EquilibriumSettings& settings = {});

// u of a StationarySystem on its mesh.
Eigen::VectorXd unknowns(const StationaryProblem& problem, const Equilibrium& shape);

// Those of a problem with beads; the space must outlive them.
BeadForms bead_forms(const CurveSpace& space, const StationaryProblem& problem);

// The axial force of an equilibrium, theory.md (3.19): given, or what holds a period, the distance of beads or the
// second ring of a patch.
double axial_force(const StationaryProblem& problem, const Equilibrium& shape);

// Directions of half a curve that lower the energy and do not mirror themselves, 10 at most; 0 of a whole curve.
int directions_without_mirror(const StationaryProblem& problem, const Equilibrium& shape);

// Directions that lower the energy of a shape that was found, those of half a curve that do not mirror themselves among
// them; -1 where coefficients and normal displacements count differently, since the mesh does not resolve the shape.
int directions_down(const StationarySystem& system, const Eigen::VectorXd& u, const Equilibrium& shape,
                    double accuracy);

}  // namespace tubule::axisym
