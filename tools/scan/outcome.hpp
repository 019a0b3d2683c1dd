// The outcome of a point of a scan. One list serves results, tables and pictures.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/case/equilibrium_choices.hpp"
#include "common/solve/stop.hpp"

namespace tubule {

enum class Outcome {
    not_run,            // not asked for, or not yet
    uniform_tube,       // at rest as a straight tube, or on its way to one without any wave that grows
    unduloid,           // a tube at rest with waves
    sphere,             // at rest as a sphere
    closed,             // a cell or torus at rest, no sphere
    pinched,            // a neck closed
    overhang,           // a graph r(z) turned vertical
    ill_posed,          // the flow is no longer well-posed
    self_intersection,  // the surface meets itself
    failed,             // the numerics failed, or the point is not a valid case
    undecided,          // still moving at time.end, or out of time
    // Cells at rest of a scan of equilibria, by their profile:
    prolate,      // mirror symmetric, longer than wide
    oblate,       // mirror symmetric, at least as wide as long
    stomatocyte,  // without mirror symmetry, and dented: a pole lies inside its height
    pear          // without mirror symmetry otherwise
};
inline constexpr int n_outcomes = static_cast<int>(Outcome::pear) + 1;

// "uniform-tube" for Outcome::uniform_tube, and so on.
std::string_view name(Outcome outcome);
std::optional<Outcome> outcome_from_name(std::string_view name);
std::vector<std::string> outcome_names();  // all, in order

// The last state of a run, as far as outcomes ask for it.
struct EndShape {
    bool periodic = true;  // a tube, else closed
    double r_min = 0, r_max = 0, area = 0, volume = 0;
};

// A tube counts as uniform if its radii differ by less than this part of their sum.
inline constexpr double waves_of_uniform_tube = 0.01;

Outcome outcome_of(Stop reason, const EndShape& end);

// That of a cell in equilibrium: axisym::family_of.
Outcome cell_at_rest(std::optional<Family> family);

}  // namespace tubule
