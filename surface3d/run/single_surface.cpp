#include "surface3d/run/single_surface.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "common/result/record.hpp"
#include "common/run/driver.hpp"
#include "common/series/table.hpp"
#include "common/solve/sparse.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/run/guards.hpp"
#include "surface3d/run/mesh_record.hpp"
#include "surface3d/run/motion_start.hpp"

namespace tubule::surface3d {
namespace {

constexpr int fewest_triangles = 80, most_refined_triangles = 100000;
// The estimate assumes that halving the width reduces errors by a factor between this and fall_of().
constexpr double slowest_fall = 1.0 / 2;

// Less than by the orders of energies, which are 4, and 6 with elements of order 4, by curvatures recovered from nodes.
// Second derivatives of the elements are of order 2, however fast the first meshes seem to get better.
double fall_of(const Problem& c) {
    const Recovery recovery = c.surface.recovery;
    const bool from_nodes =
        recovery == Recovery::patch || recovery == Recovery::patch_nodal || recovery == Recovery::exact;
    if (!from_nodes) return 1.0 / 4;
    return c.element_order == 4 ? 1.0 / 32 : 1.0 / 8;
}

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

Measured measure(const Problem& c, StartMesh start, Recovery recovery) {
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
    require_defined(c, mesh, out.curvature.H, out.curvature.K);
    out.o = observe(space, mesh, out.curvature, c.energy);
    out.stop = find_impossible_curvature(out.o, mesh);
    return out;
}

// The error of the last of these energies, each on a mesh of half the width of the one before it.
double estimated_error(const std::vector<double>& energies, double least_fall) {
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

double reference_energy(const Observables& o) {
    return std::max(std::abs(o.energy), o.magnitude);
}

// A shape on a sequence of meshes, whose energies give the error of the last one, which is kept for the result.
class MeshSequence : public EstimatedRuns {
public:
    MeshSequence(const Problem& c, const Start& start) : case_(c), start_(start) {}

    RunSummary& next() override {
        double error = 0;
        try {
            error = measure_next();
        } catch (const Paused& pause) {
            if (!measured_) throw;
            summary_.stop = pause_report(pause, 0);
            summary_.stop.message += ", before a finer mesh was measured";
            summary_.stop.advice = paused_at_start(pause).stop.advice;  // it cannot be resumed
            return summary_;
        }
        const Observables& o = measured_->o;
        ++meshes_;
        error_ = std::isfinite(error) ? error : reference_energy(o);  // all of it where nothing is known as yet
        summary_ = {};
        summary_.stop = measured_->stop.value_or(
            StopReport{Stop::finished, 0, "geometry, curvature and energies of the shape", ""});
        summary_.energy = o.energy;
        summary_.reference_energy = reference_energy(o);
        summary_.estimated_error = summary_.reference_energy > 0 ? error_ / summary_.reference_energy : 1;
        summary_.warnings = start_.notes();
        describe_effort();
        return summary_;
    }

    const std::optional<Measured>& measured() const { return measured_; }  // none before the first next()
    double error() const { return error_; }                                // of the energy, absolute

protected:
    // Measures the shape on the next mesh; the error of its energy, infinite where that is not known.
    virtual double measure_next() = 0;

    double measure_on(int triangles) {
        measured_ = measure(case_, start_.mesh(triangles, case_.element_order), case_.surface.recovery);
        return measured_->o.energy;
    }

    const Problem& case_;
    const Start& start_;
    std::optional<Measured> measured_;
    int meshes_ = 0;

private:
    void describe_effort() {
        const CurvedMesh& mesh = measured_->start.mesh;
        summary_.elements = mesh.triangles();
        summary_.effort = fmt::format("{} triangles of order {}, {} nodes", mesh.triangles(), mesh.order, mesh.size());
        summary_.details = {{"elements", std::int64_t{mesh.triangles()}},
                            {"nodes", std::int64_t{mesh.size()}},
                            {"order", std::int64_t{mesh.order}},
                            {"meshes", std::int64_t{meshes_}}};
    }

    RunSummary summary_;
    double error_ = 0;
};

// A mesh that is given: compared with the same triangles one order lower, or at the lowest with another recovery.
class GivenMesh : public MeshSequence {
public:
    using MeshSequence::MeshSequence;
    bool refine(const RunSummary&) override { return false; }
    std::string fixed_by() const override { return "the triangles are given"; }

private:
    double measure_next() override {
        StartMesh start = start_.mesh(0, case_.element_order);
        const int order = start.mesh.order;
        const Measured other = order > 2
                                   ? measure(case_, {with_order(start.mesh, order - 1), {}, {}}, case_.surface.recovery)
                                   : measure(case_, start, Recovery::normal);
        measured_ = measure(case_, std::move(start), case_.surface.recovery);
        return given_mesh_margin * std::abs(measured_->o.energy - other.o.energy);
    }
};

// A given number of triangles, compared with a quarter and a sixteenth of them. No other mesh is compared, so that
// cancellation may understate the error.
class GivenElements : public MeshSequence {
public:
    GivenElements(const Problem& c, const Start& start, int elements) : MeshSequence(c, start), elements_(elements) {
        while (part_ > 1 && elements_ / part_ < fewest_triangles) part_ /= 4;
    }
    bool refine(const RunSummary&) override {
        if (part_ == 1) return false;
        part_ /= 4;
        return true;
    }
    std::string fixed_by() const override { return "the triangles are given"; }

private:
    double measure_next() override {
        energies_.push_back(measure_on(elements_ / part_));
        return estimated_error(energies_, std::min(2 * fall_of(case_), 1.0 / 4));
    }

    int elements_, part_ = 16;
    std::vector<double> energies_;
};

// Doubles the triangles until the energy is as accurate as asked. Every other mesh has half the width; those in between
// are compared separately, so that two energies which agree by chance do not end it.
class MoreAndMore : public MeshSequence {
public:
    using MeshSequence::MeshSequence;
    bool refine(const RunSummary& last) override {
        if ((last.as_accurate_as_asked && !measured_->stop) || 2 * triangles_ > most_refined_triangles) return false;
        triangles_ *= 2;
        return true;
    }
    std::string fixed_by() const override { return ""; }

private:
    double measure_next() override {
        std::vector<double>& same = energies_[meshes_ % 2];
        same.push_back(measure_on(triangles_));
        const double fall = fall_of(case_);
        const double before = std::exchange(before_, estimated_error(same, fall));
        return std::max(before_, std::sqrt(fall) * before);
    }

    int triangles_ = fewest_triangles;
    std::vector<double> energies_[2];
    double before_ = std::numeric_limits<double>::infinity();
};

std::unique_ptr<MeshSequence> meshes_of(const Problem& c, const Start& start) {
    if (!start.resizable()) return std::make_unique<GivenMesh>(c, start);
    if (c.surface.elements) return std::make_unique<GivenElements>(c, start, *c.surface.elements);
    return std::make_unique<MoreAndMore>(c, start);
}

struct SingleRow {
    const Measured& m;
    const Observables& o;
    const CurvedMesh& mesh;
    double energy_error, wall_seconds;
};

SeriesTable<SingleRow> single_series(const Problem& c) {
    SeriesTable<SingleRow> table;
    table.add({{"time", [](const SingleRow&) { return 0.0; }}});
    add_energies(table, c.energy, [](const SingleRow& r) -> const Observables& { return r.o; });
    table.add({
        {"area", [](const SingleRow& r) { return r.o.area; }},
        {"volume", [](const SingleRow& r) { return r.o.volume; }},
        {"integral_H2", [](const SingleRow& r) { return r.o.integral_H2; }},
        {"integral_K", [](const SingleRow& r) { return r.o.integral_K; }},
        {"gauss_bonnet_defect", [](const SingleRow& r) { return gauss_bonnet_defect(r.o, r.mesh); }},
        {"quality", [](const SingleRow& r) { return r.m.quality.worst; }},
        {"energy_error", [](const SingleRow& r) { return r.energy_error; }},
        {"elements", [](const SingleRow& r) { return static_cast<double>(r.mesh.triangles()); }},
        {"mesh_width",
         [](const SingleRow& r) { return std::sqrt(r.o.area / r.mesh.triangles() * 4 / std::sqrt(3.0)); }},
        {"wall_seconds", [](const SingleRow& r) { return r.wall_seconds; }},
    });
    return table;
}

Record frame(const Problem& c, const Measured& m, std::size_t mesh_number) {
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

}  // namespace

std::vector<std::string> single_series_names(const Problem& c) {
    return single_series(c).names();
}

RunSummary run_single(const Problem& c, const Start& start, RunObserver& observer) {
    const RunClock clock(c.time, observer);
    const auto meshes = meshes_of(c, start);
    RunSummary s = clock.pausing([&] { return drive(c, observer, clock, *meshes); });
    if (!meshes->measured()) return s;
    const Measured& m = *meshes->measured();
    if (m.has_curvature())
        observer.row(single_series(c).values({m, m.o, m.start.mesh, meshes->error(), clock.seconds()}));
    const std::size_t mesh_number = observer.mesh(cells_of(m.start.mesh));
    observer.frame([&] { return frame(c, m, mesh_number); });
    return s;
}

}  // namespace tubule::surface3d
