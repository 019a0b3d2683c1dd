#include "surface3d/run/equilibrium_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/case/read.hpp"
#include "common/equilibrium/equilibrium_task.hpp"
#include "common/run/energy_checks.hpp"
#include "common/run/shape_run.hpp"
#include "surface3d/equilibrium/surface_branch.hpp"
#include "surface3d/fem/mesh_quality.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/run/guards.hpp"
#include "surface3d/run/mesh_record.hpp"

namespace tubule::surface3d {
namespace {

constexpr int many = 2000;  // triangles, for the area and volume of an initial shape to 1e-8

using Task = ShapeTask<SurfaceEquilibrium, SurfaceEquilibriumSettings>;

Task task_of(const Problem& c, const Start& start) {
    const CurvedMesh mesh = start.mesh(std::max(c.surface.elements.value_or(0), many), c.element_order).mesh;
    const EnergyValues v = DiscreteEnergy(mesh, c.energy).values(mesh, c.energy);
    require_pressure(c, v.volume);
    refuse_potentials(c, mesh.period, v.potential, wall_distance(mesh, c.energy.potentials).value);
    Task task{stationary_problem(c, v.area, v.volume), {}, {}, {}};
    check_problem(c, task.problem, mesh.period);
    if (c.law.beads) {
        task.problem.bead_distance = bead_distance(mesh, c.law.beads->width);
        require_beads(c, mesh.period == 0, task.problem.bead_distance);
    }
    SurfaceEquilibriumSettings& s = task.settings;
    s.accuracy = c.accuracy.energy;
    s.descend = c.equilibrium->descend;
    s.first_triangles = std::max(s.first_triangles, triangles_for_places(c.energy.potentials, c.law.beads, v.area));
    s.near = std::holds_alternative<ResultFrame>(c.shape);
    s.modes = c.equilibrium->rates.value_or(0);
    if (s.modes > 0) s.law = c.law;
    if (!start.resizable())
        s.triangles = mesh.triangles();
    else
        s.triangles = c.surface.elements.value_or(0);
    task.resolve_branch(c);
    return task;
}

struct Row : ShapeRow<SurfaceEquilibrium> {
    const SurfaceEquilibrium& shape;
    std::vector<double> terms;
    double height, r_max;
};

// The centre of the area.
Eigen::Vector3d centre_of(const CurvedMesh& mesh) {
    const SurfaceSpace space(mesh);
    const auto moments = load<4>(space, mesh, [&](int, const CellColumns<3>& X, int q, CellColumns<4>& out) {
        const SurfacePoint<double> p = tangent_point(X, space.tabulation(), q);
        out.col(0) += space.tabulation().weight[q] * p.area * p.x.homogeneous();
    });
    return moments.rowwise().sum().eval().hnormalized();
}

// Along z, and from the axis in this direction through the centre.
std::array<double, 2> height_and_radius(const CurvedMesh& mesh) {
    const Eigen::Vector3d centre = mesh.period > 0 ? Eigen::Vector3d::Zero().eval() : centre_of(mesh);
    double low = HUGE_VAL, high = -HUGE_VAL, r = 0;
    for (const Eigen::Vector3d& x : mesh.nodes) low = std::min(low, x.z()), high = std::max(high, x.z());
    for (const Eigen::Vector3d& x : mesh.nodes) r = std::max(r, (x - centre).head<2>().norm());
    return {mesh.period > 0 ? mesh.period : high - low, r};
}

// Those of modes: rate_<i>, its error, and of fluids frequencies.
void add_rates(const Problem& c, SeriesTable<Row>& table) {
    std::vector<std::string> numbers;
    for (int i = 1; i <= c.equilibrium->rates.value_or(0); ++i) numbers.push_back(std::to_string(i));
    const auto add = [&](SeriesName name, Eigen::VectorXd SurfaceSpectrum::*of, double sign, double otherwise) {
        table.add_family(name, numbers, [=](const Row& r, std::size_t i) {
            const Eigen::VectorXd& values = r.shape.spectrum.*of;
            return static_cast<Eigen::Index>(i) < values.size() ? sign * values[i] : otherwise;
        });
    };
    add("rate_<i>", &SurfaceSpectrum::values, -1, 0), add("rate_error_<i>", &SurfaceSpectrum::errors, 1, -1);
    if (c.law.inertia != 0 && c.law.inextensible)
        add("frequency_<i>", &SurfaceSpectrum::frequencies, 1, 0),
            add("frequency_error_<i>", &SurfaceSpectrum::frequency_errors, 1, -1);
    table.add_family("wave_number_<i>", numbers, [](const Row& r, std::size_t i) {
        return i < r.shape.wave_numbers.size() ? r.shape.wave_numbers[i] : -1.0;
    });
}

SeriesTable<Row> shape_series(const Problem& c) {
    SeriesTable<Row> table;
    add_first_columns(table, c.equilibrium->branch);
    table.add_family("energy_<kl>", term_names(c.energy), [](const Row& r, std::size_t term) { return r.terms[term]; });
    if (c.energy.alpha)
        table.add(
            {{"energy_alpha", [](const Row& r) { return area_difference_energy(r.problem.bending, r.shape.values.M); }},
             {"M", [](const Row& r) { return r.shape.values.M; }}});
    if (!c.energy.potentials.empty())
        table.add({{"potential_energy", [](const Row& r) { return r.shape.values.potential; }},
                   {"potential_force", [](const Row& r) { return r.shape.values.potential_force; }}});
    add_extents(table);
    if (c.law.beads || may_have_period(c.shape))
        table.add({{"force", [](const Row& r) { return r.shape.beads.force; }}});
    if (c.law.beads) table.add({{"bead_distance", [](const Row& r) { return r.extents.length; }}});
    table.add({{"negative_directions", [](const Row& r) { return static_cast<double>(r.point.index); }}});
    add_rates(c, table);
    table.add({{"height", [](const Row& r) { return r.height; }},
               {"r_max", [](const Row& r) { return r.r_max; }},
               {"quality", [](const Row& r) { return mesh_quality(r.shape.mesh).worst; }}});
    add_last_columns(table);
    return table;
}

// The energy of each term: the discrete energy is linear in the moduli, its penalty included.
std::vector<double> energy_terms(const Bending& energy, const CurvedMesh& mesh) {
    std::vector<double> out;
    for (std::size_t i = 0; i < count_terms(energy); ++i) {
        Bending one = energy;
        one.alpha.reset(), one.potentials.clear();
        for (std::size_t j = 0; j < count_terms(energy); ++j)
            if (j != i) modulus(one, j) = 0;
        out.push_back(modulus(one, i) == 0 ? 0 : DiscreteEnergy(mesh, one).values(mesh, one).energy);
    }
    return out;
}

Record frame_of(const Row& row, std::size_t mesh_number, int modes) {
    const SurfaceEquilibrium& shape = row.shape;
    Record out;
    out.time = row.number, out.mesh = mesh_number, out.kind = RecordKind::surface;
    const CurvedMesh& mesh = shape.mesh;
    const CurvatureField field = PatchRecovery(mesh).projected(SurfaceSpace(mesh), mesh);
    Eigen::RowVectorXd energy_density(mesh.size());
    for (int i = 0; i < mesh.size(); ++i) energy_density[i] = density(row.problem.bending, field.H[i], field.K[i]).f;
    out.numbers = {{"energy", shape.values.energy}, {"tension", shape.sigma}, {"pressure", -shape.lambda}};
    out.arrays = {array("points", node_positions(mesh)), array("normal", field.normal), array("H", field.H),
                  array("K", field.K), array("energy_density", energy_density)};
    for (Eigen::Index i = 0; i < std::min<Eigen::Index>(shape.spectrum.vectors.cols(), modes); ++i) {
        const Eigen::VectorXd w = shape.spectrum.vectors.col(i).head(mesh.size());
        out.arrays.push_back(array(fmt::format("mode_{}", i + 1), Eigen::VectorXd(w / w.cwiseAbs().maxCoeff())));
    }
    return out;
}

// What run_shapes() asks for.
class SurfaceShapes {
public:
    using Shape = SurfaceEquilibrium;

