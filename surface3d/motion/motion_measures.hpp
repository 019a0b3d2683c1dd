// Measurements of a moving surface: energies, balances, shape and mesh.
#pragma once

#include "surface3d/curvature/bending_force.hpp"
#include "surface3d/fem/mesh_quality.hpp"
#include "surface3d/motion/moving_surface.hpp"

namespace tubule::surface3d {

// How linear interpolation represents nodal values on elements of order 4, from its errors on the triangles and on
// their quarters. Not known (0) for elements of another order.
struct Smoothness {
    double order = 0;   // 2 where the mesh resolves the values, below 1 where they are rough on the scale of an element
    double missed = 0;  // root mean square of the errors on the quarters, relative to that of the values
};

// Many fields: a list of measurements that share no rule.
struct MotionMeasures {
    Observables bending;  // with H and K of `fields`, to which the force belongs
    MotionFields fields;
    VectorField velocity;     // at the nodes
    double free_energy = 0;   // F = E + tension A - pressure V - force L, of what is given
    double source_power = 0;  // theory.md (3.27)
    // Given, or what holds the area, the volume and the period or the distance of beads; 0 where that is undetermined.
    double tension = 0, pressure = 0, force = 0;
    double length = 0;                    // the period, or the distance of beads
    WallDistance wall;                    // from the walls of potentials
    Coarseness coarse_wall, coarse_bead;  // of the mesh near them
    Coarseness coarse_wave;               // where kg > 0: the symbol is negative, see theory.md (2.26)
    double kinetic = 0;                   // inertia INT |u|^2/2
    double dissipation = 0;               // INT 2 viscosity |sigma|^2 + friction |u|^2
    double acceleration = 0;  // inertia INT |d_t u|^2 dS/2: kinetic energy gained from rest, per time squared
    double speed = 0;         // largest |u|
    double stretching = 0;    // L2 norm of div_P u, relative to that of grad_P u: zero if inextensible
    Eigen::Vector3d momentum, angular_momentum, centre;
    double height = 0;            // period of a tube; extent of a closed surface along z
    double r_min = 0, r_max = 0;  // distances from the axis of a tube; from the centre of a closed surface
    MeshQuality quality;
    MeshTurn turn;
    double neck_radius = 0;        // of the narrowest place where the surface is a saddle; infinity if there is none
    Eigen::Vector3d narrowest;     // where that is
    Smoothness smoothness;         // of H on this mesh
    double symbol = 0;             // smallest principal symbol, theory.md (2.14), x between the principal curvatures
    Eigen::Vector3d least_symbol;  // where it is
    FormulaDomain::Margin domain;  // of the energy's formula, with the node as its place
    FormulaDomain::Margin pressure_domain;                    // of the formula of the pressure
    Eigen::Vector3d least_defined = Eigen::Vector3d::Zero();  // where that node is
};

// Measures a state on the mesh of `surface`, whose projection is brought there. `before`: where the step that led to it
// began; without it the acceleration is 0.
MotionMeasures measure(MovingSurface& surface, const MotionState& state, const MotionState* before = nullptr);

// Where kg > 0 and the symbol is negative: the distance of nodes over sqrt(2 kg/|symbol|), theory.md (2.26).
Coarseness wave_coarseness(const CurvedMesh& mesh, const MotionFields& fields, const Bending& bending);

Smoothness smoothness_of(const CurvedMesh& mesh, const Eigen::VectorXd& values);

// INT (H - tr B)^2/INT H^2 with the B of the averaged normal: how far two ways to find H differ on this mesh.
double noise_of_H(const SurfaceSpace& space, const CurvedMesh& mesh, const MotionFields& fields);

}  // namespace tubule::surface3d
