// Why a run of a graph ends early.
#pragma once

#include <span>

#include "axisym/graph/graph_mesh.hpp"
#include "common/solve/stop.hpp"

namespace tubule::axisym {

// What is watched: a state, in a run with these limits.
struct GraphLimits {
    double r_min = 0;
    double least_symbol = 0;  // below it the flow is nearly ill-posed
};

// A value that is positive while all is well, and the report for when it no longer is.
struct GraphGuard {
    double (*value)(const Observation& o, const GraphLimits& limits);
    StopReport (*report)(const Observation& o, const GraphMesh& mesh, const double* x, double time);
};
std::span<const GraphGuard> graph_guards();

StopReport overhang(const Observation& o, const GraphMesh& mesh, const double* x, double time);

// Whether the profile is so steep that a failure there is due to an overhang.
bool is_about_to_overhang(const Observation& o);

// The least symbol of the first observation of a run.
double least_symbol_of(const Bending& energy, const Observation& o);

}  // namespace tubule::axisym
