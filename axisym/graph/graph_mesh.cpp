#include "axisym/graph/graph_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

#include "axisym/splines/band_lu.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/run/energy_checks.hpp"
#include "common/solve/sparse.hpp"

namespace tubule::axisym {

namespace {

// Measured choices: docs/decisions/graphs.md, "Ask for accuracy".
// The error of Rosenbrock's method falls faster than its tolerance.
double time_tolerance_for(double asked, bool rosenbrock) {
    return std::max(!rosenbrock ? 0.35 * asked : 3.5e-5 * std::pow(asked / 1e-4, 0.68), 1e-13);
}
constexpr double loss_per_accuracy = 1.0 / 12;  // mesh loss at which to remesh / (asked accuracy * E_ref)

}  // namespace

GraphSettings first_graph_settings(const Problem& c, bool rosenbrock) {
    const double asked = c.accuracy.energy;
    return {c.discretisation.time_tolerance.value_or(time_tolerance_for(asked, rosenbrock)),
            loss_per_accuracy * asked,
            !c.discretisation.time_tolerance,
            !c.discretisation.elements,
            true,
            rosenbrock};
}

// An attempt ends when its error exceeds what is allowed, before it is largest: after the first attempt, settings aim
// at less.
GraphSettings tightened(GraphSettings s, const ErrorTransport::EnergyError& error, double allowed, int attempt) {
    const double boldness = attempt == 1 ? 1 : 0.3;
    const auto shrink = [&](double goal, double part) {
        return std::clamp(boldness * goal * allowed / part, 0.01, 0.6);
    };
    const double of_space = std::abs(error.spatial), of_time = std::abs(error.total - error.spatial);
    if (s.free_time && of_time > 0.3 * allowed)
        s.time_tolerance = std::max(s.time_tolerance * shrink(0.35, of_time), 1e-14);
    if (s.free_mesh && of_space > 0.3 * allowed) s.mesh_loss *= shrink(0.15, of_space);
    return s;
}

namespace {

// A plane z about which every mode is even.
std::optional<double> mirror_plane(const std::vector<TubeMode>& modes, double length) {
    const TubeMode& first = modes.front();
    for (int k = 0; k < 2 * first.n; ++k) {
        const double z = (k * std::numbers::pi - first.phase) * length / (2 * std::numbers::pi * first.n);
        const bool even = std::all_of(modes.begin(), modes.end(), [&](const TubeMode& mode) {
            return std::abs(std::sin(2 * std::numbers::pi * mode.n * z / length + mode.phase)) < 1e-12 * (1 + mode.n);
        });
        if (even) return z;
    }
    return std::nullopt;
}

}  // namespace

Cell cell_of(const Tube& tube, bool symmetry) {
    if (!symmetry) return {0, tube.length, false, 1};
    std::vector<TubeMode> modes;
    for (const TubeMode& mode : tube.modes)
        if (mode.n > 0 && mode.amplitude != 0) modes.push_back(mode);
    if (modes.empty()) return {0, tube.length / 2, true, 1};
    std::sort(modes.begin(), modes.end(), [](const auto& a, const auto& b) { return a.n < b.n; });
    const int waves = common_waves(tube);
    const double period = tube.length / waves;
    if (const auto z = mirror_plane(modes, tube.length)) return {*z, *z + period / 2, true, waves};
    return {0, period, false, waves};
}

std::vector<double> foreseen_mesh_loss(const Forms& forms, const Eigen::VectorXd& x, double span) {
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(x.size()), force = forms.gradient(x);
    std::vector<double> largest, mesh_loss;
    forms.observe(x.data(), rest.data(), &largest);
    Eigen::SparseMatrix<double> matrix = forms.pattern();
    BandLu lu(matrix);
    for (double dt = span; dt > 5e-7 * span; dt /= 10) {
        forms.jacobian(x.data(), rest.data(), 1 / dt, matrix.valuePtr());
        try {
            lu.factor(matrix.valuePtr());
        } catch (const SolveError&) {
            continue;  // no step of this length; a shorter one may exist
        }
        const Eigen::VectorXd ahead = x - lu.solved(force);
        const Observation o = forms.observe(ahead.data(), rest.data(), &mesh_loss);
        if (!(o.r_min > 0 && o.symbol > 0)) continue;  // the flow does not lead there
        for (std::size_t e = 0; e < mesh_loss.size(); ++e) largest[e] = std::max(largest[e], mesh_loss[e]);
    }
    return largest;
}

namespace {

// Elements per length that are wanted, constant between edges; each element of the mesh has `parts` such pieces.
struct Density {
    static constexpr int parts = 4;
    std::vector<double> edges, value;
    double width(int i) const { return edges[i + 1] - edges[i]; }
    double integral() const {
        double sum = 0;
        for (std::size_t i = 0; i < value.size(); ++i) sum += value[i] * width(static_cast<int>(i));
        return sum;
    }
};

// The mesh loss of an element of size h is c h^(2p-1). Equal shares mean h ~ c^(-1/(2p-1)).
Density wanted_density(const SplineSpace& space, const std::vector<double>& mesh_loss, double target, int fewest) {
    constexpr double growth = 0.35;  // of the element size per distance
    const int exponent = 2 * space.degree() - 1;
    Density d;
    for (int e = 0; e < space.elements(); ++e) {
        const double z = space.breaks()[e], h = space.breaks()[e + 1] - z;
        for (int i = 0; i < Density::parts; ++i) {
            d.edges.push_back(z + h * i / Density::parts);
            d.value.push_back(std::pow(std::max(mesh_loss[e], 0.0) + 1e-300, 1.0 / exponent) / h);
        }
    }
    d.edges.push_back(space.breaks().back());
    // n equal shares of (INT density / n)^(2p-1) each. A density raised to even out the sizes needs more elements,
    // but costs no accuracy: count from the raw one.
    const double raw = d.integral();
    const double needed = std::pow(std::pow(raw, exponent) / target, 1.0 / (exponent - 1));
    for (double& v : d.value) v = std::max(v * std::max(needed, 1.0) / raw, fewest / space.cell().length());
    const int m = static_cast<int>(d.value.size());
    const bool mirror = space.cell().mirror;
    const auto limit = [&](int i, int from) {  // size(i) <= size(from) + growth * distance
        const double distance = (d.width(i) + d.width(from)) / 2;
        d.value[i] = std::max(d.value[i], 1 / (1 / d.value[from] + growth * distance));
    };
    for (int sweep = 0; sweep < (mirror ? 1 : 2); ++sweep) {
        for (int i = 0; i < m; ++i)
            if (i > 0 || !mirror) limit(i, i > 0 ? i - 1 : m - 1);
        for (int i = m - 1; i >= 0; --i)
            if (i + 1 < m || !mirror) limit(i, i + 1 < m ? i + 1 : 0);
    }
    return d;
}

}  // namespace

std::vector<double> adapted_breaks(const SplineSpace& space, const std::vector<double>& mesh_loss, double target,
                                   int fewest, int most) {
    const Density d = wanted_density(space, mesh_loss, target, fewest);
    const int elements = std::max(fewest, static_cast<int>(std::min<double>(std::ceil(d.integral()), most)));
    const double share = d.integral() / elements;
    std::vector<double> breaks{space.cell().z0};
    double sum = 0;
    for (std::size_t i = 0; i < d.value.size(); ++i) {
        const double here = d.value[i] * d.width(static_cast<int>(i));
        while (static_cast<int>(breaks.size()) < elements && sum + here >= share * breaks.size())
            breaks.push_back(d.edges[i] + d.width(static_cast<int>(i)) * (share * breaks.size() - sum) / here);
        sum += here;
    }
    breaks.push_back(space.cell().z1);
    return breaks;
}

std::vector<double> refined_breaks(const SplineSpace& space, const std::vector<double>& mesh_loss, double target,
                                   int most) {
    const Density d = wanted_density(space, mesh_loss, target, 1);
    std::vector<double> breaks{space.cell().z0};
    for (int e = 0; e < space.elements(); ++e) {
        double wanted = 0;
        for (int i = e * Density::parts; i < (e + 1) * Density::parts; ++i) wanted += d.value[i] * d.width(i);
        const double z = space.breaks()[e], h = space.breaks()[e + 1] - z;
        const int pieces = static_cast<int>(std::clamp<double>(std::ceil(wanted - 0.2), 1, most + 1));
        for (int i = 1; i < pieces; ++i) breaks.push_back(z + h * i / pieces);
        breaks.push_back(space.breaks()[e + 1]);
        if (static_cast<int>(breaks.size()) > most + 1) break;
    }
    return breaks;
}

namespace {

// Measured choices: docs/decisions/graphs.md, "Ask for accuracy".
constexpr double start_margin = 1.0 / 4;  // initial mesh loss / that at which to remesh
constexpr int fewest_elements = 3;
constexpr double coarsest_at_first = 0.5;  // of Observation::coarse, at which a run ends when it is 1

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

Observation GraphMesh::look(const double* x, const double* v, std::vector<double>* mesh_loss) const {
    Observation o = forms.observe(x, v, mesh_loss);
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
    std::vector<double> breaks = equal_breaks(first, cell);
    for (int pass = 0;; ++pass) {
        const SplineSpace space = space_of(cell, breaks, c);
        const Forms forms(space, c.energy, graph_loads(c));
        const Eigen::VectorXd x = space.project(shape);
        const Eigen::VectorXd rest = Eigen::VectorXd::Zero(x.size());
        const Observation o = forms.observe(x.data(), rest.data());
        require_defined(c, o.domain, fmt::format("z = {:.6g}", o.domain.place));
        const double allowed =
            settings.mesh_loss * reference_energy(c, forms.free_energy(x), forms.reference_energy(x));
        if (!settings.free_mesh || pass == 8 || space.elements() >= most_graph_elements) return breaks;
        const std::vector<double> mesh_loss = foreseen_mesh_loss(forms, x, c.time.end);
        const double lost = std::accumulate(mesh_loss.begin(), mesh_loss.end(), 0.0);
        if (lost < allowed * start_margin && o.coarse <= coarsest_at_first) return breaks;
        const double for_waves = std::min(o.coarse / coarsest_at_first * space.elements(), most_graph_elements + 1.0);
        std::vector<double> next =
            adapted_breaks(space, mesh_loss, allowed * start_margin / 2,
                           std::max(fewest_elements, static_cast<int>(std::ceil(for_waves))), most_graph_elements + 1);
        if (static_cast<int>(next.size()) > most_graph_elements + 1) return breaks;
        breaks = std::move(next);
    }
}

}  // namespace tubule::axisym
