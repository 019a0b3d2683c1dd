#include "surface3d/run/run.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "common/result/record.hpp"
#include "common/solve/sparse.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/run/guards.hpp"
#include "surface3d/run/mesh_record.hpp"

namespace tubule::surface3d {
namespace {

constexpr int fewest_triangles = 80, most_triangles = 100000;
// From a mesh to one of half the width, errors fall by a factor between these: what the estimate takes for possible.
constexpr double slowest_fall = 1.0 / 2, fastest_fall = 1.0 / 8;

// A surface fitted to 720 points of an ellipsoid was 1.2 times further off than its two orders were apart.
constexpr double given_mesh_margin = 2;

// A shape on one mesh. Where `stop` is set, what comes after the mesh may be missing.
struct Measured {
    StartMesh start;
    MeshQuality quality;
    CurvatureField curvature;
    Observables o;
    std::optional<StopReport> stop;

    bool has_curvature() const { return curvature.H.size() > 0; }
};

Measured measure(const Case& c, StartMesh start, Recovery recovery) {
    Measured out{std::move(start), {}, {}, {}, {}};
    const CurvedMesh& mesh = out.start.mesh;
    out.quality = mesh_quality(mesh);
    if ((out.stop = find_fold(out.quality))) return out;
    const SurfaceSpace space(mesh);
    try {
        out.curvature = out.start.exact ? *out.start.exact : recover(space, mesh, recovery);
        if (c.surface.smoothing > 0) smooth(space, mesh, c.surface.smoothing, out.curvature);
    } catch (const SolveError& error) {
        out.stop = StopReport{Stop::solver_failed, 0, fmt::format("curvature: {}", error.what()), "use another mesh"};
        return out;
    }
    out.o = observe(space, mesh, out.curvature, c.energy);
    out.stop = find_impossible_curvature(out.o, mesh);
    return out;
}

// The error of the last of these energies, each on a mesh of half the width of the one before it.
double estimated_error(const std::vector<double>& energies, double least_fall = fastest_fall) {
    const std::size_t n = energies.size();
    if (n < 2) return std::numeric_limits<double>::infinity();
    const double change = std::abs(energies[n - 1] - energies[n - 2]);
    double fall = slowest_fall;
    if (n > 2) {
        const double before = std::abs(energies[n - 2] - energies[n - 3]);
        fall = std::clamp(before > 0 ? change / before : slowest_fall, least_fall, slowest_fall);
    }
    return change * fall / (1 - fall);
}

struct Answer {
    Measured measured;
    double error = 0;  // of the energy, estimated, absolute
    int meshes = 1;
};

// A mesh that is given: compared with the same triangles one order lower, or at the lowest with another recovery.
Answer on_given_mesh(const Case& c, StartMesh start) {
    const int order = start.mesh.order;
    const Measured other = order > 2 ? measure(c, {with_order(start.mesh, order - 1), {}, {}}, c.surface.recovery)
                                     : measure(c, start, Recovery::normal);
    Answer answer{measure(c, std::move(start), c.surface.recovery), 0, 1};
    answer.error = given_mesh_margin * std::abs(answer.measured.o.energy - other.o.energy);
    return answer;
}

double reference_energy(const Observables& o) {
    return std::max(std::abs(o.energy), o.magnitude);
}

// An estimate, or if there is none as yet, all of the energy.
double error_or_all(double error, const Observables& o) {
    return std::isfinite(error) ? error : reference_energy(o);
}

StopReport interruption() {
    return {Stop::interrupted, 0, "interrupted by a signal", ""};
}

// So many triangles, compared with a quarter and a sixteenth of them. No other mesh is compared,
// so that cancellation may understate the error.
Answer on_elements(const Case& c, const Start& start, int elements, RunObserver& observer) {
    std::vector<double> energies;
    for (int part = 16;; part /= 4) {
        if (part > 1 && elements / part < fewest_triangles) continue;
        Answer answer{measure(c, start.mesh(elements / part, element_order(c)), c.surface.recovery), 0,
                      static_cast<int>(energies.size()) + 1};
        energies.push_back(answer.measured.o.energy);
        answer.error = error_or_all(estimated_error(energies, 1.0 / 4), answer.measured.o);
        if (part == 1) return answer;
        if (observer.interrupted()) {
            answer.measured.stop = interruption();
            return answer;
        }
    }
}

// Twice as many triangles again and again, until the energy is as accurate as asked. Every other mesh has half the
// width; those in between have their own say, so that two energies which agree by chance do not end it.
Answer as_accurate_as_asked(const Case& c, const Start& start, RunObserver& observer) {
    std::vector<double> energies[2];
    double before = std::numeric_limits<double>::infinity();
    for (int count = 0, triangles = fewest_triangles;; ++count, triangles *= 2) {
        Answer answer{measure(c, start.mesh(triangles, element_order(c)), c.surface.recovery), 0, count + 1};
        std::vector<double>& same = energies[count % 2];
        same.push_back(answer.measured.o.energy);
        const double error = estimated_error(same);
        answer.error = error_or_all(std::max(error, std::sqrt(fastest_fall) * before), answer.measured.o);
        before = error;
        if (observer.interrupted()) {
            answer.measured.stop = interruption();
            return answer;
        }
        const bool enough = answer.error <= c.accuracy.energy * reference_energy(answer.measured.o);
        if ((enough && !answer.measured.stop) || 2 * triangles > most_triangles) return answer;
    }
}

Answer answer_to(const Case& c, const Start& start, RunObserver& observer) {
    if (!start.resizable()) return on_given_mesh(c, start.mesh(0, element_order(c)));
    return c.surface.elements ? on_elements(c, start, *c.surface.elements, observer)
                              : as_accurate_as_asked(c, start, observer);
}

std::vector<double> row(const Answer& answer, double seconds) {
    const Observables& o = answer.measured.o;
    const CurvedMesh& mesh = answer.measured.start.mesh;
    std::vector<double> out{0, o.energy};
    out.insert(out.end(), o.energy_term.begin(), o.energy_term.end());
    const double width = std::sqrt(o.area / mesh.triangles() * 4 / std::sqrt(3.0));
    for (const double value :
         {o.area, o.volume, o.integral_H2, o.integral_K, gauss_bonnet_defect(o, mesh), answer.measured.quality.worst,
          answer.error, static_cast<double>(mesh.triangles()), width, seconds})
        out.push_back(value);
    return out;
}

Record frame(const Case& c, const Measured& m, std::size_t mesh_number) {
    const CurvatureField& field = m.curvature;
    Record out;
    out.mesh = mesh_number, out.kind = RecordKind::surface;
    const VectorField points = node_positions(m.start.mesh);
    out.arrays = {array("points", points)};
    if (!m.has_curvature()) return out;
    Eigen::RowVectorXd energy_density(points.cols());
    for (int i = 0; i < points.cols(); ++i) energy_density[i] = density(c.energy, field.H[i], field.K[i]).f;
    out.numbers = {{"energy", m.o.energy}};
    for (const Array& more : {array("normal", field.normal), array("H", field.H), array("K", field.K),
                              array("energy_density", energy_density)})
        out.arrays.push_back(more);
    return out;
}

// What the run came to, in the end.
StopReport stop_of(const Case& c, const Start& start, const Answer& answer, RunSummary& summary) {
    if (answer.measured.stop) return *answer.measured.stop;
    const StopReport done{Stop::finished, 0, "geometry, curvature and energies of the shape", ""};
    if (summary.as_accurate_as_asked) return done;
    const std::string missed = fmt::format("the energy is off by {:.2g} of E_ref (estimated), {:.2g} was asked for",
                                           summary.estimated_error, c.accuracy.energy);
    if (c.surface.elements || !start.resizable()) {
        summary.warnings.push_back(missed + ": the triangles are given");
        return done;
    }
    return {Stop::resolution_lost, 0, fmt::format("{}, even with {} triangles", missed, summary.elements),
            "ask for less accuracy: this shape, or this recovery, converges slowly"};
}

}  // namespace

std::vector<std::string> series_names(const Case& c) {
    if (c.moves()) return motion_series_names(c);
    std::vector<std::string> names{"time", "energy"};
    for_each_bending_term([&](std::size_t, const auto& term) { names.push_back(std::string("energy_") + term.name); });
    for (const char* name : {"area", "volume", "integral_H2", "integral_K", "gauss_bonnet_defect", "quality",
                             "energy_error", "elements", "mesh_width", "wall_seconds"})
        names.push_back(name);
    return names;
}

RunSummary run(const Case& c, RunObserver& observer, const Restart* restart) {
    return run(c, Start(c), observer, restart);
}

RunSummary run(const Case& c, const Start& start, RunObserver& observer, const Restart* restart) {
    if (c.moves()) return run_motion(c, start, observer, restart);
    const auto started = std::chrono::steady_clock::now();
    const Answer answer = answer_to(c, start, observer);
    const Measured& m = answer.measured;
    RunSummary s;
    s.energy = m.o.energy;
    s.reference_energy = reference_energy(m.o);
    s.estimated_error = s.reference_energy > 0 ? answer.error / s.reference_energy : 0;
    s.as_accurate_as_asked = s.estimated_error <= c.accuracy.energy;
    s.elements = m.start.mesh.triangles();
    s.warnings = start.notes();
    s.effort = fmt::format("{} triangles of order {}, {} nodes", s.elements, m.start.mesh.order, m.start.mesh.size());
    s.details = {{"elements", std::int64_t{s.elements}},
                 {"nodes", std::int64_t{m.start.mesh.size()}},
                 {"order", std::int64_t{m.start.mesh.order}},
                 {"meshes", std::int64_t{answer.meshes}}};
    s.stop = stop_of(c, start, answer, s);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    if (m.has_curvature()) observer.row(row(answer, seconds));
    const std::size_t mesh_number = observer.mesh(cells_of(m.start.mesh));
    observer.frame([&] { return frame(c, m, mesh_number); });
    return s;
}

}  // namespace tubule::surface3d
