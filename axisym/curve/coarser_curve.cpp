#include "axisym/curve/coarser_curve.hpp"

#include <algorithm>
#include <utility>

namespace tubule::axisym {
namespace {

// Measured choices: docs/decisions/curves.md, "How large is the error of a curve in motion?".
constexpr double start_steps = 40;                 // over which steps grow where the integrator begins
constexpr double least_share = 0.2;                // of the difference of a pair, which is the error of the coarser run
constexpr double alike = 0.7, share_if_alike = 3;  // runs of a pair by their steps, where these are not few: share()
constexpr int few_steps = 8;

const std::string prefix = "restart_coarser_";

// How it ended, and under which conditions: a run that is extended may have others.
struct Saved {
    int stop = -1;  // it has not ended
    double stop_time = 0, end = 0, stationary = 0;
};
template <class Fields, class S>
void saved_fields(Fields&& f, S& s) {
    f.number("stop", s.stop), f.number("stop_time", s.stop_time);
    f.number("end", s.end), f.number("stationary", s.stationary);
}

bool continues(const Saved& s, const TimeSpan& time) {
    if (s.stop < 0 || s.stop >= static_cast<int>(stop_kinds.size())) return true;
    const auto stop = static_cast<Stop>(s.stop);
    if (stop == Stop::finished) return s.stop_time < time.end * (1 - 1e-12);
    return stop == Stop::stationary && (s.end != time.end || s.stationary != time.stationary.value_or(0));
}

// Number of starts of the integrator until t: the first one, and one at each kink of the loads.
int beginnings(const MotionLaw& law, double t) {
    int count = 1;
    for (double kink = next_kink(law, 0); kink < t; kink = next_kink(law, kink)) ++count;
    return count;
}

RunObserver nobody;  // who sees its rows; pauses come from the clock

}  // namespace

CoarserCurve::CoarserCurve(const Problem& c, const InitialShape& start, const RunClock& clock,
                           const CurveSettings& settings)
    : case_(c), run_(std::make_unique<CurveSimulation>(c, start, settings, nullptr)) {
    run_->begin();
    loop_.emplace(loop_of(*run_, c, nobody, clock));
    loop_->begin();
}

CoarserCurve::CoarserCurve(const Problem& c, const InitialShape& start, const RunClock& clock, const Record& record)
    : case_(c) {
    const Record own = nested(record, prefix, RecordKind::curve);
    Saved saved;
    saved_fields(RecordReader(own), saved);
    run_ = std::make_unique<CurveSimulation>(c, start, curve_restart(own).settings, nullptr);
    run_->resume(own);
    loop_.emplace(loop_of(*run_, c, nobody, clock));
    loop_->resume(own);
    if (!continues(saved, c.time)) loop_->end({static_cast<Stop>(saved.stop), saved.stop_time, "", ""});
}

CoarserCurve::CoarserCurve(const Problem& c, std::unique_ptr<CurveSimulation> ended)
    : case_(c), run_(std::move(ended)) {
    run_->compare_no_more();
}

void CoarserCurve::check_restart(const Record& record) {
    const Record own = nested(record, prefix, RecordKind::curve);
    Saved saved;
    saved_fields(RecordReader(own), saved);
    curve_restart(own);
}

void CoarserCurve::save(Record& record) const {
    Record own = run_->restart_state();
    Saved saved{.end = case_.time.end, .stationary = case_.time.stationary.value_or(0)};
    if (const auto ended = stop(); ended && !can_go_on(ended->reason))
        saved.stop = static_cast<int>(ended->reason), saved.stop_time = ended->time;
    saved_fields(RecordWriter(own), saved);
    if (loop_) loop_->save_callbacks(own);
    nest(record, prefix, std::move(own));
}

void CoarserCurve::lead_to(double t) {
    while (loop_ && !loop_->stop() && run_->time() < t) loop_->step();
}

// The error is share(t) times the difference of the pair. Steps that only grow are alike in both runs and show nothing:
// 40/steps, within 0.2 to 1. If the tolerance limited clearly fewer steps of the finer run, both share the errors of
// the growing steps, which an instability may amplify: 3. With sources, which do not let errors be forgotten: 1.
double CoarserCurve::share(const EnergyTrace& trace, const CurveSettings& settings, double t) const {
    const int own = trace.limited_steps(step_growth_of(settings), t),
              other = run_->trace.limited_steps(step_growth_of(coarser(settings)), t);
    if (other >= few_steps && own < alike * other) return share_if_alike;
    if (case_.law.source.act()) return 1;
    const double growing = start_steps * beginnings(case_.law, t);
    return std::clamp(growing / std::max(trace.size(), 1), least_share, 1.0);
}

std::optional<double> CoarserCurve::error_of(const EnergyTrace& trace, const CurveSettings& settings, double t,
                                             double energy) const {
    const std::optional<double> difference = run_->trace.difference(t, energy);
    if (!difference) return std::nullopt;
    return share(trace, settings, t) * *difference;
}

}  // namespace tubule::axisym
