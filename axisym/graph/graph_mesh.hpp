// How fine a run of a graph is: the part of the tube that is computed, its meshes and all that belongs to one of them.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "axisym/graph/carried_error.hpp"
#include "axisym/graph/graph_forms.hpp"
#include "axisym/splines/spline_space.hpp"
#include "common/case/problem.hpp"

namespace tubule::axisym {

constexpr double stated_over_computed = 1.8;  // error stated / error computed by the transport

// The asked accuracy sets it, a failed attempt tightens it.
struct GraphSettings {
    double time_tolerance = 0;
    double mesh_loss = 0;  // largest energy lost to the mesh before a new one is made, over E_ref
    bool free_time = true, free_mesh = true;
    bool may_give_up = true;  // where the error exceeds the accuracy asked, and finer settings would help
    bool rosenbrock = false;  // Rosenbrock's method of long steps instead of IDA
};

GraphSettings first_graph_settings(const Problem& c, bool rosenbrock);

// After attempt number `attempt`, whose error (absolute) was beyond what is allowed.
GraphSettings tightened(GraphSettings s, const ErrorTransport::EnergyError& error, double allowed, int attempt);

// The smallest part of the tube that determines it: a period divided by the common waves of its modes,
// halved if the modes are even about a plane. The flow keeps both symmetries exactly, and so does the
// reduced problem. With `symmetry` off: the whole period.
Cell cell_of(const Tube& tube, bool symmetry);

// Elements such that the energy lost to the spline (the mesh loss of Forms::observe) is about `target`, judging by the
// present mesh: sizes follow the local need and grow by at most a fixed ratio. At least `fewest`, and with the same
// grading at most `most`.
std::vector<double> adapted_breaks(const SplineSpace& space, const std::vector<double>& mesh_loss, double target,
                                   int fewest, int most);

// The same by division of the present elements: the new space contains the old one. Ends early, before the end of the
// cell, where there would be more than `most`.
std::vector<double> refined_breaks(const SplineSpace& space, const std::vector<double>& mesh_loss, double target,
                                   int most);

// The mesh loss of each element that the flow from x will soon develop: the largest over x itself and single
// linearly implicit Euler steps from it, whose sizes span six decades up to `span`. A start is often smooth and
// grows its sharpest features within its first instants.
std::vector<double> foreseen_mesh_loss(const Forms& forms, const Eigen::VectorXd& x, double span);

constexpr int most_graph_elements = 4000;  // of one cell

// Tension and pressure, the same at all times: what changes is computed as a curve.
Loads graph_loads(const Problem& c);

// Numbers n > 0 of the initial modes, each once.
std::vector<int> tracked_graph_modes(const Problem& c);

struct GraphMesh {
    GraphMesh(const Cell& cell, std::vector<double> breaks, const Problem& c);

    SplineSpace space;
    Forms forms;
    ErrorTransport transport;
    std::vector<std::array<Eigen::VectorXd, 2>> modes;  // functionals of those that are tracked

    double place(double z) const;  // in [0, length)
    // At coefficients x with rates v, radii refined between quadrature points; `mesh_loss` as Forms::observe.
    Observation look(const double* x, const double* v, std::vector<double>* mesh_loss) const;
};

// Breaks suitable for the initial shape and, as far as can be foreseen, for how the flow changes it.
std::vector<double> initial_breaks(const Problem& c, const GraphSettings& settings, const Cell& cell,
                                   const std::function<double(double)>& shape);

}  // namespace tubule::axisym
