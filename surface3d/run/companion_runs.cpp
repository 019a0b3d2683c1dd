#include "surface3d/run/companion_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "common/result/record.hpp"
#include "common/solve/pause.hpp"
#include "surface3d/run/motion_start.hpp"

namespace tubule::surface3d {
namespace {

// Most trials of a companion for some steps of the run: those of one whose mesh is no longer good enough would
// otherwise have no end.
constexpr int most_at_once = 40;

RunObserver nobody;  // who sees its rows; pauses come from the clock

// The record of a companion in addition to its state.
struct Saved {
    int stop = -1;  // it has not ended
    double stop_time = 0;
    SurfaceCells cells;
};
template <class Fields, class S>
void saved_fields(Fields&& f, S& s) {
    f.number("stop", s.stop), f.number("stop_time", s.stop_time);
    f.number("order", s.cells.order), f.number("period", s.cells.period);
}
Saved saved_of(const Record& record) {
    Saved out;
    const RecordReader reader(record);
    saved_fields(reader, out);
    std::vector<double> cells, shifts;
    reader.array("cells", cells), reader.optional_array("shifts", shifts, cells.size());
    out.cells.cells.assign(cells.begin(), cells.end()), out.cells.shifts.assign(shifts.begin(), shifts.end());
    Eigen::Matrix3Xd points;
    reader.array("points", points);
    out.cells.nodes = points.cols();
    const int k = out.cells.order;
    const bool whole = k >= 1 && k <= 4 && cells.size() % ((k + 1) * (k + 2) / 2) == 0;
    const auto is_node = [&](double node) { return node >= 0 && node < points.cols(); };
    if (!whole || !std::ranges::all_of(cells, is_node))
        throw std::runtime_error(
            "cannot resume from this frame: its coarser run has no cells of these nodes; run the case without "
            "--resume");
    if (out.stop < -1 || out.stop >= static_cast<int>(stop_kinds.size()))
        throw std::runtime_error(
            "cannot resume from this frame: its coarser run ended for an unknown reason; run the case without "
            "--resume");
    return out;
}

// The first of the fewest steps over an interval that grow evenly from the last one, each by at most this factor.
double first_of_steps(double interval, double last, double most_growth) {
    if (!(last > 0) || interval <= most_growth * last) return interval;
    int count = 1;
    const auto sum = [&](double r) { return r * (std::pow(r, count) - 1) / (r - 1); };
    while (last * sum(most_growth) < interval) ++count;
    double low = 1, high = most_growth;
    while (high - low > 1e-6) {
        const double r = (low + high) / 2;
        (last * sum(r) < interval ? low : high) = r;
    }
    return high * last;
}

Problem problem_of_companion(const Problem& c, Role role) {
    Case out = c;
    const int order = c.element_order;
    if (role == Role::other_order) out.surface.order = order > 2 ? order - 1 : 3;
    out.surface.step.reset();
    out.time.output.clear();
    out.time.stationary.reset();  // it continues as long as the run
    return out;
}

constexpr double clearly_fewer = 1.25;  // times fewer triangles: else the two runs are too much alike

// What is lost on fewer triangles may not be lost with elements of another order.
bool lost(const StopReport& stop) {
    return stop.reason == Stop::pinch_off || exit_code(stop.reason) == exit_code(Stop::solver_failed);
}

template <class Fields, class R, class C>
void compared_fields(Fields&& f, R& r, C& c) {
    f.number("restart_compared", c.compared), f.number("restart_compared_error", c.error);
    f.number("restart_compared_between", c.between), f.number("restart_compared_sum_in_time", c.sum_in_time);
    f.number("restart_compared_in_time", c.in_time), f.number("restart_compared_growth", r.growth);
    f.array("restart_compared_times", r.times);
    f.array("restart_compared_energies", r.energies, r.times.size());
    f.array("restart_compared_dissipations", r.dissipations, r.times.size());
    f.array("restart_compared_orders", r.orders, r.times.size());
    f.number("restart_compared_spare", r.spare);
    f.number("restart_compared_slowest_at", c.slowest_at), f.number("restart_compared_slowest", c.slowest);
    f.number("restart_compared_difference_then", c.difference_then);
    f.number("restart_compared_steps_then", c.steps_then), f.number("restart_compared_fastest", c.fastest);
    f.optional_array("restart_compared_thinned_at", r.thinned_at);
    f.optional_array("restart_compared_asked", r.asked, r.thinned_at.size());
    f.optional_array("restart_compared_had", r.had, r.thinned_at.size());
}

// Companions, by the prefix of their names in the record of the run.
const std::string of_long_steps = "restart_coarser_run_", of_same_steps = "restart_coarser_same_steps_";

}  // namespace

Companion::Companion(const Problem& c, const Start& start, const RunClock& clock, const MotionSettings& settings)
    : case_(std::make_unique<const Problem>(problem_of_companion(c, settings.role))),
      start_(start),
      clock_(clock),
      run_(*case_, nobody, settings, nullptr) {}

void Companion::begin() {
    run_.begin(start_);
    loop_.emplace(loop_of(run_, *case_, nobody, clock_));
    loop_->begin();
}

std::unique_ptr<Companion> Companion::resumed(const Problem& c, const Start& start, const RunClock& clock,
                                              const Record& record, const std::string& prefix) {
    Record own = nested(record, prefix, RecordKind::surface);
    const Saved saved = saved_of(own);
    auto out = std::make_unique<Companion>(c, start, clock, motion_restart(own, c.scheme).memory.settings);
    const Restart restart{std::move(own), saved.cells};
    out->run_.resume(restart, start);
    out->loop_.emplace(loop_of(out->run_, *out->case_, nobody, clock));
    out->loop_->resume(restart.record);
    const auto stop = static_cast<Stop>(saved.stop);
    const bool continues = saved.stop < 0 || (stop == Stop::finished && is_before(saved.stop_time, c.time.end));
    if (!continues) out->loop_->end({stop, saved.stop_time, "", ""});
    return out;
}

bool Companion::is_saved(const Record& record, const std::string& prefix) {
    int exists = 0;
    RecordReader(record).number(prefix + "exists", exists);
    return exists != 0;
}

void Companion::check_restart(const Problem& c, const Record& record, const std::string& prefix) {
    if (!is_saved(record, prefix)) return;
    const Record own = nested(record, prefix, RecordKind::surface);
    saved_of(own);
    motion_restart(own, c.scheme);
}

void Companion::save(const std::string& prefix, Record& record) const {
    Record own = state_record(run_.state(), run_.memory());
    loop_->save_callbacks(own);
    Saved saved{.cells = cells_of(run_.mesh())};
    if (const auto& ended = stop(); ended && !can_go_on(ended->reason))
        saved.stop = static_cast<int>(ended->reason), saved.stop_time = ended->time;
    RecordWriter writer(own);
    saved_fields(writer, saved);
    writer.array("cells", std::vector<double>(saved.cells.cells.begin(), saved.cells.cells.end()));
    writer.array("shifts", std::vector<double>(saved.cells.shifts.begin(), saved.cells.shifts.end()));
    nest(record, prefix, std::move(own));
}

bool Companion::advance_to(double time, double growth) {
    if (!has_begun()) return false;
    const double last = run_.step_size();
    run_.set_next_step(std::min(time - run_.time(), last > 0 ? growth * last : HUGE_VAL));
    const auto tried = [this] { return run_.memory().count.steps + run_.memory().count.rejected; };
    const auto before = tried(), rejected = run_.memory().count.rejected;
    while (!stop() && is_before(run_.time(), time)) {
        double until = time;
        if (!run_.has_inertia() && run_.memory().count.rejected == rejected) {
            const double next = first_of_steps(time - run_.time(), run_.step_size(), growth);
            run_.set_next_step(next);
            if (next < time - run_.time()) until = run_.time() + next;
        }
        loop_->step(until);
        if (!stop() && tried() - before > most_at_once)
            loop_->end({Stop::resolution_lost, run_.time(),
                        fmt::format("{} triangles need steps of {:.2g} where the run takes {:.2g}",
                                    run_.summary.elements, run_.memory().next_step, time - run_.time()),
                        ""});
    }
    return is_at(time);
}

void Companion::take_mesh(int triangles, int of_run) {
    if (const auto none = run_.take_thinner_mesh(triangles, of_run)) loop_->end(*none);
}

CompanionRuns::CompanionRuns(const Problem& c, const Start& start, const RunClock& clock, const MotionSettings& of)
    : case_(c), start_(start), clock_(clock), of_(of) {}

bool CompanionRuns::separates_time_error() const {
    return is_of_high_order(case_);
}

// What goes wrong in companions leaves the run alone: its error is unknown from then on.
template <class Work>
void CompanionRuns::attempt(const Work& work, double time) {
    try {
        work();
    } catch (const std::exception& failure) {
        long_steps_.reset(), same_steps_.reset();
        failure_ = StopReport{Stop::solver_failed, time, failure.what(), ""};
    }
}

double CompanionRuns::begin(int triangles, const MotionMeasures& start) {
    run_.growth = growth_of_companion(case_, start.smoothness);
    run_.spare = spare_for_waves(case_, start.smoothness);
    attempt([&] { begin(triangles); }, case_.begin_time);
    return error_of_start(case_, start_, of_.elements, start.free_energy, is_rough(start.smoothness));
}

void CompanionRuns::begin(int triangles) {
    const int fewer = fewer_triangles(of_.elements);
    if (start_.resizable() && fewer >= least_triangles) {
        try {
            const double coarser_by = 1.0 * triangles / start_.mesh(fewer, case_.element_order).mesh.triangles();
            if (coarser_by >= clearly_fewer) return begin(Role::fewer_triangles, coarser_by);
        } catch (const std::exception&) {  // another order may do
        }
    }
    begin(Role::other_order, 1);
}

void CompanionRuns::begin(Role role, double coarser_by) {
    const auto begun = [&] {
        auto next = std::make_unique<Companion>(case_, start_, clock_, companion_settings(of_, role, coarser_by));
        next->begin();
        return next;
    };
    long_steps_ = begun();
    if (separates_time_error()) same_steps_ = begun();
    compared_ = {};
}

bool CompanionRuns::is_compared(std::size_t i) const {
    return i % steps_at_once == 0 || !is_before(run_.times[i], case_.time.end);
}

// At all times that are to be compared. False if a companion does not get there.
bool CompanionRuns::catch_up(double smoothness) {
    const std::vector<double>& times = run_.times;
    double largest = 0;
    for (int& i = compared_.compared; i < std::ssize(times); ++i) {
        if (same_steps_ && !same_steps_->advance_to(times[i], run_.growth)) return false;
        if (!is_compared(i)) continue;
        if (!long_steps_->advance_to(times[i], run_.growth)) return false;
        largest = std::max(largest, error_at(i, smoothness));
        compared_.error = largest;
        pass_on_thinning(i);
    }
    return true;
}

// Where the run has got fewer triangles after this step, so do its companions. If that is interrupted they begin again
// when the run resumes, since which of them has got them is not known.
void CompanionRuns::pass_on_thinning(std::size_t i) try {
    const RunSoFar& r = run_;
    for (std::size_t k = 0; k < r.thinned_at.size(); ++k)
        if (r.thinned_at[k] == static_cast<double>(i))
            for (const auto* companion : {&long_steps_, &same_steps_}) {
                if (!*companion) continue;
                const int triangles = static_cast<int>(r.asked[k]);
                const bool as_many = (*companion)->run().settings().role == Role::other_order;
                (*companion)->take_mesh(as_many ? triangles : fewer_triangles(triangles), static_cast<int>(r.had[k]));
            }
} catch (const Paused&) {
    long_steps_.reset(), same_steps_.reset();
    failure_ = StopReport{Stop::interrupted, run_.times[i], "", ""};
    throw;
}

bool CompanionRuns::is_at(double time) const {
    const auto there = [&](const std::unique_ptr<Companion>& companion) {
        return !companion || (!companion->stop() && companion->is_at(time) && companion->has_initial_mesh());
    };
    return failure_ || (there(long_steps_) && there(same_steps_));
}

void CompanionRuns::thinned(int asked, int triangles) {
    RunSoFar& r = run_;
    const std::size_t last = r.times.size() - 1;
    r.thinned_at.push_back(static_cast<double>(last)), r.asked.push_back(asked), r.had.push_back(triangles);
    if (!failure_) attempt([&] { pass_on_thinning(last); }, r.times[last]);
}

// With one companion for errors in space and time: theory.md (11.2), and (11.3) where the motion has sped up.
double CompanionRuns::error_at_once(std::size_t i, double smoothness) {
    const RunSoFar& r = run_;
    Comparison& c = compared_;
    const double part = error_by_difference(case_, long_steps_->run().settings(), smoothness);
    const double difference = long_steps_->energy() - r.energies[i], at = static_cast<double>(i);
    const int steps = long_steps_->steps();
    if (i == 0 || r.dissipations[i] <= c.slowest)
        c.slowest_at = at, c.slowest = c.fastest = r.dissipations[i], c.difference_then = difference,
        c.steps_then = steps;
    c.fastest = std::max(c.fastest, r.dissipations[i]);
    if (!has_sped_up(case_, c.fastest, c.slowest)) return std::abs(difference) * part;
    const double by_change = error_by_change((at - c.slowest_at) / std::max(steps - c.steps_then, 1.0));
    return std::abs(c.difference_then) * part + std::abs(difference - c.difference_then) * std::max(by_change, part);
}

// Which all companions have got to.
double CompanionRuns::error_at(std::size_t i, double smoothness) {
    const RunSoFar& r = run_;
    Comparison& c = compared_;
    const MotionSettings& settings = long_steps_->run().settings();
    if (!same_steps_) return error_at_once(i, smoothness);
    const double longer_steps = long_steps_->energy();
    const double same_steps = same_steps_->energy();
    const std::size_t since = i == 0 ? 0 : steps_at_once * ((i - 1) / steps_at_once) + 1;
    const auto order = static_cast<int>(*std::min_element(r.orders.begin() + since, r.orders.begin() + i + 1));
    c.sum_in_time += (longer_steps - same_steps - c.between) * error_in_time(order);
    c.between = longer_steps - same_steps;
    c.in_time = std::max(c.in_time, std::abs(c.sum_in_time));
    return std::abs(same_steps - r.energies[i]) * error_in_space(case_, settings, smoothness) + std::abs(c.sum_in_time);
}

// Without an end, or to that of a companion; what is lost on fewer triangles is tried with elements of another order.
void CompanionRuns::catch_up_or_replace(double smoothness) {
    while (true) {
        const Role role = long_steps_->run().settings().role;
        const bool another = role == Role::fewer_triangles;
        try {
            if (catch_up(smoothness)) return;
            const auto ended = stop();
            if (!another || !ended || !lost(*ended)) return;
        } catch (const std::exception&) {
            if (!another) throw;
        }
        begin(Role::other_order, 1);
    }
}

std::optional<double> CompanionRuns::compare_at(double time, double energy, double dissipation, int order,
                                                double smoothness) {
    run_.times.push_back(time), run_.energies.push_back(energy), run_.orders.push_back(order);
    run_.dissipations.push_back(dissipation);
    if (failure_) return std::nullopt;
    try {
        attempt([&] { catch_up_or_replace(smoothness); }, time);
    } catch (const Paused&) {
        return std::nullopt;
    }
    if (failure_ || compared_.compared < std::ssize(run_.times)) return std::nullopt;
    return run_.spare * compared_.error;
}

std::optional<double> CompanionRuns::in_time() const {
    if (!same_steps_) return std::nullopt;
    return compared_.in_time;
}

std::optional<StopReport> CompanionRuns::stop() const {
    if (failure_) return failure_;
    std::optional<StopReport> out = long_steps_ ? long_steps_->stop() : std::nullopt;
    const std::optional<StopReport> other = same_steps_ ? same_steps_->stop() : std::nullopt;
    if (other && (!out || other->time < out->time)) return other;
    return out;
}

void CompanionRuns::save(Record& record) const {
    RecordWriter writer(record);
    const auto is_begun = [](const auto& companion) { return companion && companion->has_begun(); };
    const bool exists = is_begun(long_steps_), both = exists && is_begun(same_steps_);
    writer.number(of_long_steps + "exists", exists), writer.number(of_same_steps + "exists", both);
    compared_fields(writer, run_, compared_);
    if (exists) long_steps_->save(of_long_steps, record);
    if (both) same_steps_->save(of_same_steps, record);
}

void CompanionRuns::resume(const Record& record, int triangles) {
    compared_fields(RecordReader(record), run_, compared_);
    if (!Companion::is_saved(record, of_long_steps)) return attempt([&] { begin(triangles); }, record.time);
    long_steps_ = Companion::resumed(case_, start_, clock_, record, of_long_steps);
    if (Companion::is_saved(record, of_same_steps))
        same_steps_ = Companion::resumed(case_, start_, clock_, record, of_same_steps);
}

void check_companions(const Problem& c, const Record& record) {
    RunSoFar run;
    Comparison compared;
    compared_fields(RecordReader(record), run, compared);
    for (const std::string& prefix : {of_long_steps, of_same_steps}) Companion::check_restart(c, record, prefix);
}

}  // namespace tubule::surface3d
