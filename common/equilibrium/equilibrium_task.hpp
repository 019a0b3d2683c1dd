// The table [equilibrium] of a case, resolved for an initial shape: what is held, and the parameter of a branch.
#pragma once

#include <functional>
#include <vector>

#include "common/case/problem.hpp"
#include "common/equilibrium/stationary_problem.hpp"

namespace tubule {

// The stationary problem of a case whose initial shape has this area and volume.
StationaryProblem stationary_problem(const Problem& c, double area, double volume);

// Volume of a closed shape of this area.
double volume_at(double area, double reduced_volume);

// Gives the parameter of a branch a value: a modulus, H0, an area, a volume, or several of them at once.
using SetParameter = std::function<void(StationaryProblem&, double)>;
SetParameter setter(int parameter);
// Its value in the problem.
double parameter_value(int parameter, StationaryProblem p);

// The parameters at which shapes of the branch are asked for, in order, from the problem's value to
// equilibrium.branch's end. Throws CaseError where these are none, or too many.
std::vector<double> branch_outputs(const Problem& c, const StationaryProblem& problem);

// What is wrong with the problem on a shape of this period (0: closed), as a CaseError that names the key.
void check_problem(const Problem& c, const StationaryProblem& problem, double period);

}  // namespace tubule
