#include "common/run/loop.hpp"

#include <algorithm>

#include "common/run/energy_checks.hpp"
#include "common/run/stationarity.hpp"

namespace tubule {

Loop::Loop(Simulation& run, const Problem& c, RunObserver& watch, const RunClock& clock, bool reported)
    : run_(run), case_(c), clock_(clock), out_(watch, clock, reported), outputs_(c.time) {
    if (c.time.stationary) add(std::make_unique<Stationarity>(c));
}

void Loop::begin(const std::string& note) {
    if (run_.has_state()) {
        const double t = run_.begin_time();
        outputs_.go_on_from(t);
        out_.note(doubt_before(case_, run_.energetics().free_energy, run_.summary.reference_energy));
        out_.note(note);
        const auto state = run_.at(t);
        write_row(*state, t);
        out_.frame(t, [&] { return record(*state); });
    }
    stop_ = run_.check_start();
}

void Loop::resume(const Record& restart) {
    outputs_.go_on_from(run_.time());
    out_.go_on_from(run_.time());
    for (const auto& callback : callbacks_) callback->restore(restart);
    stop_ = outputs_.done() ? StopReport{Stop::finished, run_.time(), "reached time.end", ""} : run_.check_start();
}

void Loop::go() {
    while (!stop_) step();
    finish();
}

void Loop::go_from(const Record* restart, const std::string& note) {
    if (restart)
        resume(*restart);
    else
        begin(note);
    go();
}

// 1 step, 2 error, 3 rows and frames, 4 accept, 5 events, 6 end, error, callbacks, pause, 7 checkpoint, 8 new mesh. A
// stop in 1 or 2 skips the rest: only finish() writes then.
void Loop::step(double until) try {
    const double from = run_.time();
    until = std::min({until, case_.time.end, run_.lands_on_outputs() ? outputs_.next() : HUGE_VAL});
    if ((stop_ = run_.advance(until))) return;
    if ((stop_ = run_.update_error())) return;
    const bool at_output = write_step(from);
    run_.accept();
    stop_ = run_.find_event(at_output);
    if (!stop_) stop_ = check_progress();
    if (stop_) return;
    out_.checkpoint_if_due([this] { return restart_record(); });
    const bool output_is_near = outputs_.next() - run_.time() < 1e-9 * run_.time();
    if (!output_is_near) stop_ = run_.adapt_mesh();
} catch (const SolveError& error) {
    stop_ = run_.failure(error);
} catch (const Paused& pause) {
    stop_ = pause_report(pause, run_.time());
}

// Rows and frames of the last step; whether it ends at an output.
bool Loop::write_step(double from) {
    const double end = run_.time();
    bool at_output = false;
    while (outputs_.due(end)) {
        const double t = outputs_.pass();
        at_output = t == end;
        if (!out_.reported()) continue;
        run_.write_path(from, t, out_);
        const auto state = run_.at(t);
        write_row(*state, t);
        out_.frame(t, [&] { return record(*state); });
        from = t;
    }
    if (out_.reported()) run_.write_path(from, end, out_);
    if (out_.wants_row(end)) write_row(*run_.at(end), end);
    out_.progress(end, run_.energetics().bending, run_.step_size());
    return at_output;
}

void Loop::write_row(const StateView& state, double t) {
    if (out_.wants_row(t)) out_.row(t, state.row(out_.seconds()));
}

std::optional<StopReport> Loop::check_progress() {
    if (outputs_.done()) return StopReport{Stop::finished, run_.time(), "reached time.end", ""};
    if (auto stop = run_.check_error()) return stop;
    for (const auto& callback : callbacks_)
        if (auto stop = callback->after_step(run_)) return stop;
    return clock_.find_pause(run_.time());  // last: what is saved then has seen this step
}

Record Loop::record(const StateView& state) const {
    Record out = state.record();
    save_callbacks(out);
    return out;
}

void Loop::save_callbacks(Record& record) const {
    for (const auto& callback : callbacks_) callback->save(record);
}

Record Loop::restart_record() {
    return record(*run_.at(run_.time()));
}

void Loop::finish() {
    RunSummary& summary = run_.summary;
    summary.stop = *stop_;
    run_.summarise();
    if (!run_.has_state()) return;
    const Energetics e = run_.energetics();
    summary.energy = e.bending;
    if (auto doubt = doubt_after(case_, stop_->reason, e.total_start, e.total, summary.reference_energy);
        !doubt.empty())
        summary.warnings.push_back(std::move(doubt));
    if (out_.wants_row(run_.time())) write_row(*run_.at(run_.time()), run_.time());
    out_.end(*stop_, run_.time(), [this] { return restart_record(); });
}

}  // namespace tubule
