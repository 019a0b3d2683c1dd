#include "surface3d/run/coarser_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "common/result/record.hpp"

namespace tubule::surface3d {
namespace {

// Most trials of a coarser run for some steps of the run: those of one whose mesh is no longer good enough would
// otherwise have no end.
constexpr int most_at_once = 40;

RunObserver nobody;  // who sees its rows; pauses come from the clock

// The record of a coarser run in addition to its state.
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

Problem problem_of_coarser(const Problem& c, Role role) {
    Case out = c;
    const int order = c.element_order;
    if (role == Role::other_order) out.surface.order = order > 2 ? order - 1 : 3;
    out.surface.step.reset();
    out.time.output.clear();
    out.time.stationary.reset();  // it continues as long as the run
    return out;
}

}  // namespace

CoarserRun::CoarserRun(const Problem& c, const Start& start, const RunClock& clock, const MotionSettings& settings)
    : case_(std::make_unique<const Problem>(problem_of_coarser(c, settings.role))),
      start_(start),
      clock_(clock),
      run_(*case_, nobody, settings, nullptr) {}

void CoarserRun::begin() {
    run_.begin(start_);
    loop_.emplace(loop_of(run_, *case_, nobody, clock_));
    loop_->begin();
}

std::unique_ptr<CoarserRun> CoarserRun::resumed(const Problem& c, const Start& start, const RunClock& clock,
                                                const Record& record, const std::string& prefix) {
    Record own = nested(record, prefix, RecordKind::surface);
    const Saved saved = saved_of(own);
    auto out = std::make_unique<CoarserRun>(c, start, clock, motion_restart(own, c.scheme).memory.settings);
    const Restart restart{std::move(own), saved.cells};
    out->run_.resume(restart, start);
    out->loop_.emplace(loop_of(out->run_, *out->case_, nobody, clock));
    out->loop_->resume(restart.record);
    const auto stop = static_cast<Stop>(saved.stop);
    const bool continues = saved.stop < 0 || (stop == Stop::finished && is_before(saved.stop_time, c.time.end));
    if (!continues) out->loop_->end({stop, saved.stop_time, "", ""});
    return out;
}

bool CoarserRun::is_saved(const Record& record, const std::string& prefix) {
    int exists = 0;
    RecordReader(record).number(prefix + "exists", exists);
    return exists != 0;
}

void CoarserRun::check_restart(const Problem& c, const Record& record, const std::string& prefix) {
    if (!is_saved(record, prefix)) return;
    const Record own = nested(record, prefix, RecordKind::surface);
    saved_of(own);
    motion_restart(own, c.scheme);
}

void CoarserRun::save(const std::string& prefix, Record& record) const {
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

bool CoarserRun::advance_to(double time, double growth) {
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

void CoarserRun::follow_to(int triangles, int of_run) {
    if (const auto none = run_.follow_with(triangles, of_run)) loop_->end(*none);
}

}  // namespace tubule::surface3d
