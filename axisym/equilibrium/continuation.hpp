// Branches of stationary shapes in one parameter of the problem, by pseudo-arclength continuation: around folds, with
// folds and bifurcations detected and located.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "axisym/equilibrium/equilibrium.hpp"
#include "common/equilibrium/equilibrium_task.hpp"

namespace tubule::axisym {

enum class PointKind { regular, fold, bifurcation };

struct BranchPoint {
    PointKind kind = PointKind::regular;
    double parameter = 0;
    int index = 0;      // axisymmetric negative directions; at a special point, before it
    Equilibrium shape;  // at special points to about 1e-6 of the parameter's range
};

struct BranchSettings {
    double from = 0, to = 1;     // the branch starts at `from` and is left where it leaves the interval
    std::vector<double> output;  // parameters at which shapes are output, each time the branch passes them
    int max_steps = 500;
    EquilibriumSettings shapes;                                                 // accuracy of each
    std::function<void(const BranchPoint&)> found = [](const BranchPoint&) {};  // is given each as soon as it is known
};

struct Branch {
    std::vector<BranchPoint> points;  // in the order of the branch
    int steps = 0;
    Stop stop = Stop::finished;  // or why it ends inside the interval
    std::string message;
};

// `problem` and `start` belong to the parameter `from`. A change of the number of negative directions that goes with a
// turn of the parameter is a fold, one without is a bifurcation. Throws std::invalid_argument unless `start` is an
// equilibrium and from != to.
Branch follow_branch(const StationaryProblem& problem, const Equilibrium& start, const SetParameter& set,
                     const BranchSettings& settings);

}  // namespace tubule::axisym
