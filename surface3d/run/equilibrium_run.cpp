#include "surface3d/run/equilibrium_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/case/read.hpp"
#include "common/equilibrium/equilibrium_task.hpp"
#include "common/run/energy_checks.hpp"
#include "common/run/run_clock.hpp"
#include "common/series/table.hpp"
#include "surface3d/equilibrium/surface_branch.hpp"
#include "surface3d/fem/mesh_quality.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/run/guards.hpp"
#include "surface3d/run/mesh_record.hpp"

namespace tubule::surface3d {
namespace {

constexpr int many = 2000;  // triangles, for the area and volume of an initial shape to 1e-8

struct Task {
    StationaryProblem problem;
    SurfaceEquilibriumSettings settings;
    SetParameter set;  // of a branch
    BranchSettings branch;
};

Task task_of(const Problem& c, const Start& start) {
    const CurvedMesh mesh = start.mesh(std::max(c.surface.elements.value_or(0), many), c.element_order).mesh;
    const EnergyValues v = DiscreteEnergy(mesh, c.energy).values(mesh, c.energy);
    require_pressure(c, v.volume);
    refuse_potentials(c, mesh.period == 0, v.potential, wall_distance(mesh, c.energy.potentials).value);
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
    if (const BranchChoices& b = c.equilibrium->branch; b.parameter) {
        task.set = setter(*b.parameter);
        task.branch.shapes = s;
        task.branch.output = branch_outputs(c, task.problem);
        task.branch.from = task.branch.output.front(), task.branch.to = task.branch.output.back();
        task.branch.branches = b.branches;
        task.branch.mode = b.mode.value_or(0), task.branch.amplitude = b.amplitude.value_or(task.branch.amplitude);
    }
    return task;
}

struct ShapeRow {
    int number;
    const BranchPoint& point;
    const StationaryProblem& problem;
    const SurfaceEquilibrium& shape;
    const std::vector<double>& terms;
    double height, r_max, wall_seconds;
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

SeriesTable<ShapeRow> shape_series(const Problem& c) {
    SeriesTable<ShapeRow> table;
    table.add({{"time", [](const ShapeRow& r) { return static_cast<double>(r.number); }}});
    if (c.equilibrium->branch.parameter)
        table.add({{"parameter", [](const ShapeRow& r) { return r.point.parameter; }},
                   {"special", [](const ShapeRow& r) { return static_cast<double>(r.point.kind); }}});
    if (c.equilibrium->branch.branches)
        table.add({{"branch", [](const ShapeRow& r) { return static_cast<double>(r.point.branch); }}});
    table.add({{"energy", [](const ShapeRow& r) { return r.shape.values.energy; }}});
    table.add_family("energy_<kl>", term_names(c.energy),
                     [](const ShapeRow& r, std::size_t term) { return r.terms[term]; });
    if (c.energy.alpha)
        table.add({{"energy_alpha",
                    [](const ShapeRow& r) { return area_difference_energy(r.problem.bending, r.shape.values.M); }},
                   {"M", [](const ShapeRow& r) { return r.shape.values.M; }}});
    if (!c.energy.potentials.empty())
        table.add({{"potential_energy", [](const ShapeRow& r) { return r.shape.values.potential; }},
                   {"potential_force", [](const ShapeRow& r) { return r.shape.values.potential_force; }}});
    table.add({{"free_energy",
                [](const ShapeRow& r) {
                    const EnergyValues& v = r.shape.values;
                    return v.energy + r.problem.loads.energy(v.area, v.volume, length(r.problem, r.shape));
                }},
               {"area", [](const ShapeRow& r) { return r.shape.values.area; }},
               {"volume", [](const ShapeRow& r) { return r.shape.values.volume; }},
               {"reduced_volume",
                [](const ShapeRow& r) { return reduced_volume(r.shape.values.area, r.shape.values.volume); }},
               {"tension", [](const ShapeRow& r) { return r.shape.sigma; }},
               {"pressure", [](const ShapeRow& r) { return -r.shape.lambda; }}});
    if (c.law.beads)
        table.add({{"force", [](const ShapeRow& r) { return r.shape.beads.force; }},
                   {"bead_distance", [](const ShapeRow& r) { return length(r.problem, r.shape); }}});
    table.add({{"negative_directions", [](const ShapeRow& r) {
                    return r.shape.stop == Stop::finished ? static_cast<double>(r.point.index) : -1.0;
                }}});
    std::vector<std::string> numbers;
    for (int i = 1; i <= c.equilibrium->rates.value_or(0); ++i) numbers.push_back(std::to_string(i));
    table.add_family("rate_<i>", numbers, [](const ShapeRow& r, std::size_t i) {
        const Eigen::VectorXd& values = r.shape.spectrum.values;
        return static_cast<Eigen::Index>(i) < values.size() ? -values[i] : 0.0;
    });
    table.add_family("rate_error_<i>", numbers, [](const ShapeRow& r, std::size_t i) {
        const Eigen::VectorXd& errors = r.shape.spectrum.errors;
        return static_cast<Eigen::Index>(i) < errors.size() ? errors[i] : -1.0;
    });
    table.add_family("wave_number_<i>", numbers, [](const ShapeRow& r, std::size_t i) {
        return i < r.shape.wave_numbers.size() ? r.shape.wave_numbers[i] : -1.0;
    });
    table.add({{"height", [](const ShapeRow& r) { return r.height; }},
               {"r_max", [](const ShapeRow& r) { return r.r_max; }},
               {"quality", [](const ShapeRow& r) { return mesh_quality(r.shape.mesh).worst; }},
               {"energy_error", [](const ShapeRow& r) { return r.shape.estimated_error * r.shape.reference_energy; }},
               {"elements", [](const ShapeRow& r) { return static_cast<double>(r.shape.mesh.triangles()); }},
               {"wall_seconds", [](const ShapeRow& r) { return r.wall_seconds; }}});
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

Record frame_of(const ShapeRow& row, std::size_t mesh_number, int modes) {
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

std::string advice_for(Stop stop) {
    switch (stop) {
        case Stop::solver_failed:
            return "begin with a shape closer to the solution, such as a result of tier \"axisym\"";
        case Stop::resolution_lost:
            return "raise accuracy.energy";
        case Stop::mesh_lost:
            return "use more elements, or discretisation.mesh = \"graded\"";
        case Stop::self_intersection:
            return "the equations can still be solved, but their solution is no longer an embedded surface";
        default:
            return "";
    }
}

// Rows, frames and meshes of the shapes, as they are found.
class ShapeWriter {
public:
    ShapeWriter(const Problem& c, const Task& task, const RunClock& clock, RunObserver& observer)
        : c_(c), task_(task), clock_(clock), observer_(observer), series_(shape_series(c)) {}

    void operator()(const BranchPoint& point) {
        const SurfaceEquilibrium& e = point.shape;
        StationaryProblem problem = task_.problem;
        if (task_.set) task_.set(problem, point.parameter);
        const auto [height, r_max] = height_and_radius(e.mesh);
        const std::vector<double> terms = energy_terms(problem.bending, e.mesh);
        const ShapeRow row{count_, point, problem, e, terms, height, r_max, clock_.seconds()};
        observer_.row(series_.values(row));
        const std::size_t mesh_number = observer_.mesh(cells_of(e.mesh));
        observer_.frame([&] {
            Record out = frame_of(row, mesh_number, c_.equilibrium->rates.value_or(0));
            if (task_.set) out.numbers.emplace_back("parameter", point.parameter);
            return out;
        });
        observer_.progress(point.parameter, e.values.energy, 0);
        worst_ = std::max(worst_, e.estimated_error), iterations_ += e.iterations;
        last_ = e;
        ++count_;
    }

    int count() const { return count_; }
    int iterations() const { return iterations_; }
    double worst() const { return count_ > 0 ? std::min(worst_, 1.0) : 1; }
    const SurfaceEquilibrium& last() const { return last_; }

private:
    const Problem& c_;
    const Task& task_;
    const RunClock& clock_;
    RunObserver& observer_;
    SeriesTable<ShapeRow> series_;
    int count_ = 0, iterations_ = 0;
    double worst_ = 0;
    SurfaceEquilibrium last_;
};

// Writes the shape, or those of the branch, and says how it ended; adds what to warn of.
StopReport find_shapes(const Problem& c, const Start& start, const Task& task, ShapeWriter& write,
                       std::vector<std::string>& warnings) {
    BranchPoint first;
    first.shape = find_equilibrium(
        task.problem, [&](int triangles) { return start.mesh(triangles, c.element_order).mesh; }, task.settings);
    SurfaceEquilibrium& shape = first.shape;
    if (shape.stop == Stop::finished)
        if (const auto meets = find_self_intersection(shape.mesh))
            shape.stop = meets->reason, shape.message = meets->message;
    if (shape.stop != Stop::finished || !task.set) {
        first.parameter = task.branch.from, first.index = shape.spectrum.negative;
        write(first);
        return {shape.stop, 0, shape.stop == Stop::finished ? "the shape is stationary" : shape.message,
                advice_for(shape.stop)};
    }
    BranchSettings settings = task.branch;
    settings.found = [&](const BranchPoint& point) {
        write(point);
        pause_if_due();
    };
    Branch branch = follow_branches(task.problem, shape, task.set, settings, follow_branch);
    warnings = std::move(branch.warnings);
    return {branch.stop, 0, branch.stop == Stop::finished ? "the branch left its parameter interval" : branch.message,
            advice_for(branch.stop)};
}

RunSummary summary_of(const Problem& c, const ShapeWriter& written, StopReport stop) {
    const SurfaceEquilibrium& shape = written.last();
    RunSummary s;
    if (std::string endless = unbounded_below(c.energy); !endless.empty()) s.warnings.push_back(std::move(endless));
    stop.time = std::max(written.count() - 1, 0);
    s.stop = std::move(stop);
    s.energy = shape.values.energy;
    s.reference_energy = shape.reference_energy;
    s.elements = shape.mesh.triangles();
    s.estimated_error = written.worst();
    s.as_accurate_as_asked = s.estimated_error <= c.accuracy.energy;
    if (s.stop.reason == Stop::finished && !s.as_accurate_as_asked)
        s.warnings.push_back(
            fmt::format("the energy is less accurate than asked, {:.1e} for {:.1e} of E_ref: the "
                        "triangles are given",
                        s.estimated_error, c.accuracy.energy));
    s.effort = fmt::format("{} triangles of order {}, {} nodes, {} Newton steps", shape.mesh.triangles(),
                           shape.mesh.order, shape.mesh.size(), written.iterations());
    if (c.equilibrium->branch.parameter) s.effort = fmt::format("{} shapes; the last: {}", written.count(), s.effort);
    s.details = {{"shapes", std::int64_t{written.count()}},
                 {"elements", std::int64_t{shape.mesh.triangles()}},
                 {"nodes", std::int64_t{shape.mesh.size()}},
                 {"order", std::int64_t{shape.mesh.order}}};
    return s;
}

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
        const Task task = task_of(c, start);
        ShapeWriter write(c, task, clock, observer);
        StopReport stop;
        std::vector<std::string> warnings;
        try {
            stop = find_shapes(c, start, task, write, warnings);
        } catch (const Paused& pause) {
            if (write.count() == 0) throw;
            stop = pause_report(pause, 0);
            stop.message += " before all shapes were found";
            stop.advice = "run the case again: equilibria are not resumed";
        }
        RunSummary s = summary_of(c, write, std::move(stop));
        s.warnings.insert(s.warnings.end(), warnings.begin(), warnings.end());
        s.warnings.insert(s.warnings.begin(), start.notes().begin(), start.notes().end());
        return s;
    });
}

}  // namespace tubule::surface3d
