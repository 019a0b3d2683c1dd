#include "tools/scan/point.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <optional>
#include <span>
#include <variant>

#include "axisym/curve/curve_measures.hpp"
#include "axisym/curve/vesicle_families.hpp"
#include "axisym/equilibrium/equilibrium_run.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "axisym/graph/graph_output.hpp"
#include "common/case/read.hpp"
#include "common/result/frame_profile.hpp"
#include "common/run/run_clock.hpp"
#include "common/series/table.hpp"
#include "common/solve/dense.hpp"
#include "common/solve/interrupt.hpp"
#include "tools/run/run_to_end.hpp"
#include "tools/scan/uniform_end.hpp"

namespace tubule {
namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
// A rate counts as none below this part of the fastest one: a tube may be shifted along itself at no cost.
constexpr double translation = 1e-12;
// Places in stop_words() behind the reasons why runs end.
constexpr int decided_word = static_cast<int>(stop_kinds.size()), refused_word = decided_word + 1;
constexpr double near_rest = 0.1;           // distance to the equilibrium / amplitude
constexpr double next_stationarity = 1e-2;  // what a run that was not at rest is asked for next

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Keeps the last row and the last frame, and ends the run when its outcome is known.
class Watch : public RunObserver {
public:
    Watch(const Problem& c, std::vector<std::string> series, bool to_the_end)
        : keeps_frame_(c.time.stationary.has_value()), series_(std::move(series)) {
        if (!to_the_end) uniform_end_ = UniformEnd::of(c);
    }

    void row(std::span<const double> values) override {
        row_.assign(values.begin(), values.end());
        decided = uniform_end_ && uniform_end_->decided({last("energy"), last("volume"), last("r_min"), last("r_max")});
    }
    void frame(const std::function<Record()>& make) override {
        if (keeps_frame_) last_frame = make();
    }
    void discard() override {
        row_.clear();
        last_frame.reset();
        decided = false;
    }
    bool interrupted() override { return decided || tubule::interrupted(); }

    EndShape end(bool periodic) const { return {periodic, last("r_min"), last("r_max"), last("area"), last("volume")}; }

    bool decided = false;
    std::optional<Record> last_frame;

private:
    double last(const char* name) const { return value_in(row_, series_, name); }

