#include "axisym/graph/graph_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "axisym/graph/graph_start.hpp"
#include "common/run/energy_checks.hpp"

namespace tubule::axisym {
namespace {

// Measured choices: docs/decisions/graphs.md, "Ask for accuracy".
constexpr double start_margin = 1.0 / 4;  // initial defect / defect at which to remesh
constexpr int fewest_elements = 3;

SplineSpace space_of(const Cell& cell, std::vector<double> breaks, const Problem& c) {
    const int order = c.discretisation.order;
    return SplineSpace(cell, std::move(breaks), order, c.discretisation.smoothness.value_or(order - 1));
}

}  // namespace

Loads graph_loads(const Problem& c) {
    return loads_at(c.law, 0);
}

std::vector<int> tracked_graph_modes(const Problem& c) {
    std::set<int> waves;
    for (const TubeMode& mode : std::get<Tube>(c.shape).modes)
        if (mode.n > 0) waves.insert(mode.n);
    return {waves.begin(), waves.end()};
}

GraphMesh::GraphMesh(const Cell& cell, std::vector<double> breaks, const Problem& c)
    : space(space_of(cell, std::move(breaks), c)), forms(space, c.energy, graph_loads(c)), transport(forms) {
    for (int n : tracked_graph_modes(c)) modes.push_back(forms.mode(n));
}

double GraphMesh::place(double z) const {
    const double length = space.cell().period();
    return z - std::floor(z / length) * length;
}

Observation GraphMesh::look(const double* x, const double* v, std::vector<double>* defect) const {
    Observation o = forms.observe(x, v, defect);
    for (auto [z, r] : {std::pair{&o.z_min, &o.r_min}, std::pair{&o.z_max, &o.r_max}}) {
        *z = space.extremum_near(x, *z);
        *r = space.evaluate(x, space.element_at(*z), *z)[0];
    }
    return o;
}

std::vector<double> initial_breaks(const Problem& c, const GraphSettings& settings, const Cell& cell,
                                   const std::function<double(double)>& shape) {
    const Discretisation& d = c.discretisation;
    int most_waves = 0;
    for (const TubeMode& mode : std::get<Tube>(c.shape).modes) most_waves = std::max(most_waves, mode.n);
    const int first = d.elements ? std::max(2, (*d.elements + cell.images() - 1) / cell.images())
                                 : std::max(fewest_elements, 8 * most_waves / cell.images());
    std::vector<double> breaks = uniform_breaks(cell, first);
    for (int pass = 0;; ++pass) {
        const SplineSpace space = space_of(cell, breaks, c);
        const Forms forms(space, c.energy, graph_loads(c));
        const Eigen::VectorXd x = space.project(shape);
        const Eigen::VectorXd rest = Eigen::VectorXd::Zero(x.size());
        const FormulaDomain::Margin domain = forms.observe(x.data(), rest.data()).domain;
        require_defined(c, domain, fmt::format("z = {:.6g}", domain.place));
        const double allowed = settings.defect * reference_energy(c, forms.free_energy(x), forms.reference_energy(x));
        if (!settings.free_mesh || pass == 8 || space.elements() >= most_graph_elements) return breaks;
        const std::vector<double> defect = foreseen_defect(forms, x, c.time.end);
        const double lost = std::accumulate(defect.begin(), defect.end(), 0.0);
        if (lost < allowed * start_margin) return breaks;
        std::vector<double> next =
            adapted_breaks(space, defect, allowed * start_margin / 2, fewest_elements, most_graph_elements + 1);
        if (static_cast<int>(next.size()) > most_graph_elements + 1) return breaks;
        breaks = std::move(next);
    }
}

}  // namespace tubule::axisym
