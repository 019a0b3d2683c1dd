#include "common/run/run_pairs.hpp"

#include <fmt/format.h>

#include "common/result/record.hpp"

namespace tubule {
namespace {

constexpr const char* role = "restart_role";

struct Saved {
    EnergyTrace own, coarser;
    int coarser_stop = -1;  // there is no coarser run
    double coarser_time = 0, coarser_symbol = 0, coarser_end = 0, coarser_stationary = 0;
};
template <class Fields, class Memory>
void pair_fields(Fields&& f, Memory& m) {
    f.number("restart_coarser_stop", m.coarser_stop), f.number("restart_coarser_time", m.coarser_time);
    f.number("restart_coarser_symbol", m.coarser_symbol);
    f.number("restart_coarser_end", m.coarser_end), f.number("restart_coarser_stationary", m.coarser_stationary);
    EnergyTrace::fields(f, m.own, "restart_trace"), EnergyTrace::fields(f, m.coarser, "restart_coarser_trace");
}

}  // namespace

void add_to_record(Record& record, const EnergyTrace& own, const EndedRun* coarser) {
    Saved saved;
    saved.own = own;
    if (coarser)
        saved.coarser = coarser->trace, saved.coarser_stop = static_cast<int>(coarser->stop.reason),
        saved.coarser_time = coarser->stop.time, saved.coarser_symbol = coarser->least_symbol,
        saved.coarser_end = coarser->end, saved.coarser_stationary = coarser->stationary;
    pair_fields(RecordWriter(record), saved);
}

PairMemory pair_memory(const Record& record) {
    Saved saved;
    pair_fields(RecordReader(record), saved);
    saved.own.cut_after(record.time);
    PairMemory out{std::move(saved.own), std::nullopt};
    if (saved.coarser_stop >= 0 && saved.coarser_stop < static_cast<int>(stop_kinds.size()))
        out.coarser = EndedRun{std::move(saved.coarser),
                               {static_cast<Stop>(saved.coarser_stop), saved.coarser_time, "", ""},
                               saved.coarser_symbol,
                               saved.coarser_end,
                               saved.coarser_stationary};
    return out;
}

bool is_of_coarser_run(const Record& record) {
    return find_number(record, role).value_or(0) != 0;
}

namespace {

// Whether the coarser run ended where the reported one, which goes on, does not have to.
bool ended_too_early(const EndedRun& coarser, const TimeSpan& time) {
    if (coarser.stop.reason == Stop::finished) return coarser.stop.time < time.end * (1 - 1e-12);
    if (coarser.stop.reason != Stop::stationary) return false;
    return !time.stationary || coarser.end != time.end || coarser.stationary != *time.stationary;
}

}  // namespace

RunPairs::RunPairs(PairedRuns& runs, const Case& c, RunObserver& watch, double begin_time, const Record* restart)
    : runs_(runs), watch_(watch), time_(c.time), begin_time_(begin_time), resumes_(restart) {
    reported_began_ = restart && !is_of_coarser_run(*restart);
    if (!reported_began_) return;
    coarser_ = pair_memory(*restart).coarser;
    begin_time_ = restart->time;
    if (coarser_ && ended_too_early(*coarser_, time_)) coarser_.reset();
}

RunSummary& RunPairs::next() {
    if (!coarser_) {
        ++number_;
        watch_.next_run(number_, number_ + 1);
        if (!resumes_) runs_.show_start();
        RunSummary& other = runs_.run_coarser();
        if (can_go_on(other.stop.reason)) return unfinished(other);
        if (!reported_began_) watch_.discard();  // the start, and what the coarser run was saved with
        keep_coarser();
    }
    ++number_;
    watch_.next_run(number_, number_);
    RunSummary& s = runs_.run_reported(*coarser_);
    const double error = runs_.error(*coarser_);
    s.estimated_error = s.reference_energy > 0 ? error / s.reference_energy : 1;
    return s;
}

bool RunPairs::refine(const RunSummary& last) {
    if (!runs_.refine(last)) return false;
    keep_coarser();
    return true;
}

void RunPairs::keep_coarser() {
    coarser_ = runs_.ended();
    coarser_->end = time_.end, coarser_->stationary = time_.stationary.value_or(0);
}

// The coarser run has been saved, to be resumed. The error is not known yet.
RunSummary& RunPairs::unfinished(RunSummary& s) const {
    s.estimated_error = 1;
    s.stop.message +=
        fmt::format(", at t = {:.6g} of the coarser run, which serves to estimate the error", s.stop.time);
    s.stop.time = begin_time_;
    return s;
}

}  // namespace tubule
