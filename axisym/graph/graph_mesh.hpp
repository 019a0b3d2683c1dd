// Everything that belongs to one mesh of a graph.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "axisym/graph/graph_error_transport.hpp"
#include "axisym/graph/graph_settings.hpp"

namespace tubule::axisym {

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
    // At coefficients x with rates v, radii refined between quadrature points; `defect` as Forms::observe.
    Observation look(const double* x, const double* v, std::vector<double>* defect) const;
};

// Breaks suitable for the initial shape and, as far as can be foreseen, for how the flow changes it.
std::vector<double> initial_breaks(const Problem& c, const GraphSettings& settings, const Cell& cell,
                                   const std::function<double(double)>& shape);

}  // namespace tubule::axisym