    SurfaceShapes(const Problem& c, const Start& start)
        : c_(c), start_(start), task_(task_of(c, start)), series_(shape_series(c)) {}

    const Task& task() const { return task_; }
    SurfaceEquilibrium find() const {
        SurfaceEquilibrium shape = find_equilibrium(
            task_.problem, [&](int triangles) { return start_.mesh(triangles, c_.element_order).mesh; },
            task_.settings);
        if (shape.stop == Stop::finished)
            if (const auto meets = find_self_intersection(shape.mesh))
                shape.stop = meets->reason, shape.message = meets->message;
        return shape;
    }
    static int negative_directions(const SurfaceEquilibrium& e) { return e.spectrum.negative; }
    static double energy(const SurfaceEquilibrium& e) { return e.values.energy; }
    static Extents extents(const StationaryProblem& problem, const SurfaceEquilibrium& e) {
        return {e.values.area, e.values.volume, length(problem, e)};
    }
    static int elements(const SurfaceEquilibrium& e) { return e.mesh.triangles(); }

    void write(const ShapeRow<SurfaceEquilibrium>& at, RunObserver& observer) const {
        const SurfaceEquilibrium& e = at.point.shape;
        const auto [height, r_max] = height_and_radius(e.mesh);
        const Row row{at, e, energy_terms(at.problem.bending, e.mesh), height, r_max};
        observer.row(series_.values(row));
        const std::size_t mesh_number = observer.mesh(cells_of(e.mesh));
        observer.frame([&] {
            Record out = frame_of(row, mesh_number, c_.equilibrium->rates.value_or(0));
            if (task_.set) out.numbers.emplace_back("parameter", at.point.parameter);
            return out;
        });
    }

