#include "surface3d/run/motion_error.hpp"

#include <algorithm>
#include <stdexcept>

#include "common/result/record.hpp"
#include "common/solve/memory.hpp"
#include "common/solve/pause.hpp"
#include "surface3d/run/motion_start.hpp"

namespace tubule::surface3d {
namespace {

constexpr double least_coarser = 1.25;  // times fewer triangles: else the two runs are too much alike
constexpr double much_finer = 2.25;     // times more triangles: errors of the start fall at least by this
const std::string prefix = "restart_coarser_run_";

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
    ComparedEnergies of_run;
};
template <class Fields, class S>
void saved_fields(Fields&& f, S& s) {
    f.number("time", s.time), f.number("stop", s.stop), f.number("stop_time", s.stop_time);
    f.number("order", s.cells.order), f.number("period", s.cells.period);
    f.number("compared", s.of_run.compared), f.number("since", s.of_run.since), f.number("error", s.of_run.error);
    f.array("run_times", s.of_run.times), f.array("run_energies", s.of_run.energies, s.of_run.times.size());
}

// The record of the coarser run in that of the run, if it has one.
std::optional<Record> coarser_record(const Record& record) {
    int exists = 0;
    RecordReader(record).number("restart_compared", exists);
    if (!exists) return std::nullopt;
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

}  // namespace

MotionError::MotionError(const Case& c, const Start& start, RunObserver& watch, const RunClock& clock,
                         const MotionSettings& of)
    : case_(c), start_(start), watch_(watch), clock_(clock), of_(of) {}

std::unique_ptr<MotionError::Coarser> MotionError::make(Role role, const MotionSettings& settings) const {
    auto out = std::make_unique<Coarser>(Coarser{case_, {}});
    const int order = element_order(case_);
    if (role == Role::other_order) out->c.surface.order = order > 2 ? order - 1 : 3;
    out->c.surface.step.reset();
    out->c.time.output.clear();
    out->c.time.stationary.reset();  // it goes as far as the run does
    out->run.emplace(out->c, watch_, clock_, settings, nullptr);
    return out;
}

double MotionError::begin(int triangles, double energy) {
    begin(triangles);
    return error_of_start(energy);
}

double MotionError::error_of_start(double energy) const {
    if (!start_.resizable()) return 0;
    try {
        const StartMesh finer = start_.mesh(static_cast<int>(much_finer * of_.elements), element_order(case_));
        return std::abs(free_energy(case_, observe_start(case_, finer), finer.mesh.period) - energy) * much_finer /
               (much_finer - 1);
    } catch (const TooLarge&) {
        return 0;
    }
}

void MotionError::begin(int triangles) {
    const int fewer = fewer_triangles(of_.elements);
    if (start_.resizable() && fewer >= least_triangles) {
        const double coarser_by = 1.0 * triangles / start_.mesh(fewer, element_order(case_)).mesh.triangles();
        if (coarser_by >= least_coarser) return begin(Role::fewer_triangles, coarser_by);
    }
    begin(Role::other_order, 1);
}

void MotionError::begin(Role role, double coarser_by) {
    auto next = make(role, coarser(of_, role, coarser_by));
    next->run->begin(start_);
    coarser_ = std::move(next);
    of_run_.compared = 0;
}

// At all times that are to be compared. False if the coarser run does not get there.
bool MotionError::catch_up(double smoothness) {
    MotionAttempt& run = *coarser_->run;
    ComparedEnergies& r = of_run_;
    double largest = 0;
    for (; r.compared < std::ssize(r.times); ++r.compared) {
        run.advance_to(r.times[r.compared]);
        if (run.state().X.size() == 0 || is_before(run.state().time, r.times[r.compared])) return false;
        largest = std::max(largest, std::abs(run.energy() - r.energies[r.compared]));
        r.error = largest * error_by_difference(case_, run.settings(), smoothness);
    }
    return true;
}

std::optional<double> MotionError::at(double time, double energy, double smoothness) {
    const bool last = !is_before(time, case_.time.end);
    if (of_run_.times.empty() || ++of_run_.since >= steps_at_once || last) {
        of_run_.times.push_back(time), of_run_.energies.push_back(energy);
        of_run_.since = 0;
    }
    try {
        while (!catch_up(smoothness)) {
            const auto& stop = coarser_->run->stop();
            if (!stop || !lost(*stop) || coarser_->run->settings().role == Role::other_order) return std::nullopt;
            begin(Role::other_order, 1);
        }
    } catch (const Paused&) {
        return std::nullopt;
    }
    return of_run_.error;
}

std::optional<StopReport> MotionError::stop() const {
    return coarser_ ? coarser_->run->stop() : std::nullopt;
}

void MotionError::save(Record& record) const {
    const bool exists = coarser_ && coarser_->run->state().X.size() > 0;
    RecordWriter(record).number("restart_compared", exists);
    if (!exists) return;
    const MotionAttempt& run = *coarser_->run;
    Record own = run.saved();
    Saved saved{.time = own.time, .cells = cells_of(run.mesh()), .of_run = of_run_};
    if (const auto& stop = run.stop(); stop && !can_go_on(stop->reason))
        saved.stop = static_cast<int>(stop->reason), saved.stop_time = stop->time;
    RecordWriter writer(own);
    saved_fields(writer, saved);
    writer.array("cells", std::vector<double>(saved.cells.cells.begin(), saved.cells.cells.end()));
    writer.array("shifts", std::vector<double>(saved.cells.shifts.begin(), saved.cells.shifts.end()));
    for (auto& [name, value] : own.numbers) record.numbers.emplace_back(prefix + name, value);
    for (Array& a : own.arrays) record.arrays.push_back({prefix + a.name, std::move(a.shape), std::move(a.data)});
}

void MotionError::resume(const Record& record, int triangles) {
    auto own = coarser_record(record);
    if (!own) return begin(triangles);
    const Saved saved = saved_of(*own);
    const MotionSettings settings = motion_restart(*own, time_scheme(case_)).memory.settings;
    coarser_ = make(settings.role, settings);
    coarser_->run->resume({std::move(*own), saved.cells});
    of_run_ = saved.of_run;
    const auto stop = static_cast<Stop>(saved.stop);
    const bool goes_on = saved.stop < 0 || (stop == Stop::finished && saved.stop_time < case_.time.end * (1 - 1e-12));
    if (!goes_on) coarser_->run->end({stop, saved.stop_time, "", ""});
}

void check_error_restart(const Case& c, const Record& record) {
    auto own = coarser_record(record);
    if (!own) return;
    saved_of(*own);
    motion_restart(*own, time_scheme(c));
}

}  // namespace tubule::surface3d
