// A surface in motion on one mesh, without a time scheme: its fields, the motion of its nodes, and what is kept, area,
// volume and momenta. Time schemes are built on it, and what is measured of a state is found with it.
#pragma once

#include <optional>

#include "common/energy/bending.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/mesh/curved_mesh.hpp"
#include "surface3d/motion/extent.hpp"
#include "surface3d/motion/mesh_motion.hpp"
#include "surface3d/motion/motion_fields.hpp"
#include "surface3d/motion/motion_state.hpp"
#include "surface3d/motion/surface_law.hpp"

namespace tubule::surface3d {

// What is kept on the way, and how the mesh moves.
struct MotionControl {
    std::optional<double> area = {}, volume = {};  // kept to rounding, where the law has the multiplier
    double relaxation = 0.1;                       // time in which the mesh becomes even
    bool follow_curvature = false;                 // or one whose triangles are small where the surface is curved
    // Where 1 - (INT H)^2/(A INT H^2) is less, area and volume are one condition to the accuracy of the mesh: lambda is
    // left out, as the pressure stands for it, and the area alone is kept to rounding.
    double least_variation = 1e-8;
    double smoothing = 0;  // of schemes that smooth curvatures: eps of a - eps Lap a = a_h, a length squared
};

class MovingSurface {
public:
    // A law that does not resist rigid motions gets a slight friction, and these are held at zero.
    MovingSurface(const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending, const MotionControl& control);

    // At rest, corrected to the area and volume that are kept: a short step would make up for the defect of a new mesh
    // at high speed. SolveError where they cannot be kept to 1e-8.
    MotionState start(const CurvedMesh& mesh);
    // The same with a velocity as in MotionState, with which nodes begin to move, too: a first step from nodes at rest
    // would not bend the surface. With a rigid motion added that makes `momenta` what is given, if anything is.
    MotionState start(const CurvedMesh& mesh, const Eigen::VectorXd& u, const Eigen::VectorXd& momenta = {});

    const SurfaceSpace& space() const { return space_; }
    const SurfaceLaw& law() const { return law_; }
    const Bending& bending() const { return bending_; }
    const MotionControl& control() const { return control_; }
    const Projection& projection() const { return *projection_; }  // of the mesh of the last fields()
    int nodes() const { return space_.size(); }

    const CurvedMesh& mesh() const { return mesh_; }
    CurvedMesh mesh(const VectorField& X) const { return with_nodes(mesh_, X); }
    MotionFields fields(const CurvedMesh& mesh);
    // (u.nu, phi) of a velocity as in MotionState.
    Eigen::VectorXd flux(const Eigen::VectorXd& u, const CurvedMesh& mesh, const MotionFields& fields) const;
    // Of the nodes, where that of the surface along the normal is given by `flux`; `fields` are the last ones.
    VectorField mesh_velocity(const CurvedMesh& mesh, const MotionFields& fields, const Eigen::VectorXd& flux,
                              double te);
    // At the nodes of the mesh: velocities of the surface, pressures.
    VectorField velocity(const MotionState& state, const MotionFields& fields) const;
    Eigen::VectorXd pressure_at_nodes(const MotionState& state) const;

    // Momentum and angular momentum except for the density (a tube: about its axis alone), which friction alone
    // changes; empty where there is no inertia.
    Eigen::VectorXd momenta(const MotionState& state) const;
    Eigen::VectorXd momenta_after(const MotionState& from, double tau) const;  // what friction leaves of them
    // Adds the rigid motion that makes them `kept`, to positions for a time te.
    void keep_momenta(const Eigen::VectorXd& kept, double te, MotionState& to) const;
    // Columns r of (r, v) for every rigid motion v that the law leaves open: what is to be zero of a velocity.
    Eigen::MatrixXd open_rigid_motions(const CurvedMesh& mesh) const;

    // Whether area and volume are one condition to the accuracy of the mesh.
    bool area_is_volume(const CurvedMesh& mesh, const MotionFields& fields) const;
    // The rates of area and volume with which `begin` comes, in a time `span`, to those that are kept: linear about the
    // surface `at`, as seen from the expected `end`, with `missed` more, which a step like this is known to miss.
    Extent rate_to_keep(const CurvedMesh& at, const VectorField& begin, const VectorField& end, double span,
                        const Extent& missed) const;
    // Displacements along nu and H nu to the area and volume that are kept, and what was lacking before. SolveError
    // where they cannot be kept to 1e-8.
    struct Correction {
        VectorField displacement;
        Extent lacking;
    };
    Correction correction(const VectorField& X, const MotionFields& fields, bool with_volume) const;

private:
    Eigen::MatrixXd rigid_motions(const CurvedMesh& mesh) const;
    Eigen::MatrixXd momenta(const CurvedMesh& mesh, const Eigen::MatrixXd& motions) const;
    Extent lack(const CurvedMesh& mesh) const;

    CurvedMesh mesh_, pressure_mesh_;  // pressure: empty without
    SurfaceSpace space_;
    SurfaceLaw law_;
    Bending bending_;
    MotionControl control_;
    MeshMotion mesh_motion_;
    bool holds_rigid_motions_ = false;
    std::optional<Projection> projection_;
};

}  // namespace tubule::surface3d
