// A surface in motion on one mesh, without a time scheme: its fields, the motion of its nodes, and the conserved area,
// volume and momenta. Time schemes and measurements are built on it.
#pragma once

#include <cstdint>
#include <optional>

#include "common/energy/bending.hpp"
#include "surface3d/fem/places.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/mesh/curved_mesh.hpp"
#include "surface3d/motion/extent.hpp"
#include "surface3d/motion/mesh_motion.hpp"
#include "surface3d/motion/motion_fields.hpp"
#include "surface3d/motion/motion_state.hpp"
#include "surface3d/motion/surface_law.hpp"

namespace tubule::surface3d {

// What is conserved, and how the mesh moves.
struct MotionControl {
    std::optional<double> area = {}, volume = {};  // conserved to rounding, where the law has the multiplier
    double distance = 0;                           // of beads, without its extension
    double relaxation = 0.1;                       // time in which the mesh becomes even
    bool follow_curvature = false;                 // or small triangles where the surface is curved
    // If 1 - (INT H)^2/(A INT H^2) is smaller and the volume cannot drift by more than most_drift, relatively, area and
    // volume are the same condition: lambda is omitted, the pressure takes its place, and only the area is conserved to
    // rounding.
    double least_variation = 1e-8, most_drift = HUGE_VAL;
    double smoothing = 0;  // of schemes that smooth curvatures: eps of a - eps Lap a = a_h, a length squared
};

// What the linear systems of steps took.
struct LinearWork {
    std::int64_t solves = 0, iterations = 0;  // of GMRES
    std::int64_t lu = 0;                      // solved by LU factors, since GMRES did not converge
};

class MovingSurface {
public:
    // A law that does not resist rigid motions gets a slight friction, and rigid motions are set to zero.
    MovingSurface(const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending, const MotionControl& control);

    // A state at rest at a time, corrected to the area, volume and distance that are kept: otherwise a short first step
    // would correct the defect of a new mesh at high speed. SolveError if they cannot be met to 1e-8.
    MotionState start(const CurvedMesh& mesh, double time = 0);
    // The same with a velocity as in MotionState, with which the nodes start to move, too: a first step from nodes at
    // rest would not bend the surface. If `momenta` is not empty, a rigid motion is added to obtain these.
    MotionState start(const CurvedMesh& mesh, const Eigen::VectorXd& u, const Eigen::VectorXd& momenta = {},
                      double time = 0);

    const SurfaceSpace& space() const { return space_; }
    const SurfaceLaw& law() const { return law_; }
    const Bending& bending() const { return bending_; }
    const MotionControl& control() const { return control_; }
    const Projection& projection() const { return *projection_; }  // of the mesh of the last fields()
    int nodes() const { return space_.size(); }
    // A spontaneous curvature that varies, at the nodes, before anything else. From then on nodes are material.
    void carry_H0(const Eigen::VectorXd& H0) { H0_ = H0; }
    const Eigen::VectorXd& H0() const { return H0_; }
    // Beads: positions, and multipliers for a force of 1, SolveError where they have none; d^2G/dP^2 of one; the
    // rate of their distance as the nodes move at velocities v.
    const std::optional<BeadEquations>& beads() const { return beads_; }
    BeadNumbers bead_numbers(const CurvedMesh& mesh) const;
    double bead_bend(const CurvedMesh& mesh, int bead, double P) const;
    double distance_rate(const CurvedMesh& mesh, const BeadNumbers& at, const VectorField& v) const;
    // What a force of the loads works along: the period, or the distance of beads.
    double length(const CurvedMesh& mesh) const;
    LinearWork& linear_work() { return linear_work_; }

