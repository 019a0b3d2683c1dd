// One step in time of a moving surface, linearly implicit: solved on the surface that is expected in it, by backward
// differences or the generalised alpha method, both of second order.
#pragma once

#include <memory>
#include <optional>

#include "common/case/surface_choices.hpp"
#include "common/solve/bordered.hpp"
#include "common/solve/gmres.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/mesh/curved_mesh.hpp"
#include "surface3d/motion/mesh_motion.hpp"
#include "surface3d/motion/motion_forms.hpp"

namespace tubule::surface3d {

// Area and volume (of one period), or changes of them.
struct Extent {
    double area = 0, volume = 0;
};

// Pressure and the multiplier of the volume.
struct Multipliers {
    double time = 0;
    Eigen::VectorXd p;
    double lambda = 0;
};

// Nodal values at a time, and what the next step needs of the one before.
struct MotionState {
    double time = 0;
    double step = 0;             // that led here; 0 at the start: then there is no past
    VectorField X, w;            // positions, their velocity
    Eigen::VectorXd u;           // velocity as in MotionUnknowns, component by component
    VectorField X_past, w_past;  // at time - step
    Eigen::VectorXd u_past;
    VectorField X_rate;  // of scheme alpha: the rates that it carries on
    Eigen::VectorXd u_rate;
    double lag = 0;      // they are those of so much before `time`
    Eigen::VectorXd p;   // pressure, at the nodes of its own order
    double lambda = 0;   // multiplier of the volume
    Multipliers solved;  // of scheme alpha: the same where the step was solved
    Extent missed;       // of scheme alpha: what the linear system of a step is expected to miss of area and volume
};

// With so many components of the velocity at a node, and so many pressures.
MotionState at_rest(const CurvedMesh& mesh, int components, int pressures);

// Whether positions, velocities and multipliers are numbers.
bool is_finite(const MotionState& state);

// What is kept on the way, and how the mesh moves.
struct MotionControl {
    std::optional<double> area, volume;  // kept to rounding, where the law has the multiplier
    double relaxation = 0.1;             // time in which the mesh becomes even
    bool follow_curvature = false;       // or one whose triangles are small where the surface is curved
    // Where 1 - (INT H)^2/(A INT H^2) is less, area and volume are one condition as far as the mesh can tell: lambda is
    // left out, as the pressure stands for it, and the area alone is kept to rounding.
    double least_variation = 1e-8;
    Scheme scheme = Scheme::bdf2;
};

struct MotionStep {
    MotionState state;
    double error = 0;       // of the positions over this step along the normal, largest, estimated
    double correction = 0;  // energy that keeping area and volume took
};

class MotionStepper {
public:
    MotionStepper(const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending, const MotionControl& control);

    // SolveError where a system cannot be solved, or area or volume cannot be kept to 1e-8.
    MotionStep step(const MotionState& from, double tau);

    // At rest, with the area and volume that are kept: what a new mesh lacks of them, a short step would make up for
    // at great speed. SolveError as in a step.
    MotionState start(const CurvedMesh& mesh);
    // The same with a velocity as in MotionState, with which nodes begin to move, too: a first step from nodes at rest
    // would not bend the surface. With a rigid motion added that makes `momenta` what is given, if anything is.
    MotionState start(const CurvedMesh& mesh, const Eigen::VectorXd& u, const Eigen::VectorXd& momenta = {});
    // Momentum and angular momentum but for the density (a tube: about its axis alone), which friction alone changes;
    // empty where there is no inertia.
    Eigen::VectorXd momenta(const MotionState& state) const;
    CurvedMesh mesh(const VectorField& X) const { return with_nodes(mesh_, X); }
    // Velocities of the surface at the nodes.
    VectorField velocity(const MotionState& state, const MotionFields& fields) const;

    // At the nodes of the mesh.
    Eigen::VectorXd pressure_at_nodes(const MotionState& state) const;

    const SurfaceSpace& space() const { return space_; }
    const MotionUnknowns& unknowns() const { return unknowns_; }
    const StepSystem& system() const { return system_; }  // of the last step, rows scaled to be almost symmetric
    const SurfaceLaw& law() const { return law_; }
    MotionFields fields(const CurvedMesh& mesh);
    // (u.nu, phi) of a velocity as in MotionState.
    Eigen::VectorXd flux(const Eigen::VectorXd& u, const CurvedMesh& mesh, const MotionFields& fields) const;

private:
    bool area_is_volume(const CurvedMesh& mesh, const MotionFields& fields) const;
    struct Formula;
    bool has_past(const MotionState& from) const;
    static Formula euler(const MotionState& from, double tau);
    static Formula bdf2(const MotionState& from, double tau);
    static Formula alpha(const MotionState& from, double tau, double radius);
    double wave_factor(const MotionState& from, double tau) const;
    Extent wanted_rate(const MotionState& from, const Formula& f, double tau, const CurvedMesh& at) const;
    Eigen::VectorXd solve(const StepBase& base, const Extent& rate, bool with_lambda, double& lambda);
    Eigen::VectorXd mesh_flux(const StepBase& base, const Eigen::VectorXd& u);
    Extent expected_miss(const MotionState& from, const MotionState& to) const;
    void finish(const MotionState& from, const Formula& f, MotionState& to) const;
    void make_symmetric(const StepBase& base);
    Eigen::MatrixXd rigid_motions(const CurvedMesh& mesh) const;
    Eigen::MatrixXd momenta(const CurvedMesh& mesh, const Eigen::MatrixXd& motions) const;
    Eigen::VectorXd momenta_after(const MotionState& from, double tau) const;
    void keep_momenta(const Eigen::VectorXd& kept, double te, MotionState& to) const;
    Extent lack(const CurvedMesh& mesh) const;
    VectorField correction(const VectorField& X, const MotionFields& fields, bool with_volume) const;
    double work(const VectorField& displacement, const MotionFields& fields) const;

    CurvedMesh mesh_;
    SurfaceSpace space_;
    SurfaceLaw law_;
    Bending bending_;
    MotionControl control_;
    MotionUnknowns unknowns_;
    MeshMotion mesh_motion_;
    StepSystem system_;
    BorderedSolver solver_;
    Gmres gmres_;
    bool holds_rigid_motions_ = false;
    std::optional<Projection> projection_;
};

Extent extent(const SurfaceSpace& space, const CurvedMesh& mesh);
// Its change with displacements d of the nodes: (div_P d, 1) and (d.nu, 1).
Extent extent_rate(const SurfaceSpace& space, const CurvedMesh& mesh, const VectorField& d);

}  // namespace tubule::surface3d
