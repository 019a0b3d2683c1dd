// The flow of a membrane that follows a displacement of its shape: what it dissipates, for growth rates of models that
// flow, theory.md (8.9).
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "common/model/model.hpp"
#include "surface3d/equilibrium/surface_spectrum.hpp"
#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {

// The second variation for all unknowns of the flow under an inextensible law, with `mass` [D, B^T; B, 0]: D
// dissipates, B u = -div u. Unknowns are velocities along `normal` at each node, with viscosity two more across, the
// pressure, and a stretch. `rigid`: velocities that cost no energy, a column each, numbered component by component;
// `stiffness`: a size of the eigenvalues.
FlowForm flow_form(const ConstrainedForm& second_variation, const SurfaceSpace& space, const CurvedMesh& mesh,
                   const VectorField& normal, const MotionLaw& law, const Eigen::MatrixXd& rigid, double stiffness);

}  // namespace tubule::surface3d
