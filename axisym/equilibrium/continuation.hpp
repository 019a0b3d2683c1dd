// Branches of stationary curves in one parameter of the problem: common/equilibrium/continuation.hpp.
#pragma once

#include "axisym/equilibrium/equilibrium.hpp"
#include "common/equilibrium/continuation.hpp"

namespace tubule::axisym {

using tubule::PointKind;
using BranchPoint = tubule::BranchPoint<Equilibrium>;  // its index: of axisymmetric displacements
using BranchSettings = tubule::BranchSettings<Equilibrium, EquilibriumSettings>;
using Branch = tubule::Branch<Equilibrium>;

// `problem` and `start` belong to the parameter `from`. Throws std::invalid_argument unless `start` is an equilibrium
// and from != to.
Branch follow_branch(const StationaryProblem& problem, const Equilibrium& start, const SetParameter& set,
                     const BranchSettings& settings);

}  // namespace tubule::axisym
