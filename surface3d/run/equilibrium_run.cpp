#include "surface3d/run/equilibrium_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/case/read.hpp"
#include "common/equilibrium/equilibrium_task.hpp"
#include "common/run/run_clock.hpp"
#include "common/series/table.hpp"
#include "surface3d/equilibrium/surface_equilibrium.hpp"
#include "surface3d/fem/mesh_quality.hpp"
#include "surface3d/run/guards.hpp"
#include "surface3d/run/mesh_record.hpp"

namespace tubule::surface3d {
namespace {

constexpr int many = 2000;  // triangles, for the area and volume of an initial shape to 1e-8

struct Task {
    StationaryProblem problem;
    SurfaceEquilibriumSettings settings;
};

Task task_of(const Problem& c, const Start& start) {
    const CurvedMesh mesh = start.mesh(std::max(c.surface.elements.value_or(0), many), c.element_order).mesh;
    const EnergyValues v = DiscreteEnergy(mesh, c.energy).values(mesh, c.energy);
    Task task{stationary_problem(c, v.area, v.volume), {}};
    check_problem(c, task.problem, mesh.period);
    SurfaceEquilibriumSettings& s = task.settings;
    s.accuracy = c.accuracy.energy;
    s.descend = c.equilibrium->descend;
    s.near = std::holds_alternative<ResultFrame>(c.shape);
    s.modes = c.equilibrium->rates.value_or(1);
    if (!start.resizable())
        s.triangles = mesh.triangles();
    else
        s.triangles = c.surface.elements.value_or(0);
    return task;
}

struct ShapeRow {
    const Problem& c;
    const Task& task;
    const SurfaceEquilibrium& shape;
    const std::vector<double>& terms;
    double height, r_max, wall_seconds;
};

// Along z, and from the axis in this direction through the centre.
std::array<double, 2> height_and_radius(const CurvedMesh& mesh) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double low = HUGE_VAL, high = -HUGE_VAL, r = 0;
    for (const Eigen::Vector3d& x : mesh.nodes) {
        centre += x / static_cast<double>(mesh.size());
        low = std::min(low, x.z()), high = std::max(high, x.z());
    }
    if (mesh.period > 0) centre.setZero();
    for (const Eigen::Vector3d& x : mesh.nodes) r = std::max(r, (x - centre).head<2>().norm());
    return {mesh.period > 0 ? mesh.period : high - low, r};
}

SeriesTable<ShapeRow> shape_series(const Problem& c) {
    SeriesTable<ShapeRow> table;
    table.add({{"time", [](const ShapeRow&) { return 0.0; }},
               {"energy", [](const ShapeRow& r) { return r.shape.values.energy; }}});
    table.add_family("energy_<kl>", term_names(c.energy),
                     [](const ShapeRow& r, std::size_t term) { return r.terms[term]; });
    if (c.energy.alpha)
        table.add({{"energy_alpha",
                    [](const ShapeRow& r) { return area_difference_energy(r.c.energy, r.shape.values.M); }},
                   {"M", [](const ShapeRow& r) { return r.shape.values.M; }}});
    table.add({{"free_energy",
                [](const ShapeRow& r) {
                    const EnergyValues& v = r.shape.values;
                    return v.energy + r.task.problem.loads.energy(v.area, v.volume, r.shape.mesh.period);
                }},
               {"area", [](const ShapeRow& r) { return r.shape.values.area; }},
               {"volume", [](const ShapeRow& r) { return r.shape.values.volume; }},
               {"reduced_volume",
                [](const ShapeRow& r) { return reduced_volume(r.shape.values.area, r.shape.values.volume); }},
               {"tension", [](const ShapeRow& r) { return r.shape.sigma; }},
               {"pressure", [](const ShapeRow& r) { return -r.shape.lambda; }},
               {"negative_directions",
                [](const ShapeRow& r) {
                    return r.shape.stop == Stop::finished ? static_cast<double>(r.shape.spectrum.negative) : -1.0;
                }}});
    std::vector<std::string> numbers;
    for (int i = 1; i <= c.equilibrium->rates.value_or(0); ++i) numbers.push_back(std::to_string(i));
    table.add_family("rate_<i>", numbers, [](const ShapeRow& r, std::size_t i) {
        const Eigen::VectorXd& values = r.shape.spectrum.values;
        return static_cast<Eigen::Index>(i) < values.size() ? -values[i] : 0.0;
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
        one.alpha.reset();
        for (std::size_t j = 0; j < count_terms(energy); ++j)
            if (j != i) modulus(one, j) = 0;
        out.push_back(modulus(one, i) == 0 ? 0 : DiscreteEnergy(mesh, one).values(mesh, one).energy);
    }
    return out;
}

Record frame_of(const Problem& c, const SurfaceEquilibrium& shape, std::size_t mesh_number) {
    Record out;
    out.mesh = mesh_number, out.kind = RecordKind::surface;
    const CurvedMesh& mesh = shape.mesh;
    const CurvatureField field = PatchRecovery(mesh).projected(SurfaceSpace(mesh), mesh);
    Eigen::RowVectorXd energy_density(mesh.size());
    for (int i = 0; i < mesh.size(); ++i) energy_density[i] = density(c.energy, field.H[i], field.K[i]).f;
    out.numbers = {{"energy", shape.values.energy}, {"tension", shape.sigma}, {"pressure", -shape.lambda}};
    out.arrays = {array("points", node_positions(mesh)), array("normal", field.normal), array("H", field.H),
                  array("K", field.K), array("energy_density", energy_density)};
    for (Eigen::Index i = 0; i < std::min<Eigen::Index>(shape.spectrum.vectors.cols(), c.equilibrium->rates.value_or(0)); ++i) {
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

RunSummary summary_of(const Problem& c, SurfaceEquilibrium& shape) {
    if (shape.stop == Stop::finished)
        if (const auto meets = find_self_intersection(shape.mesh))
            shape.stop = meets->reason, shape.message = meets->message;
    RunSummary s;
    if (std::string endless = unbounded_below(c.energy); !endless.empty()) s.warnings.push_back(std::move(endless));
    s.stop = {shape.stop, 0, shape.stop == Stop::finished ? "the shape is stationary" : shape.message,
              advice_for(shape.stop)};
    s.energy = shape.values.energy;
    s.reference_energy = shape.reference_energy;
    s.elements = shape.mesh.triangles();
    s.estimated_error = std::min(shape.estimated_error, 1.0);
    s.as_accurate_as_asked = s.estimated_error <= c.accuracy.energy;
    if (shape.stop == Stop::finished && !s.as_accurate_as_asked)
        s.warnings.push_back(fmt::format("the energy is less accurate than asked, {:.1e} for {:.1e} of E_ref: the "
                                         "triangles are given",
                                         s.estimated_error, c.accuracy.energy));
    s.effort = fmt::format("{} triangles of order {}, {} nodes, {} Newton steps", shape.mesh.triangles(),
                           shape.mesh.order, shape.mesh.size(), shape.iterations);
    s.details = {{"shapes", std::int64_t{1}},
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
        SurfaceEquilibrium shape = find_equilibrium(
            task.problem, [&](int triangles) { return start.mesh(triangles, c.element_order).mesh; }, task.settings);
        RunSummary s = summary_of(c, shape);
        const auto [height, r_max] = height_and_radius(shape.mesh);
        const std::vector<double> terms = energy_terms(c.energy, shape.mesh);
        observer.row(shape_series(c).values({c, task, shape, terms, height, r_max, clock.seconds()}));
        const std::size_t mesh_number = observer.mesh(cells_of(shape.mesh));
        observer.frame([&] { return frame_of(c, shape, mesh_number); });
        s.warnings.insert(s.warnings.begin(), start.notes().begin(), start.notes().end());
        return s;
    });
}

}  // namespace tubule::surface3d