    std::optional<UniformEnd> uniform_end_;
    bool keeps_frame_;
    std::vector<std::string> series_;
    std::vector<double> row_;
};

enum class Rest { here, on_its_way, on_a_saddle };

// Whether a graph r(z) that hardly moves is at rest: the energy falls in no direction, and Newton's method sees the
// stationary shape next to it so near that it is of the same kind. A wave that decays slowly fails the latter, for
// Newton's step takes it away as a whole (or, where its rate vanishes, a third of it). What is no graph is believed.
Rest rest_of(const Problem& c, const Record& frame, double r_min, double r_max) {
    if (kind_of(frame) != RecordKind::graph) return Rest::here;
    const axisym::GraphRestart state = axisym::graph_restart(frame);
    const axisym::GraphMesh mesh(state.cell, state.breaks, c);
    const axisym::Forms& forms = mesh.forms;
    const std::optional<Eigenpairs> modes =
        eigenpairs(forms.hessian(state.coefficients), forms.mass(state.coefficients));
    if (!modes) return Rest::on_its_way;
    const Eigen::VectorXd& rate = modes->values;
    const double none = translation * rate.cwiseAbs().maxCoeff();
    if (rate.minCoeff() < -none) return Rest::on_a_saddle;
    const Eigen::VectorXd force = modes->vectors.transpose() * forms.gradient(state.coefficients);
    Eigen::VectorXd step = Eigen::VectorXd::Zero(force.size());
    for (Eigen::Index i = 0; i < force.size(); ++i)
        if (rate[i] > none) step += force[i] / rate[i] * modes->vectors.col(i);
    const double waves = std::max(r_max - r_min, waves_of_uniform_tube * (r_max + r_min)) / 2;
    return step.cwiseAbs().maxCoeff() < near_rest * waves ? Rest::here : Rest::on_its_way;
}

double detail(const RunSummary& summary, std::string_view name) {
    for (const auto& [key, value] : summary.details)
        if (const auto* number = std::get_if<std::int64_t>(&value); number && key == name)
            return static_cast<double>(*number);
    return unknown;
}

PointResult summed_up(const Problem& c, const RunSummary& s, const Watch& watch) {
    PointResult p;
    const EndShape end = watch.end(std::holds_alternative<Tube>(c.shape));
    const bool decided = watch.decided && s.stop.reason == Stop::interrupted;
    p.outcome = decided ? Outcome::uniform_tube : outcome_of(s.stop.reason, end);
    p.stop = decided ? decided_word : stop_word(s.stop.reason);
    p.message = decided ? "all waves decay from here on" : s.stop.message;
    p[Measure::energy] = s.energy;
    p[Measure::time] = s.stop.time;
    p[Measure::energy_error] = s.estimated_error;
    p[Measure::E_ref] = s.reference_energy;
    p[Measure::r_min] = end.r_min;
    p[Measure::r_max] = end.r_max;
    p[Measure::area] = end.area;
    p[Measure::volume] = end.volume;
    p[Measure::steps] = detail(s, "steps");
    p[Measure::elements] = s.elements;
    return p;
}

// A run that ends as stationary without being at rest goes on from there, to where it really goes.
PointResult computed(Case given, bool to_the_end) {
    given.time.output.clear();
    double steps = 0;
    for (std::optional<Restart> from;;) {
        const Problem c = given;
        const Engine engine(c);
        Watch watch(c, engine.series_names(), to_the_end);
        const RunSummary summary = engine.run(watch, from ? &*from : nullptr);
        PointResult p = summed_up(c, summary, watch);
        p[Measure::steps] = steps += p[Measure::steps];
        if (summary.stop.reason != Stop::stationary || !watch.last_frame) return p;
        const double r_min = p[Measure::r_min], r_max = p[Measure::r_max];
        if (r_max - r_min < 1e-12 * r_max) return p;  // a straight tube stays one
        const Rest rest = rest_of(c, *watch.last_frame, r_min, r_max);
        if (rest == Rest::here) return p;
        if (rest == Rest::on_a_saddle)
            given.time.stationary.reset();
        else
            *given.time.stationary *= next_stationarity;
        from = Restart{std::move(*watch.last_frame)};
    }
}

// Points along the whole cell or period.
ProfilePoints points_of(const axisym::Equilibrium& shape) {
    constexpr int intervals = 400;
    const Curve whole = axisym::meridian(*shape.space, shape.x);
    ProfilePoints out{{}, {}, whole.length};
    for (int i = 0; i <= intervals; ++i) {
        const auto at = whole.at(static_cast<double>(i) / intervals);
        out.r.push_back(at[0]), out.z.push_back(at[2]);
    }
    return out;
}

struct Interruptible : RunObserver {
    bool interrupted() override { return tubule::interrupted(); }
};

Outcome outcome_of_shape(const axisym::Equilibrium& shape, const EndShape& end) {
    if (shape.stop != Stop::finished) return outcome_of(shape.stop, end);
    if (shape.space->topology() == Topology::cell)
        return cell_at_rest(
            axisym::family_of(axisym::meridian(*shape.space, shape.x), reduced_volume(end.area, end.volume)));
    return outcome_of(Stop::stationary, end);
}

// The shape that a case with [equilibrium] finds. Throws as the search.
PointResult equilibrium_point(const Problem& c) {
    Interruptible observer;
    const auto [shape, modes, limit, force, meets_constraints] = axisym::find_shape(c, observer);
    PointResult p = unknown_point(0);
    p.stop = stop_word(shape.stop);
    p.message = shape.stop == Stop::finished ? "the shape is stationary" : shape.message;
    p[Measure::energy_error] = shape.estimated_error;
    p[Measure::E_ref] = shape.reference_energy;
    p[Measure::elements] = shape.space->images() * shape.space->splines().elements();
    if (limit) p[Measure::limit_energy] = limit->energy;
    const bool tube = std::holds_alternative<Tube>(c.shape);
    ProfilePoints profile;
    if (shape.stop == Stop::finished || shape.stop == Stop::self_intersection) {
        profile = points_of(shape);
        const axisym::ShapeMeasures measured = axisym::measures(*shape.space, shape.x);
        p[Measure::energy] = shape.observed.energy;
        p[Measure::area] = shape.observed.area;
        p[Measure::volume] = shape.observed.volume;
        p[Measure::r_max] = measured.r_max;
        if (tube) p[Measure::r_min] = *std::min_element(profile.r.begin(), profile.r.end());
        p[Measure::height] = measured.height;
        p[Measure::tension] = shape.sigma;
        p[Measure::pressure] = -shape.lambda;
        if (force) p[Measure::force] = *force;
    }
    if (meets_constraints)
        p[Measure::free_energy] =
            shape.observed.energy + loads_at(c.law, 0).energy(shape.observed.area, shape.observed.volume, shape.length);
    for (const axisym::ModeRates& mode : modes)
        if (!mode.rates.empty()) p[Measure::growth] = std::fmax(p[Measure::growth], mode.rates.front());
    const EndShape end{tube, p[Measure::r_min], p[Measure::r_max], p[Measure::area], p[Measure::volume]};
    p.outcome = outcome_of_shape(shape, end);
    return p;
}

}  // namespace

const std::vector<std::string>& stop_words() {
    static const std::vector<std::string> words = [] {
        std::vector<std::string> all;
        for (const StopKind& kind : stop_kinds) all.emplace_back(kind.name);
        all.insert(all.end(), {"decided", "refused"});
        return all;
    }();
    return words;
}

int stop_word(Stop reason) {
    return static_cast<int>(reason);
}

PointResult run_point(const Problem& c, bool to_the_end) {
    const PauseWatch watch(c.time.limit, interrupted);
    const double cpu = cpu_seconds();
    PointResult p;
    try {
        p = c.equilibrium ? equilibrium_point(c) : computed(c, to_the_end);
    } catch (const Paused& pause) {
        const StopReport stop = paused_at_start(pause).stop;
        p = refused_point(stop.message);
        p.outcome = outcome_of(stop.reason, {});
        p.stop = stop_word(stop.reason);
    } catch (const CaseError& error) {
        p = refused_point(error.what());
    } catch (const std::exception& error) {
        p = refused_point(failure_of(c, error, {}).message);
        p.stop = stop_word(Stop::solver_failed);
    }
    p[Measure::wall_seconds] = watch.seconds();
    p[Measure::cpu_seconds] = cpu_seconds() - cpu;
    return p;
}

PointResult unknown_point(std::size_t point) {
    PointResult p;
    p.point = point;
    return p;
}

std::vector<PointResult> unknown_points(std::size_t count) {
    std::vector<PointResult> all(count);
    for (std::size_t i = 0; i < count; ++i) all[i].point = i;
    return all;
}

PointResult refused_point(const std::string& message) {
    PointResult p;
    p.outcome = Outcome::failed;
    p.stop = refused_word;
    p.message = message;
    return p;
}

}  // namespace tubule
