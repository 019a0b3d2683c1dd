#include "surface3d/motion_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "surface3d/guards.hpp"
#include "surface3d/motion_frame.hpp"
#include "surface3d/paper_scheme.hpp"
#include "surface3d/remesh.hpp"
#include "surface3d/start.hpp"

namespace tubule::surface3d {
namespace {

// Measured choices: docs/decisions.md, "Surfaces in motion".
constexpr int first_triangles = 180, most_triangles = 40000;    // of the finer run of a pair
constexpr double fewer_triangles = 2.25, longer_tolerance = 8;  // of the coarser one
constexpr int most_pairs = 6;
constexpr int least_triangles = 80;             // fewer tell nothing
constexpr double tolerance_per_accuracy = 0.5;  // time_tolerance = this * asked accuracy^1.5, see tolerance_for()
constexpr double relaxes_in = 0.2;              // of the time that the shape needs to change
constexpr double loosest_tolerance = 1e-4;      // beyond it steps are too long to be compared
constexpr double first_step = 1e-4;             // of the time in which the mesh relaxes
constexpr double moment = 1e-2;                 // of the first step, see set_moving()
constexpr double growth = 1.6, safety = 0.85;   // of steps
constexpr double shortest_step = 1e-9;          // of the relaxation time: shorter ones are a failure
constexpr double creep = 10;                    // increase since its lowest, of the asked accuracy
constexpr double climb = 0.25;                  // increase of the energy in a step, of the asked accuracy
constexpr double most_drift = 0.1;              // of the volume, of the asked accuracy
constexpr double worst_quality = 0.03, sharpest_turn = 2;
// A new mesh is made below this quality, or where a neck turns by so much from node to node, and not for some steps.
constexpr double quality_to_remesh = 0.25, turn_to_remesh = 0.5;
constexpr int steps_between_meshes = 20;
constexpr int steps_between_looks = 10, most_crawling = 100;
constexpr double least_progress = 1e-3;  // of the time reached, by so many steps: else they lead nowhere
constexpr double seconds_between_checkpoints = 20;
// Variations of H that are no more than this, or than so many times what two ways to find it differ, are none.
constexpr double same_everywhere = 1e-9, times_noise = 4;

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The energy along a run, for another to be compared with.
class Trace {
public:
    void add(double t, double energy) { points_.push_back({t, energy}); }
    bool empty() const { return points_.empty(); }
    double end() const { return points_.back()[0]; }
    // Cubic through the four nearest steps.
    double operator()(double t) const {
        const int n = static_cast<int>(points_.size());
        const auto after =
            std::lower_bound(points_.begin(), points_.end(), t, [](const auto& p, double x) { return p[0] < x; });
        const int first = std::clamp(static_cast<int>(after - points_.begin()) - 2, 0, std::max(n - 4, 0));
        double sum = 0;
        for (int i = first; i < std::min(first + 4, n); ++i) {
            double weight = 1;
            for (int j = first; j < std::min(first + 4, n); ++j)
                if (j != i) weight *= (t - points_[j][0]) / (points_[i][0] - points_[j][0]);
            sum += weight * points_[i][1];
        }
        return sum;
    }

