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

// Coarser runs, by the prefix of their names in the record of the run.
const std::string of_coarser = "restart_coarser_run_", of_same_steps = "restart_coarser_same_steps_";

}  // namespace

MotionError::MotionError(const Problem& c, const Start& start, const RunClock& clock, const MotionSettings& of)
    : case_(c), start_(start), clock_(clock), of_(of) {}

bool MotionError::separates_time_error() const {
    return is_of_high_order(case_);
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
    attempt([&] { begin(triangles); }, case_.begin_time);
    return error_of_start(case_, start_, of_.elements, start.free_energy, is_rough(start.smoothness));
}

void MotionError::begin(int triangles) {
    const int fewer = fewer_triangles(of_.elements);
    if (start_.resizable() && fewer >= least_triangles) {
        try {
            const double coarser_by = 1.0 * triangles / start_.mesh(fewer, case_.element_order).mesh.triangles();
            if (coarser_by >= least_coarser) return begin(Role::fewer_triangles, coarser_by);
        } catch (const std::exception&) {  // another order may do
        }
    }
    begin(Role::other_order, 1);
}

void MotionError::begin(Role role, double coarser_by) {
    const auto begun = [&] {
        auto next = std::make_unique<CoarserRun>(case_, start_, clock_, coarser(of_, role, coarser_by));
        next->begin();
        return next;
    };
    coarser_ = begun();
    if (separates_time_error()) same_steps_ = begun();
    compared_ = {};
}

bool MotionError::is_compared(std::size_t i) const {
    return i % steps_at_once == 0 || !is_before(of_run_.times[i], case_.time.end);
}

// At all times that are to be compared. False if a coarser run does not get there.
bool MotionError::catch_up(double smoothness) {
    const std::vector<double>& times = of_run_.times;
    double largest = 0;
    for (int& i = compared_.compared; i < std::ssize(times); ++i) {
        if (same_steps_ && !same_steps_->advance_to(times[i], of_run_.growth)) return false;
        if (!is_compared(i)) continue;
        if (!coarser_->advance_to(times[i], of_run_.growth)) return false;
        largest = std::max(largest, error_at(i, smoothness));
        compared_.error = largest;
        follow_mesh(i);
    }
    return true;
}

// Where the run has got fewer triangles after this step, so do the coarser ones. If that is interrupted they begin
// again when the run resumes, since which of them has followed is not known.
void MotionError::follow_mesh(std::size_t i) try {
    const FollowedRun& r = of_run_;
    for (std::size_t k = 0; k < r.thinned_at.size(); ++k)
        if (r.thinned_at[k] == static_cast<double>(i))
            for (const auto* coarser : {&coarser_, &same_steps_}) {
                if (!*coarser) continue;
                const int triangles = static_cast<int>(r.asked[k]);
                const bool as_many = (*coarser)->run().settings().role == Role::other_order;
                (*coarser)->follow_to(as_many ? triangles : fewer_triangles(triangles), static_cast<int>(r.had[k]));
            }
} catch (const Paused&) {
    coarser_.reset(), same_steps_.reset();
    failure_ = StopReport{Stop::interrupted, of_run_.times[i], "", ""};
    throw;
}

bool MotionError::is_at(double time) const {
    const auto there = [&](const std::unique_ptr<CoarserRun>& coarser) {
        return !coarser || (!coarser->stop() && coarser->is_at(time) && coarser->is_on_grid());
    };
    return failure_ || (there(coarser_) && there(same_steps_));
}

void MotionError::thinned(int asked, int triangles) {
    FollowedRun& r = of_run_;
    const std::size_t last = r.times.size() - 1;
    r.thinned_at.push_back(static_cast<double>(last)), r.asked.push_back(asked), r.had.push_back(triangles);
    if (!failure_) attempt([&] { follow_mesh(last); }, r.times[last]);
}

// With one coarser run for errors in space and time: theory.md (11.2), and (11.3) where the motion has sped up.
double MotionError::error_at_once(std::size_t i, double smoothness) {
    const FollowedRun& r = of_run_;
    Comparison& c = compared_;
    const double part = error_by_difference(case_, coarser_->run().settings(), smoothness);
    const double difference = coarser_->energy() - r.energies[i], at = static_cast<double>(i);
    const int steps = coarser_->steps();
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
    const MotionSettings& settings = coarser_->run().settings();
    if (!same_steps_) return error_at_once(i, smoothness);
    const double longer_steps = coarser_->energy();
    const double same_steps = same_steps_->energy();
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
        const Role role = coarser_->run().settings().role;
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

std::optional<double> MotionError::follow_to(double time, double energy, double dissipation, int order,
                                             double smoothness) {
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
    std::optional<StopReport> out = coarser_ ? coarser_->stop() : std::nullopt;
    const std::optional<StopReport> other = same_steps_ ? same_steps_->stop() : std::nullopt;
    if (other && (!out || other->time < out->time)) return other;
    return out;
}

void MotionError::save(Record& record) const {
    RecordWriter writer(record);
    const auto is_begun = [](const auto& coarser) { return coarser && coarser->has_begun(); };
    const bool exists = is_begun(coarser_), both = exists && is_begun(same_steps_);
    writer.number(of_coarser + "exists", exists), writer.number(of_same_steps + "exists", both);
    compared_fields(writer, of_run_, compared_);
    if (exists) coarser_->save(of_coarser, record);
    if (both) same_steps_->save(of_same_steps, record);
}

void MotionError::resume(const Record& record, int triangles) {
    compared_fields(RecordReader(record), of_run_, compared_);
    if (!CoarserRun::is_saved(record, of_coarser)) return attempt([&] { begin(triangles); }, record.time);
    coarser_ = CoarserRun::resumed(case_, start_, clock_, record, of_coarser);
    if (CoarserRun::is_saved(record, of_same_steps))
        same_steps_ = CoarserRun::resumed(case_, start_, clock_, record, of_same_steps);
}

void check_error_restart(const Problem& c, const Record& record) {
    FollowedRun run;
    Comparison compared;
    compared_fields(RecordReader(record), run, compared);
    for (const std::string& prefix : {of_coarser, of_same_steps}) CoarserRun::check_restart(c, record, prefix);
}

}  // namespace tubule::surface3d
