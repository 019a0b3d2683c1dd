// Branches of stationary surfaces in one parameter of the problem: common/equilibrium/continuation.hpp.
#pragma once

#include "common/equilibrium/continuation.hpp"
#include "surface3d/equilibrium/surface_equilibrium.hpp"

namespace tubule::surface3d {

using tubule::PointKind;
using BranchPoint = tubule::BranchPoint<SurfaceEquilibrium>;
using BranchSettings = tubule::BranchSettings<SurfaceEquilibrium, SurfaceEquilibriumSettings>;
using Branch = tubule::Branch<SurfaceEquilibrium>;

// `problem` and `start` belong to the parameter `from`; the branch is followed on the mesh of `start`, and on others as
// it needs them. Throws std::invalid_argument unless `start` is an equilibrium and from != to.
Branch follow_branch(const StationaryProblem& problem, const SurfaceEquilibrium& start, const SetParameter& set,
                     const BranchSettings& settings);

}  // namespace tubule::surface3d