    // As an array of a record, and back.
    Array array() const {
        Array out{"restart_coarser_run", {points_.size(), 2}, {}};
        for (const auto& p : points_) out.data.insert(out.data.end(), p.begin(), p.end());
        return out;
    }
    explicit Trace(const Record& record) {
        for (const Array& a : record.arrays)
            if (a.name == "restart_coarser_run")
                for (std::size_t i = 0; i + 1 < a.data.size(); i += 2) add(a.data[i], a.data[i + 1]);
    }
    Trace() = default;

private:
    std::vector<std::array<double, 2>> points_;
};

bool ended_early(Stop reason) {
    return reason == Stop::interrupted || reason == Stop::time_limit;
}

struct Settings {
    int elements = first_triangles;
    double tolerance = 1e-4;
    double difference = 0;  // of the energies, absolute, by a pair on this mesh with a looser tolerance
};

double begin_time(const Case& c) {
    return c.handover ? c.handover->time : 0;
}

double tolerance_for(double accuracy) {
    return std::clamp(tolerance_per_accuracy * std::pow(accuracy, 1.5), 1e-13, loosest_tolerance);
}

Settings first_settings(const Case& c) {
    return {c.surface.elements.value_or(first_triangles),
            c.surface.time_tolerance.value_or(tolerance_for(c.accuracy.energy))};
}

Settings coarser(const Settings& s) {
    return {static_cast<int>(s.elements / fewer_triangles), s.tolerance * longer_tolerance};
}

// Errors fall with the fourth power of the mesh width and the power 2/3 of the tolerance. Where the energies of a pair
// agree and the balance is off, waves are damped by steps that are too long: the mesh is kept, once.
Settings finer(const Settings& s, double asked, double difference, double defect) {
    const double excess = std::max(difference, defect) / asked;
    if (difference <= asked && s.difference == 0)
        return {s.elements, s.tolerance / std::clamp(excess * excess, 4.0, 64.0), difference};
    const double by = std::clamp(std::sqrt(excess), 1.6, 4.0);
    return {static_cast<int>(std::ceil(by * s.elements)), s.tolerance / std::clamp(std::pow(excess, 1.5), 4.0, 64.0)};
}

class MotionAttempt {
public:
    // Nothing is written unless `recorded`.
    MotionAttempt(const Case& c, RunObserver& watch, bool recorded, const Settings& settings, const Trace* coarser,
                  std::chrono::steady_clock::time_point started)
        : case_(c), watch_(watch), recorded_(recorded), coarser_(coarser), started_(started) {
        memory_.elements = settings.elements, memory_.tolerance = settings.tolerance;
        memory_.error = settings.difference;
        outputs_ = c.time.output;
        outputs_.push_back(c.time.end);
        std::sort(outputs_.begin(), outputs_.end());
        outputs_.erase(std::unique(outputs_.begin(), outputs_.end()), outputs_.end());
        outputs_.erase(outputs_.begin(), std::upper_bound(outputs_.begin(), outputs_.end(), begin_time(c)));
    }

    void begin();
    void resume(const Restart& restart);
    void go();

    RunSummary summary;
    Trace trace;
    // Largest ones, absolute: of the energy from the coarser run; of the balance with what dissipates, which shows what
    // both runs of a pair lose alike.
    double difference() const { return memory_.error; }
    double defect() const { return memory_.defect; }

private:
    void make_stepper(const CurvedMesh& mesh);
    void set_moving();
    void look();
    double length() const { return std::sqrt(memory_.area); }
    double total() const { return now_.bending.energy + now_.kinetic; }
    double defect_now() const { return total() - memory_.total_start + memory_.dissipated; }
    double left_until_output() const { return outputs_[next_output_] - state_.time; }

    // What became of a trial step: nothing to say if it is taken.
    struct Refusal {
        double shrink = 0.25;  // the next trial is so much shorter
        StopReport report;     // if no step is short enough
    };
    std::optional<Refusal> attempt(double tau);
    std::optional<Refusal> judge(const MotionStep& next, const MotionMeasures& m) const;
    double dissipated_until(double tau, double rate) const;
    void take(const MotionStep& next, const MotionMeasures& m);
    void set_next_step(double tau, double asked, double error);
    std::optional<StopReport> step();
    bool wants_new_mesh() const;
    void make_new_mesh();
    std::optional<StopReport> check();
    std::optional<StopReport> check_shape() const;
    double what_may_change() const;
    void write_row();
    void write_frame();
    Record record() const {
        Record out = motion_record(*stepper_, state_, now_, case_.energy, memory_, mesh_number_);
        if (coarser_) out.arrays.push_back(coarser_->array());
        return out;
    }

