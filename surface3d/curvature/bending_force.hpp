// Energies of a curved mesh and the bending force on it, from recovered curvatures.
#pragma once

#include <vector>

#include "common/energy/bending.hpp"
#include "surface3d/curvature/curvature.hpp"

namespace tubule::surface3d {

// Integrals over the surface; of one period where it is periodic.
struct Observables {
    std::vector<double> energy_term;  // of each term, see term_names()
    double energy = 0, area = 0, volume = 0;
    double M = 0, integral_H2 = 0, integral_K = 0;  // M = INT H
    double potential = 0, potential_force = 0;      // INT W, part of the energy, and -INT W_z
    double energy_kg = 0;                           // of the gradient term, theory.md (2.25), part of the energy
    double energy_alpha = 0;                        // of area differences, theory.md (2.19), part of the energy
    double magnitude = 0;  // INT SUM |k| magnitude(H, K), see BendingTerm: E_ref is at least this
};

// The energy is INT f(H, K) + kg |grad H|^2 + W dS + alpha/2 (M - M0)^2, W of potentials, with the recovered fields H,
// K; `H0` at the nodes, where it varies.
Observables observe(const SurfaceSpace& space, const CurvedMesh& mesh, const CurvatureField& curvature,
                    const Bending& bending, const Eigen::VectorXd& H0 = {});

// Vertices - edges + triangles: 2 for a sphere, 0 for a torus or a periodic tube.
int euler_characteristic(const CurvedMesh& mesh);

// INT K dS - 2 pi chi, zero on every surface: how far the recovered curvatures are from those of a surface.
double gauss_bonnet_defect(const Observables& o, const CurvedMesh& mesh);

// 16 pi, the minimum of INT H^2 over closed surfaces (Willmore): a run below it is spurious.
inline constexpr double willmore_bound = 16 * 3.14159265358979323846;

// (b, phi_a e_d) for node a and direction d, one column a node: the weak form theory.md (2.9)
//   (b, v) = (grad f_H + (HP-B) grad f_K, grad w) - (|B|^2 f_H + H K f_K - H f, w),   w = v.nu,
// with the recovered normal and curvatures, and grad w = SUM nu_d grad v_d - B v. It belongs to the energy of the
// smooth surface: it is not the derivative of observe().energy, which a change of curvature reaches through the
// recovery, but the two approach each other at the order of the recovered gradients or better (docs/curvature.md).
// Where areas differ, of an energy with_M(). Without the gradient term.
VectorField bending_force(const SurfaceSpace& space, const CurvedMesh& mesh, const CurvatureField& curvature,
                          const Bending& bending);

}  // namespace tubule::surface3d
