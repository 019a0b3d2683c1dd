#include "surface3d/run/motion_error.hpp"

#include <algorithm>
#include <stdexcept>

#include "common/result/record.hpp"
#include "common/solve/pause.hpp"
#include "surface3d/run/motion_start.hpp"

namespace tubule::surface3d {
namespace {

constexpr double least_coarser = 1.25;  // times fewer triangles: else the two runs are too much alike

// What is lost on fewer triangles may not be lost with elements of another order.
bool lost(const StopReport& stop) {
    return stop.reason == Stop::pinch_off || exit_code(stop.reason) == exit_code(Stop::solver_failed);
}

// What the record of a coarser run has beside its state.
struct Saved {
    double time = 0;
    int stop = -1;  // it goes on
    double stop_time = 0;
    SurfaceCells cells;
};
template <class Fields, class S>
void saved_fields(Fields&& f, S& s) {
    f.number("time", s.time), f.number("stop", s.stop), f.number("stop_time", s.stop_time);
    f.number("order", s.cells.order), f.number("period", s.cells.period);
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
    f.optional_array("restart_compared_coarser_at", r.coarser_at);
    f.optional_array("restart_compared_asked", r.asked, r.coarser_at.size());
    f.optional_array("restart_compared_had", r.had, r.coarser_at.size());
}

// Coarser runs, by the prefix of their names in the record of the run.
const std::string of_coarser = "restart_coarser_run_", of_same_steps = "restart_coarser_same_steps_";

bool is_saved(const Record& record, const std::string& prefix) {
    int exists = 0;
    RecordReader(record).number(prefix + "exists", exists);
    return exists != 0;
}

Record record_of(const Record& record, const std::string& prefix) {
    Record out;
    out.kind = RecordKind::surface;
    for (const auto& [name, value] : record.numbers)
        if (name.starts_with(prefix)) out.numbers.emplace_back(name.substr(prefix.size()), value);
    for (const Array& a : record.arrays)
        if (a.name.starts_with(prefix)) out.arrays.push_back({a.name.substr(prefix.size()), a.shape, a.data});
    return out;
}

Saved saved_of(Record& record) {
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
    record.time = out.time;
    return out;
}

void save_coarser(const MotionAttempt& run, const std::string& prefix, Record& record) {
    Record own = run.saved();
    Saved saved{.time = own.time, .cells = cells_of(run.mesh())};
    if (const auto& stop = run.stop(); stop && !can_go_on(stop->reason))
        saved.stop = static_cast<int>(stop->reason), saved.stop_time = stop->time;
    RecordWriter writer(own);
    saved_fields(writer, saved);
    writer.array("cells", std::vector<double>(saved.cells.cells.begin(), saved.cells.cells.end()));
    writer.array("shifts", std::vector<double>(saved.cells.shifts.begin(), saved.cells.shifts.end()));
    for (auto& [name, value] : own.numbers) record.numbers.emplace_back(prefix + name, value);
    for (Array& a : own.arrays) record.arrays.push_back({prefix + a.name, std::move(a.shape), std::move(a.data)});
}

}  // namespace

MotionError::MotionError(const Case& c, const Start& start, RunObserver& watch, const RunClock& clock,
                         const MotionSettings& of)
    : case_(c), start_(start), watch_(watch), clock_(clock), of_(of) {}

bool MotionError::tells_apart() const {
    return is_of_high_order(case_);
}

std::unique_ptr<MotionError::Coarser> MotionError::make(const MotionSettings& settings) const {
    auto out = std::make_unique<Coarser>(Coarser{case_, {}});
    const int order = element_order(case_);
    if (settings.role == Role::other_order) out->c.surface.order = order > 2 ? order - 1 : 3;
    out->c.surface.step.reset();
    out->c.time.output.clear();
    out->c.time.stationary.reset();  // it goes as far as the run does
    out->run.emplace(out->c, watch_, clock_, settings, nullptr);
    return out;
}

// What goes wrong in coarser runs leaves the run alone: its error is unknown from then on.
template <class Work>
void MotionError::attempt(const Work& work, double time) {
    try {
        work();
    } catch (const std::exception& failure) {
        coarser_.reset(), same_steps_.reset();
        failure_ = StopReport{Stop::solver_failed, time, failure.what(), ""};
    }
}

double MotionError::begin(int triangles, const MotionMeasures& start) {
    of_run_.growth = growth_of_coarser(case_, start.smoothness);
    of_run_.spare = spare_for_waves(case_, start.smoothness);
    attempt([&] { begin(triangles); }, begin_time(case_));
    return error_of_start(case_, start_, of_.elements, start.free_energy);
}

void MotionError::begin(int triangles) {
    const int fewer = fewer_triangles(of_.elements);
    if (start_.resizable() && fewer >= least_triangles) {
        try {
            const double coarser_by = 1.0 * triangles / start_.mesh(fewer, element_order(case_)).mesh.triangles();
            if (coarser_by >= least_coarser) return begin(Role::fewer_triangles, coarser_by);
        } catch (const std::exception&) {  // another order may do
        }
    }
    begin(Role::other_order, 1);
}

void MotionError::begin(Role role, double coarser_by) {
    const auto begun = [&] {
        auto next = make(coarser(of_, role, coarser_by));
        next->run->begin(start_);
        return next;
    };
    coarser_ = begun();
    if (tells_apart()) same_steps_ = begun();
    compared_ = {};
}

bool MotionError::is_compared(std::size_t i) const {
    return i % steps_at_once == 0 || !is_before(of_run_.times[i], case_.time.end);
}

// At all times that are to be compared. False if a coarser run does not get there.
bool MotionError::catch_up(double smoothness) {
    const auto gets_to = [this](MotionAttempt& run, double time) {
        run.advance_to(time, of_run_.growth);
        return run.state().X.size() > 0 && !is_before(run.state().time, time);
    };
    const std::vector<double>& times = of_run_.times;
    double largest = 0;
    for (int& i = compared_.compared; i < std::ssize(times); ++i) {
        if (same_steps_ && !gets_to(*same_steps_->run, times[i])) return false;
        if (!is_compared(i)) continue;
        if (!gets_to(*coarser_->run, times[i])) return false;
        largest = std::max(largest, error_at(i, smoothness));
        compared_.error = largest;
        follow_mesh(i);
    }
    return true;
}

// Where the run has got fewer triangles after this step, so do the coarser ones. If that is interrupted they begin
// again when the run goes on, since which of them has followed is not known.
void MotionError::follow_mesh(std::size_t i) try {
    const FollowedRun& r = of_run_;
    for (std::size_t k = 0; k < r.coarser_at.size(); ++k)
        if (r.coarser_at[k] == static_cast<double>(i))
            for (const auto* coarser : {&coarser_, &same_steps_}) {
                if (!*coarser) continue;
                MotionAttempt& run = *(*coarser)->run;
                const int triangles = static_cast<int>(r.asked[k]);
                run.follow_to(run.settings().role == Role::other_order ? triangles : fewer_triangles(triangles),
                              static_cast<int>(r.had[k]));
            }
} catch (const Paused&) {
    coarser_.reset(), same_steps_.reset();
    failure_ = StopReport{Stop::interrupted, of_run_.times[i], "", ""};
    throw;
}

bool MotionError::is_at(double time) const {
    const auto there = [&](const std::unique_ptr<Coarser>& coarser) {
        if (!coarser) return true;
        const MotionAttempt& run = *coarser->run;
        return !run.stop() && !is_before(run.state().time, time) && run.is_on_grid();
    };
    return failure_ || (there(coarser_) && there(same_steps_));
}

void MotionError::coarsen(int asked, int triangles) {
    FollowedRun& r = of_run_;
    const std::size_t last = r.times.size() - 1;
    r.coarser_at.push_back(static_cast<double>(last)), r.asked.push_back(asked), r.had.push_back(triangles);
    if (!failure_) attempt([&] { follow_mesh(last); }, r.times[last]);
}

// Where one coarser run tells errors in space and in time: theory.md (11.2), and (11.3) where the motion has sped up.
double MotionError::error_at_once(std::size_t i, double smoothness) {
    const FollowedRun& r = of_run_;
    Comparison& c = compared_;
    const double part = error_by_difference(case_, coarser_->run->settings(), smoothness);
    const double difference = coarser_->run->energy() - r.energies[i], at = static_cast<double>(i);
    const int steps = coarser_->run->steps();
    if (i == 0 || r.dissipations[i] <= c.slowest)
        c.slowest_at = at, c.slowest = c.fastest = r.dissipations[i], c.difference_then = difference,
        c.steps_then = steps;
    c.fastest = std::max(c.fastest, r.dissipations[i]);
    if (!has_sped_up(case_, c.fastest, c.slowest)) return std::abs(difference) * part;
    const double by_change = error_by_change((at - c.slowest_at) / std::max(steps - c.steps_then, 1.0));
    return std::abs(c.difference_then) * part + std::abs(difference - c.difference_then) * std::max(by_change, part);
}

// Which all coarser runs have got to.
double MotionError::error_at(std::size_t i, double smoothness) {
    const FollowedRun& r = of_run_;
    Comparison& c = compared_;
    const MotionSettings& settings = coarser_->run->settings();
    if (!same_steps_) return error_at_once(i, smoothness);
    const double longer_steps = coarser_->run->energy();
    const double same_steps = same_steps_->run->energy();
    const std::size_t since = i == 0 ? 0 : steps_at_once * ((i - 1) / steps_at_once) + 1;
    const auto order = static_cast<int>(*std::min_element(r.orders.begin() + since, r.orders.begin() + i + 1));
    c.sum_in_time += (longer_steps - same_steps - c.between) * error_in_time(order);
    c.between = longer_steps - same_steps;
    c.in_time = std::max(c.in_time, std::abs(c.sum_in_time));
    return std::abs(same_steps - r.energies[i]) * error_in_space(case_, settings, smoothness) + std::abs(c.sum_in_time);
}

// Without an end, or to that of a coarser run; what is lost on fewer triangles is tried with elements of another order.
void MotionError::follow(double smoothness) {
    while (true) {
        const Role role = coarser_->run->settings().role;
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

std::optional<double> MotionError::at(double time, double energy, double dissipation, int order, double smoothness) {
    of_run_.times.push_back(time), of_run_.energies.push_back(energy), of_run_.orders.push_back(order);
    of_run_.dissipations.push_back(dissipation);
    if (failure_) return std::nullopt;
    try {
        attempt([&] { follow(smoothness); }, time);
    } catch (const Paused&) {
        return std::nullopt;
    }
    if (failure_ || compared_.compared < std::ssize(of_run_.times)) return std::nullopt;
    return of_run_.spare * compared_.error;
}

std::optional<double> MotionError::in_time() const {
    if (!same_steps_) return std::nullopt;
    return compared_.in_time;
}

std::optional<StopReport> MotionError::stop() const {
    if (failure_) return failure_;
    std::optional<StopReport> out = coarser_ ? coarser_->run->stop() : std::nullopt;
    const std::optional<StopReport> other = same_steps_ ? same_steps_->run->stop() : std::nullopt;
    if (other && (!out || other->time < out->time)) return other;
    return out;
}

void MotionError::save(Record& record) const {
    RecordWriter writer(record);
    const auto is_begun = [](const auto& coarser) { return coarser && coarser->run->state().X.size() > 0; };
    const bool exists = is_begun(coarser_), both = exists && is_begun(same_steps_);
    writer.number(of_coarser + "exists", exists), writer.number(of_same_steps + "exists", both);
    compared_fields(writer, of_run_, compared_);
    if (exists) save_coarser(*coarser_->run, of_coarser, record);
    if (both) save_coarser(*same_steps_->run, of_same_steps, record);
}

void MotionError::resume(const Record& record, int triangles) {
    compared_fields(RecordReader(record), of_run_, compared_);
    if (!is_saved(record, of_coarser)) return attempt([&] { begin(triangles); }, record.time);
    const auto resumed = [&](const std::string& prefix) {
        Record own = record_of(record, prefix);
        const Saved saved = saved_of(own);
        auto out = make(motion_restart(own, time_scheme(case_)).memory.settings);
        out->run->resume({std::move(own), saved.cells}, start_);
        const auto stop = static_cast<Stop>(saved.stop);
        const bool goes_on =
            saved.stop < 0 || (stop == Stop::finished && saved.stop_time < case_.time.end * (1 - 1e-12));
        if (!goes_on) out->run->end({stop, saved.stop_time, "", ""});
        return out;
    };
    coarser_ = resumed(of_coarser);
    if (is_saved(record, of_same_steps)) same_steps_ = resumed(of_same_steps);
}

void check_error_restart(const Case& c, const Record& record) {
    FollowedRun run;
    Comparison compared;
    compared_fields(RecordReader(record), run, compared);
    for (const std::string& prefix : {of_coarser, of_same_steps}) {
        if (!is_saved(record, prefix)) continue;
        Record own = record_of(record, prefix);
        saved_of(own);
        motion_restart(own, time_scheme(c));
    }
}

}  // namespace tubule::surface3d