    const Case& case_;
    RunObserver& watch_;
    bool recorded_;
    const Trace* coarser_;
    std::chrono::steady_clock::time_point started_;
    std::unique_ptr<MotionStepper> stepper_;
    std::unique_ptr<PaperStepper> paper_;  // makes the steps instead where the case says so
    MotionState state_;
    MotionMeasures now_;
    MotionMemory memory_;
    std::optional<StopReport> early_;  // nothing can be begun
    std::vector<double> outputs_;
    std::size_t next_output_ = 0, mesh_number_ = 0;
    double error_now_ = 0;
    double last_row_ = -1, last_frame_ = -1, last_checkpoint_ = 0;
    double crawl_begun_ = 0;
    int crawl_since_ = 0;
    int steps_ = 0, rejected_ = 0, mesh_since_ = 0, meshes_ = 1;
    std::vector<double> row_;
};

// The time that the model needs to change the shape as a whole, from what drives it (E/R^2) and what resists.
double time_to_change(const MotionLaw& law, const Observables& o, bool closed) {
    const double R = (closed ? 3 : 2) * std::abs(o.volume) / o.area;
    const double drive = std::max(std::abs(o.energy), o.magnitude) / o.area;
    return (law.friction * R * R + law.viscosity) / drive + std::sqrt(law.inertia * R * R / drive);
}

void MotionAttempt::make_stepper(const CurvedMesh& mesh) {
    MotionLaw law = motion_law(case_.model);
    if (time_scheme(case_) == Scheme::paper) {
        law.flows = true;  // it has all components of u in all models
        paper_ = std::make_unique<PaperStepper>(mesh, law, case_.energy, case_.surface.smoothing);
    }
    const MotionControl control{.area = memory_.area,
                                .volume = memory_.volume,
                                .relaxation = memory_.relaxation,
                                .least_variation = memory_.least_variation,
                                .scheme = time_scheme(case_)};
    stepper_ = std::make_unique<MotionStepper>(mesh, law, case_.energy, control);
    if (recorded_) mesh_number_ = watch_.mesh(cells_of(mesh));
    summary.elements = mesh.triangles();
}

void MotionAttempt::begin() {
    const StartMesh start = start_mesh(case_, memory_.elements);
    summary.warnings = start.notes;
    const SurfaceSpace space(start.mesh);
    if (const auto fold = find_fold(space, start.mesh)) {
        early_ = *fold;
        return;
    }
    const MotionFields fields = motion_fields(space, start.mesh, Projection(space, start.mesh));
    const Observables o = observe(space, start.mesh, {fields.normal, {}, fields.H, fields.K}, case_.energy);
    const MotionLaw law = motion_law(case_.model);
    memory_.area = o.area, memory_.volume = o.volume;
    memory_.reference_energy =
        case_.handover ? case_.handover->reference_energy : std::max(std::abs(o.energy), o.magnitude);
    memory_.relaxation = case_.surface.relaxation.value_or(relaxes_in * time_to_change(law, o, start.mesh.period == 0));
    memory_.least_variation = std::max(same_everywhere, times_noise * noise_of_H(space, start.mesh, fields));
    memory_.next_step =
        case_.surface.step.value_or(std::min(first_step * memory_.relaxation, case_.time.end - begin_time(case_)));
    make_stepper(start.mesh);
    state_ = stepper_->start(start.mesh);
    state_.time = begin_time(case_);
    if (start.velocity.size() > 0)
        state_.u = start.velocity.transpose().reshaped();
    else if (case_.velocity.rotates)
        for (int i = 0; i < start.mesh.size(); ++i) {
            const Eigen::Vector3d& x = start.mesh.nodes[i];
            state_.u[i] = -case_.velocity.omega * x.y();
            state_.u[start.mesh.size() + i] = case_.velocity.omega * x.x();
        }
    state_.u_past = state_.u;
    if (stepper_->law().inertia == 0 && !paper_) set_moving();
    look();
    memory_.total_start = memory_.lowest_total = total();
    trace.add(state_.time, now_.bending.energy);
    write_row();
    write_frame();
}

// Without inertia the surface is not at rest at the start: the velocity of a very short step. Where there is none, the
// first step says why.
void MotionAttempt::set_moving() {
    try {
        const MotionState soon = stepper_->step(state_, moment * memory_.next_step).state;
        if (!soon.X.allFinite() || !soon.u.allFinite()) return;
        state_.u = state_.u_past = soon.u;
        state_.w = state_.w_past = soon.w;
        state_.p = soon.p, state_.lambda = soon.lambda;
    } catch (const SolveError&) {
    }
}

void MotionAttempt::resume(const Restart& restart) {
    auto [state, memory] = motion_restart(restart.record);
    memory_ = memory;
    CurvedMesh mesh{restart.cells.order, {}, restart.cells.cells, restart.cells.period, restart.cells.shifts};
    for (int i = 0; i < state.X.cols(); ++i) mesh.nodes.push_back(state.X.col(i));
    make_stepper(mesh);
    state_ = std::move(state);
    look();
    next_output_ = std::upper_bound(outputs_.begin(), outputs_.end(), state_.time) - outputs_.begin();
    last_row_ = last_frame_ = state_.time;
    trace.add(state_.time, now_.bending.energy);
}

void MotionAttempt::look() {
    now_ = measure(*stepper_, state_, case_.energy);
}

std::optional<MotionAttempt::Refusal> MotionAttempt::judge(const MotionStep& next, const MotionMeasures& m) const {
    const double t = state_.time;
    if (const auto spurious = find_impossible_curvature(m.bending, stepper_->mesh(next.state.X)))
        return Refusal{0.25, {spurious->reason, t, spurious->message, spurious->advice}};
    const double rise = m.bending.energy + m.kinetic - total();
    if (rise > climb * case_.accuracy.energy * memory_.reference_energy)
        return Refusal{0.25,
                       {Stop::resolution_lost, t,
                        fmt::format("the energy rises by {:.3g} of E_ref in a step of {:.3g}, which it cannot",
                                    rise / memory_.reference_energy, next.state.step),
                        "use more elements or, if given, a smaller discretisation.step"}};
    return std::nullopt;
}

std::optional<MotionAttempt::Refusal> MotionAttempt::attempt(double tau) {
    const double t = state_.time;
    const auto failed = [&](const std::string& what) {
        return Refusal{0.25, {Stop::solver_failed, t, what, "try other elements, or another discretisation.order"}};
    };
    try {
        const MotionStep next = paper_ ? paper_->step(state_, tau) : stepper_->step(state_, tau);
        if (!next.state.X.allFinite() || !next.state.u.allFinite()) return failed("the step overflows");
        const double error = next.error / (memory_.tolerance * length());
        if (!case_.surface.step && error > 2)
            return Refusal{std::clamp(safety / std::cbrt(error), 0.2, 0.7),
                           {Stop::solver_failed, t, fmt::format("steps of {:.3g} are still too inaccurate", tau),
                            "ask for less accuracy, or use more elements"}};
        const CurvedMesh mesh = stepper_->mesh(next.state.X);
        if (auto fold = find_fold(stepper_->space(), mesh)) {
            fold->time = t;
            return Refusal{0.25, *fold};
        }
        const MotionMeasures m = measure(*stepper_, next.state, case_.energy);
        if (const auto refusal = judge(next, m)) return refusal;
        take(next, m);
        set_next_step(tau, memory_.next_step, error);
        return std::nullopt;
    } catch (const SolveError& failure) {
        return failed(failure.what());
    }
}

// In a step of length tau at whose end so much dissipates: the parabola through the last three rates.
double MotionAttempt::dissipated_until(double tau, double rate) const {
    const double before = state_.step, slope = (rate - now_.dissipation) / tau;
    const double bend =
        before > 0 ? (slope - (now_.dissipation - memory_.dissipation_past) / before) / (tau + before) : 0;
    return tau * (now_.dissipation + rate) / 2 - bend * tau * tau * tau / 6;
}

void MotionAttempt::take(const MotionStep& next, const MotionMeasures& m) {
    memory_.dissipated += dissipated_until(next.state.step, m.dissipation);
    memory_.dissipation_past = now_.dissipation;
    memory_.corrected += std::abs(next.correction);
    state_ = next.state;
    now_ = m;
    memory_.lowest_total = std::min(memory_.lowest_total, total());
    memory_.defect = std::max(memory_.defect, std::abs(defect_now()));
    ++steps_;
}

// A step that was cut short by an output says little about how long the next one may be.
void MotionAttempt::set_next_step(double tau, double asked, double error) {
    if (case_.surface.step) return;
    const double factor = error > 0 ? std::clamp(safety / std::cbrt(error), 0.4, growth) : growth;
    memory_.next_step = std::max(tau * factor, tau < asked ? std::min(asked, growth * tau) : 0.0);
}

// What lies in the shape itself: no shorter step would help.
std::optional<StopReport> MotionAttempt::check_shape() const {
    const double t = state_.time;
    const auto where = [](const Eigen::Vector3d& x) {
        return fmt::format("({:.4g}, {:.4g}, {:.4g})", x[0], x[1], x[2]);
    };
    if (!(now_.symbol > 0))
        return StopReport{Stop::ill_posed, t,
                          "the principal symbol f_HH + 2 f_HK x + f_KK x^2 reached zero at " + where(now_.least_symbol),
                          "no resolution helps: the energy does not resist short waves there"};
    if (now_.neck_radius < case_.accuracy.r_min)
        return StopReport{Stop::pinch_off, t,
                          fmt::format("the neck radius fell to {:.4g} at {}", now_.neck_radius, where(now_.narrowest)),
                          "lower accuracy.r_min to follow the neck further"};
    if (total() - memory_.lowest_total > creep * case_.accuracy.energy * memory_.reference_energy)
        return StopReport{Stop::resolution_lost, t,
                          fmt::format("the energy has risen by {:.3g} of E_ref, little by little, which it cannot",
                                      (total() - memory_.lowest_total) / memory_.reference_energy),
                          "use more elements"};
    const double drift = std::abs(now_.bending.volume / memory_.volume - 1);
    if (!paper_ && stepper_->law().keeps_volume && drift > most_drift * case_.accuracy.energy)
        return StopReport{
            Stop::resolution_lost, t,
            fmt::format("the volume has drifted by {:.3g} of itself: on so few triangles it cannot be told "
                        "from the area, which is kept",
                        drift),
            "use more elements"};
    if (now_.turn > sharpest_turn)
        return StopReport{
            now_.neck ? Stop::pinch_off : Stop::resolution_lost, t,
            fmt::format("{} at {}: the normal turns by {:.2g} radians from node to node",
                        now_.neck ? "a neck closes" : "the surface is too sharp", where(now_.sharpest), now_.turn),
            now_.neck ? "more elements follow the neck further" : "use more elements"};
    if (!(now_.quality > worst_quality))
        return StopReport{
            Stop::mesh_lost, t,
            fmt::format("a triangle at {} has quality {:.2g} (1: equilateral)", where(now_.worst), now_.quality),
            "use more elements or a shorter discretisation.relaxation"};
    return std::nullopt;
}

// By how much the energy could change until the end, by what dissipates, moves and is accelerated now.
double MotionAttempt::what_may_change() const {
    const double left = case_.time.end - state_.time;
    return std::max({now_.dissipation * left, now_.kinetic, now_.acceleration * left * left});
}

std::optional<StopReport> MotionAttempt::check() {
    const double t = state_.time;
    if (seconds_since(started_) > case_.time.limit.value_or(std::numeric_limits<double>::infinity()))
        return StopReport{Stop::time_limit, t, fmt::format("used the {} s of time.limit", *case_.time.limit),
                          "go on with --resume"};
    if (watch_.interrupted()) return StopReport{Stop::interrupted, t, "interrupted by a signal", "go on with --resume"};
    if (auto lost = check_shape()) return lost;
    if (case_.time.stationary && what_may_change() < *case_.time.stationary * memory_.reference_energy)
        return StopReport{Stop::stationary, t, "the energy changes no more, as asked by time.stationary", ""};
    if (steps_ % steps_between_looks == 0)
        if (const auto crossing = find_self_intersection(stepper_->mesh(state_.X))) {
            StopReport report = *crossing;
            report.time = t;
            return report;
        }
    return std::nullopt;
}

bool MotionAttempt::wants_new_mesh() const {
    if (paper_ || steps_ < mesh_since_ + steps_between_meshes) return false;
    return now_.quality < quality_to_remesh || (now_.neck && now_.turn > turn_to_remesh);
}

// The same surface with good triangles, and small ones where it is sharp; the next step is again the first of its kind.
// What the energy jumps counts as an error. Where no better mesh can be made, the old one is kept: check_shape() tells
// when it will do no longer.
void MotionAttempt::make_new_mesh() {
    mesh_since_ = steps_;
    const MotionLaw& law = stepper_->law();
    const int n = static_cast<int>(state_.X.cols()), d = law.components();
    const auto found = remesh(stepper_->mesh(state_.X), state_.u.reshaped(n, d).transpose(), {});
    const auto* better = std::get_if<Remeshed>(&found);
    if (!better || better->quality.worst < now_.quality) return;
    const double time = state_.time, energy = now_.bending.energy;
    make_stepper(better->mesh);
    ++meshes_;
    state_ = stepper_->start(better->mesh);
    state_.time = time;
    state_.u = better->fields.transpose().reshaped();
    state_.u_past = state_.u;
    look();
    memory_.error += std::abs(now_.bending.energy - energy);
    memory_.lowest_total += std::max(now_.bending.energy - energy, 0.0);
    if (!case_.surface.step) memory_.next_step = std::min(memory_.next_step, first_step * memory_.relaxation);
}

std::optional<StopReport> MotionAttempt::step() {
    const double left = left_until_output();
    double tau = left / std::ceil(left / memory_.next_step * (1 - 1e-9));  // arrives without a last short step
    while (const auto refusal = attempt(tau)) {
        ++rejected_;
        tau *= refusal->shrink;
        memory_.next_step = tau;
        if (case_.surface.step || tau < shortest_step * memory_.relaxation) return refusal->report;
        if (watch_.interrupted()) break;
    }
    const double t = state_.time;
    trace.add(t, now_.bending.energy);
    error_now_ = memory_.reference_energy;  // nothing is known
    if (coarser_ && t <= coarser_->end()) {
        error_now_ = std::abs(now_.bending.energy - (*coarser_)(t));
        memory_.error = std::max(memory_.error, error_now_);
    }
    write_row();
    if (recorded_) watch_.progress(t, now_.bending.energy, state_.step);
    if (left_until_output() <= 1e-12 * case_.time.end) {
        state_.time = outputs_[next_output_++];
        write_frame();
        if (next_output_ == outputs_.size()) return StopReport{Stop::finished, state_.time, "reached time.end", ""};
    }
    if (recorded_ && seconds_since(started_) > last_checkpoint_ + seconds_between_checkpoints) {
        last_checkpoint_ = seconds_since(started_);
        watch_.checkpoint(record());
    }
    if (t > (1 + least_progress) * crawl_begun_) crawl_begun_ = t, crawl_since_ = steps_;
    if (steps_ > crawl_since_ + most_crawling && state_.step < first_step * memory_.relaxation)
        return StopReport{Stop::solver_failed, t, fmt::format("stuck with steps of {:.2g}", state_.step),
                          "ask for less accuracy, or use more elements"};
    if (auto stop = check()) return stop;
    if (wants_new_mesh()) make_new_mesh();
    return std::nullopt;
}

void MotionAttempt::go() {
    std::optional<StopReport> stop = early_;
    if (!stop) stop = check_shape();
    if (!stop) stop = find_impossible_curvature(now_.bending, stepper_->mesh(state_.X));
    while (!stop) stop = step();
    summary.stop = *stop;
    summary.energy = now_.bending.energy;
    summary.reference_energy = memory_.reference_energy;
    if (!stepper_) return;
    write_row();
    if (!ended_early(stop->reason))
        write_frame();
    else if (recorded_)
        watch_.checkpoint(record());  // what a resumed run goes on from is no frame of its own
    const int nodes = static_cast<int>(state_.X.cols());
    summary.effort = fmt::format("{} steps ({} rejected), {} triangles of order {}, {} nodes", steps_, rejected_,
                                 summary.elements, element_order(case_), nodes);
    summary.details = {{"elements", std::int64_t{summary.elements}},
                       {"nodes", std::int64_t{nodes}},
                       {"order", std::int64_t{element_order(case_)}},
                       {"steps", std::int64_t{steps_}},
                       {"rejected_steps", std::int64_t{rejected_}},
                       {"time_tolerance", memory_.tolerance},
                       {"meshes", std::int64_t{meshes_}},
                       {"relaxation", memory_.relaxation},
                       {"dissipated", memory_.dissipated},
                       {"identity_defect", defect_now()},
                       {"correction_energy", memory_.corrected}};
}

void MotionAttempt::write_row() {
    if (!recorded_ || last_row_ == state_.time) return;
    last_row_ = state_.time;
    const MotionMeasures& m = now_;
    row_ = {state_.time, state_.step, m.bending.energy};
    row_.insert(row_.end(), m.bending.energy_term.begin(), m.bending.energy_term.end());
    for (const double value : {m.dissipation,
                               defect_now(),
                               m.bending.area,
                               m.bending.volume,
                               m.r_min,
                               m.r_max,
                               m.kinetic,
                               m.speed,
                               m.momentum.x(),
                               m.momentum.y(),
                               m.momentum.z(),
                               m.angular_momentum.x(),
                               m.angular_momentum.y(),
                               m.angular_momentum.z(),
                               state_.lambda,
                               m.stretching,
                               memory_.corrected,
                               m.bending.integral_H2,
                               m.bending.integral_K,
                               m.quality,
                               m.turn,
                               error_now_,
                               static_cast<double>(summary.elements),
                               seconds_since(started_)})
        row_.push_back(value);
    watch_.row(row_);
}

void MotionAttempt::write_frame() {
    if (!recorded_ || state_.time == last_frame_) return;
    last_frame_ = state_.time;
    watch_.frame([&] { return record(); });
}

bool settings_given(const Case& c) {
    return c.surface.elements || c.surface.time_tolerance || c.surface.step;
}

void describe(RunSummary& s, const Case& c, double error, int pairs) {
    s.estimated_error = s.reference_energy > 0 ? error / s.reference_energy : 1;
    s.as_accurate_as_asked = s.estimated_error <= c.accuracy.energy;
    s.details.emplace_back("pairs", std::int64_t{pairs});
}

// A run that is less accurate than asked although nothing is left to refine.
void accept(RunSummary& s, const Case& c, bool chosen) {
    if (s.as_accurate_as_asked || s.stop.reason == Stop::interrupted || s.stop.reason == Stop::time_limit) return;
    s.warnings.push_back(fmt::format("the energy is off by {:.2g} of E_ref (estimated), {:.2g} was asked for",
                                     s.estimated_error, c.accuracy.energy));
    if (chosen || s.stop.reason != Stop::finished) return;
    s.stop = {Stop::resolution_lost, s.stop.time, s.warnings.back(), "ask for less accuracy"};
    s.warnings.pop_back();
}

}  // namespace

std::vector<std::string> motion_series_names(const Case&) {
    std::vector<std::string> names{"time", "step_size", "energy"};
    for_each_bending_term([&](std::size_t, const auto& term) { names.push_back(std::string("energy_") + term.name); });
    for (const char* name : {"dissipation",
                             "identity_defect",
                             "area",
                             "volume",
                             "r_min",
                             "r_max",
                             "kinetic_energy",
                             "speed",
                             "momentum_x",
                             "momentum_y",
                             "momentum_z",
                             "angular_momentum_x",
                             "angular_momentum_y",
                             "angular_momentum_z",
                             "lambda",
                             "stretching",
                             "correction_energy",
                             "integral_H2",
                             "integral_K",
                             "quality",
                             "turn",
                             "energy_error",
                             "elements",
                             "wall_seconds"})
        names.push_back(name);
    return names;
}

RunSummary run_motion(const Case& c, RunObserver& observer, const Restart* restart) {
    const auto started = std::chrono::steady_clock::now();
    Settings settings = first_settings(c);
    if (restart) {
        const MotionMemory memory = motion_restart(restart->record).memory;
        settings = {memory.elements, memory.tolerance};
    }
    // With too few triangles, or when their number is not ours to choose, the coarser run has elements of lower order.
    const bool resizable = start_mesh(c, settings.elements).resizable;
    const bool by_order = !resizable || coarser(settings).elements < least_triangles;
    Trace trace = restart ? Trace(restart->record) : Trace();
    StopReport coarse_stop;
    if (trace.empty()) {
        Case lower = c;
        if (by_order) lower.surface.order = std::max(element_order(c) - 1, 2);
        if (c.surface.step) lower.surface.step = 2 * *c.surface.step;
        const Settings with{by_order ? settings.elements : coarser(settings).elements, coarser(settings).tolerance};
        MotionAttempt coarse(lower, observer, false, with, nullptr, started);
        coarse.begin();
        coarse.go();
        if (ended_early(coarse.summary.stop.reason)) {
            MotionAttempt first(c, observer, true, settings, nullptr, started);  // ends as soon: a step to go on from
            restart ? first.resume(*restart) : first.begin();
            first.go();
            describe(first.summary, c, first.summary.reference_energy, 1);  // nothing is known of the error yet
            return first.summary;
        }
        trace = coarse.trace;
        coarse_stop = coarse.summary.stop;
    }
    for (int pair = 1;; ++pair) {
        auto fine =
            std::make_unique<MotionAttempt>(c, observer, true, settings, trace.empty() ? nullptr : &trace, started);
        if (restart)
            fine->resume(*restart);
        else
            fine->begin();
        fine->go();
        const Stop reason = fine->summary.stop.reason;
        const double compared_until = trace.empty() ? 0 : trace.end();
        const bool known = compared_until >= fine->summary.stop.time * (1 - 1e-3) && compared_until > 0;
        const double difference = known ? fine->difference() : fine->summary.reference_energy;
        describe(fine->summary, c, std::max(difference, fine->defect()), pair);
        const bool given = settings_given(c) || !resizable;
        if (fine->summary.as_accurate_as_asked || given || pair == most_pairs ||
            settings.elements * 1.6 > most_triangles || ended_early(reason)) {
            if (!known)
                fine->summary.warnings.push_back(
                    fmt::format("the coarser run of the pair came to t = {:.6g} only: the error is not known ({})",
                                compared_until, coarse_stop.message));
            accept(fine->summary, c, given);
            return fine->summary;
        }
        settings = finer(settings, c.accuracy.energy * fine->summary.reference_energy, difference, fine->defect());
        observer.discard();
        restart = nullptr;
        trace = std::move(fine->trace);
        coarse_stop = fine->summary.stop;
    }
}

}  // namespace tubule::surface3d
