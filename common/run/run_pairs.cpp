#include "common/run/run_pairs.hpp"

#include <fmt/format.h>

#include "common/result/record.hpp"

namespace tubule {
namespace {

constexpr const char *own_trace = "restart_trace", *coarser_trace = "restart_coarser_run", *role = "restart_role",
                     *coarser_stop = "restart_coarser_stop", *coarser_time = "restart_coarser_time";

}  // namespace

void add_to_record(Record& record, const EnergyTrace& own, const EndedRun* coarser) {
    record.arrays.push_back(own.array(own_trace));
    if (!coarser) return;
    record.numbers.emplace_back(coarser_stop, static_cast<double>(coarser->stop.reason));
    record.numbers.emplace_back(coarser_time, coarser->stop.time);
    if (!coarser->trace.empty()) record.arrays.push_back(coarser->trace.array(coarser_trace));
}

PairMemory pair_memory(const Record& record) {
    PairMemory out{EnergyTrace(record, own_trace), std::nullopt};
    out.own.cut_after(record.time);
    if (const auto stop = find_number(record, coarser_stop))
        out.coarser = EndedRun{EnergyTrace(record, coarser_trace),
                               {static_cast<Stop>(*stop), find_number(record, coarser_time).value_or(0), "", ""}};
    return out;
}

bool is_of_coarser_run(const Record& record) {
    return find_number(record, role).value_or(0) != 0;
}

RunPairs::RunPairs(PairedRuns& runs, const Case& c, RunObserver& watch, double begin_time, const Record* restart)
    : runs_(runs), watch_(watch), begin_time_(begin_time), resumes_(restart) {
    reported_began_ = restart && !is_of_coarser_run(*restart);
    if (!reported_began_) return;
    coarser_ = pair_memory(*restart).coarser;
    if (coarser_ && coarser_->stop.reason == Stop::stationary && !c.time.stationary) coarser_.reset();
}

RunSummary& RunPairs::next() {
    if (!coarser_) {
        if (!resumes_) runs_.show_start();
        RunSummary& other = runs_.run_coarser();
        if (can_go_on(other.stop.reason)) return unfinished(other);
        if (!reported_began_) watch_.discard();  // the start, and what the coarser run was saved with
        coarser_ = runs_.ended();
    }
    RunSummary& s = runs_.run_reported(*coarser_);
    const double error = runs_.error(*coarser_);
    s.estimated_error = s.reference_energy > 0 ? error / s.reference_energy : 1;
    return s;
}

bool RunPairs::refine(const RunSummary& last) {
    if (!runs_.refine(last)) return false;
    coarser_ = runs_.ended();
    return true;
}

// The coarser run has been saved, to go on with. Of the error nothing is known yet.
RunSummary& RunPairs::unfinished(RunSummary& s) const {
    s.estimated_error = 1;
    s.stop.message +=
        fmt::format(", at t = {:.6g} of the coarser run, which tells the error of the other", s.stop.time);
    s.stop.time = begin_time_;
    return s;
}

}  // namespace tubule
