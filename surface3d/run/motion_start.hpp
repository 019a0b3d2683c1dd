// What a run in motion takes from its start and remembers.
#pragma once

#include "surface3d/run/motion_frame.hpp"
#include "surface3d/run/start.hpp"

namespace tubule::surface3d {

double begin_time(const Case& c);

// Velocities at the nodes; none at rest.
VectorField start_velocity(const Case& c, const StartMesh& start);

// Energies, area and volume of a start, as its motion sees them.
Observables observe_start(const Case& c, const StartMesh& start);

// F at the start, and E_ref of a run with it. The latter throws CaseError as tubule::reference_energy.
double free_energy(const Case& c, const Observables& start, double period);
// Absolute error of this initial energy on a mesh of this number of elements, by a finer mesh, since where the shape is
// not smooth a coarser one may be off by the same. 0 where there is none.
double error_of_start(const Case& c, const Start& start, int elements, double energy);
double reference_energy(const Case& c, const Observables& start, double period);

// The spontaneous curvature at the nodes, where it varies; else nothing. Throws CaseError where a formula is no number,
// or not the same at both ends of a period.
Eigen::VectorXd start_H0(const Case& c, const StartMesh& start);

// Area, volume, reference energy, relaxation of the mesh, how well H is known.
// Throws CaseError where the formula of the energy is not defined for H, K and H0 at the nodes of the start.
void require_defined(const Case& c, const CurvedMesh& mesh, const Eigen::VectorXd& H, const Eigen::VectorXd& K,
                     const Eigen::VectorXd& H0 = {});

void remember_start(const Case& c, const StartMesh& start, const SurfaceSpace& space, MotionMemory& memory);

}  // namespace tubule::surface3d