    const CurvedMesh& mesh() const { return mesh_; }
    CurvedMesh mesh(const VectorField& X, double period) const;
    CurvedMesh mesh(const MotionState& s) const { return mesh(s.X, s.period); }
    MotionFields fields(const CurvedMesh& mesh);
    // (u.nu, phi) of a velocity as in MotionState.
    Eigen::VectorXd flux(const Eigen::VectorXd& u, const CurvedMesh& mesh, const MotionFields& fields) const;
    // The velocity of the nodes for the normal velocity of the surface given by `flux`; `fields` are the last ones.
    VectorField mesh_velocity(const CurvedMesh& mesh, const MotionFields& fields, const Eigen::VectorXd& flux,
                              double relaxation);
    // The velocity of material nodes, or as above.
    VectorField node_velocity(const MotionState& state, const CurvedMesh& mesh, const MotionFields& fields,
                              const Eigen::VectorXd& flux, double relaxation);
    // At the nodes of the mesh: velocities of the surface, pressures.
    VectorField velocity(const MotionState& state, const MotionFields& fields) const;
    Eigen::VectorXd pressure_at_nodes(const MotionState& state) const;

    // Momentum and angular momentum except for the density (of a tube: about its axis only), which only friction
    // changes, of motions that no potential and no bead resists; empty without inertia.
    Eigen::VectorXd momenta(const MotionState& state) const;
    // At the end of a step: after the loss by friction, and with what a reservoir has fed.
    Eigen::VectorXd momenta_after(const MotionState& from, const MotionState& to) const;
    // Adds the rigid motion that makes them equal to `kept`; to positions for a time te.
    void keep_momenta(const Eigen::VectorXd& kept, double te, MotionState& to) const;
    // Columns r of the conditions (r, v) = 0 that exclude the rigid motions left undetermined by the law.
    Eigen::MatrixXd open_rigid_motions(const CurvedMesh& mesh) const;

    // Whether area and volume are the same condition: H is constant to the accuracy of the mesh, and the volume differs
    // from that of the sphere of this area, or of the straight tube, by less than `most_drift`.
    bool area_is_volume(const CurvedMesh& mesh, const MotionFields& fields) const;
    // Rates of area, volume and distance by which `begin` has the kept values after `span`, at `time`. To first order
    // about `at`; what the extrapolated `end` still lacks and what steps like this miss (`missed`) is added.
    Extent rate_to_keep(const CurvedMesh& at, const CurvedMesh& begin, const CurvedMesh& end, double time, double span,
                        const Extent& missed) const;
    // Corrects area, volume and distance to the values that are kept by displacements along nu, H nu, and nu near the
    // beads, or along nu and z e_z where area and volume are kept and the period is free; returns these and the
    // previous defect. SolveError if they cannot be met to 1e-8.
    struct Correction {
        VectorField displacement;  // without the stretch
        double stretch = 0;
        Extent lacking;
    };
    Correction correct(const MotionFields& fields, bool with_volume, MotionState& s) const;

private:
    // 1 and x at the nodes, or their integrals against each function: one column a node.
    using Places = Eigen::Matrix<double, 4, Eigen::Dynamic>;
    Eigen::MatrixXd rigid_motions(const CurvedMesh& mesh) const;
    Eigen::MatrixXd rigid_motions(const Places& at) const;
    Eigen::MatrixXd momenta(const CurvedMesh& mesh) const;
    BeadNumbers held_beads(const CurvedMesh& mesh) const;
    Extent lack(const CurvedMesh& mesh, double time, const BeadNumbers& beads) const;
    Extent rate_of(const CurvedMesh& mesh, const BeadNumbers& beads, const VectorField& v) const;
    VectorField pulled(const MotionFields& fields, const CurvedMesh& mesh, const BeadNumbers& beads) const;
    double lack_of_volume(const CurvedMesh& mesh) const;

    CurvedMesh mesh_, pressure_mesh_;  // pressure: empty without
    SurfaceSpace space_;
    SurfaceLaw law_;
    Bending bending_;
    MotionControl control_;
    MeshMotion mesh_motion_;
    Eigen::VectorXd H0_;  // empty where it is a number
    std::optional<BeadEquations> beads_;
    Eigen::MatrixXd free_motions_;  // combinations of the rigid ones, a column each
    bool holds_rigid_motions_ = false;
    LinearWork linear_work_;
    std::optional<Projection> projection_;
};

}  // namespace tubule::surface3d