    static std::string advice(Stop stop) {
        switch (stop) {
            case Stop::solver_failed:
                return "begin with a shape closer to the solution, such as a result of tier \"axisym\"";
            case Stop::resolution_lost:
                return "use a looser accuracy.energy";
            case Stop::mesh_lost:
                return "use more elements, or discretisation.mesh = \"graded\"";
            case Stop::self_intersection:
                return "the equations can still be solved, but their solution is no longer an embedded surface";
            default:
                return "";
        }
    }

    void describe(const FoundShapes<SurfaceEquilibrium>& found, RunSummary& s) const {
        const CurvedMesh& mesh = found.last.mesh;
        if (s.stop.reason == Stop::finished && !s.as_accurate_as_asked)
            s.warnings.push_back(
                fmt::format("the energy is less accurate than asked, {:.1e} for {:.1e} of E_ref: the "
                            "triangles are given",
                            s.estimated_error, c_.accuracy.energy));
        s.effort = fmt::format("{} triangles of order {}, {} nodes, {} Newton steps", mesh.triangles(), mesh.order,
                               mesh.size(), found.iterations);
        if (task_.set) s.effort = fmt::format("{} shapes; the last: {}", found.count, s.effort);
        s.details.insert(s.details.end(), {{"nodes", std::int64_t{mesh.size()}}, {"order", std::int64_t{mesh.order}}});
    }

private:
    const Problem& c_;
    const Start& start_;
    const Task task_;
    const SeriesTable<Row> series_;
};

}  // namespace

std::vector<std::string> equilibrium_series_names(const Problem& c) {
    return shape_series(c).names();
}

void check_equilibrium(const Problem& c, const Start& start) {
    task_of(c, start);
}

RunSummary run_equilibrium(const Problem& c, const Start& start, RunObserver& observer) {
    const RunClock clock(c.time, observer);
    return clock.pausing([&] {
        SurfaceShapes shapes(c, start);
        RunSummary s = run_shapes(c, shapes, clock, observer);
        s.warnings.insert(s.warnings.begin(), start.notes().begin(), start.notes().end());
        return s;
    });
}

}  // namespace tubule::surface3d
