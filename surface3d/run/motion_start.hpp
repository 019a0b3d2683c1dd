// The initial state of a run in motion, and what the run remembers of it.
#pragma once

#include "surface3d/run/motion_frame.hpp"
#include "surface3d/run/start.hpp"

namespace tubule::surface3d {

// Initial velocities at the nodes; empty where there are none.
VectorField start_velocity(const Problem& c, const StartMesh& start);

// Energies, area and volume of an initial shape, computed as in motion.
Observables observe_start(const Problem& c, const StartMesh& start);

// The initial F, and E_ref of a run with it. The latter throws CaseError as tubule::reference_energy.
// `length`: the period, or the distance of beads, NaN where a bead has no position.
double start_length(const Problem& c, const CurvedMesh& mesh);
double free_energy(const Problem& c, const Observables& start, double length);
// Absolute error of this initial energy on a mesh of this number of elements, by a finer mesh, since where the shape is
// not smooth a coarser one may be off by the same; there it falls with the width of the triangles. 0 where there is
// none.
double error_of_start(const Problem& c, const Start& start, int elements, double energy, bool rough);
double reference_energy(const Problem& c, const Observables& start, double length);

// The spontaneous curvature at the nodes, where it varies; else nothing. Throws CaseError where a formula is no number,
// or not the same at both ends of a period.
Eigen::VectorXd start_H0(const Problem& c, const StartMesh& start);

// Throws CaseError where the formula of the energy is not defined for H, K and H0 at the initial nodes.
void require_defined(const Problem& c, const CurvedMesh& mesh, const Eigen::VectorXd& H, const Eigen::VectorXd& K,
                     const Eigen::VectorXd& H0 = {});

// Remembers area, volume, reference energy, relaxation of the mesh, and how accurate H is.
void remember_start(const Problem& c, const StartMesh& start, const SurfaceSpace& space, MotionMemory& memory);

}  // namespace tubule::surface3d
