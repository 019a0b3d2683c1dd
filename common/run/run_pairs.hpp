// Errors estimated by pairs of runs: the energies of a coarser run tell the error of the finer one, which is reported.
// Where that is more than asked, the finer run becomes the coarser one of the next pair.
#pragma once

#include <optional>
#include <string>

#include "common/run/driver.hpp"
#include "common/run/energy_trace.hpp"

namespace tubule {

// What is kept of a run to compare another one with.
struct EndedRun {
    EnergyTrace trace;
    StopReport stop;
    double least_symbol = 0;         // of a curve: how near its flow came to being ill-posed, theory.md (2.14)
    double end = 0, stationary = 0;  // time.end and time.stationary that it had; 0: none
};

// Which run of a pair a record belongs to (its number restart_role; 0: the run that is reported), and what it needs of
// the pair to go on. pair_memory() throws as RecordReader.
struct PairMemory {
    EnergyTrace own;
    std::optional<EndedRun> coarser;  // of the run that is reported
};
void add_to_record(Record& record, const EnergyTrace& own, const EndedRun* coarser);
PairMemory pair_memory(const Record& record);
bool is_of_coarser_run(const Record& record);

// The runs of one case that are to be compared. Those that have ended keep their summary until the next begins.
class PairedRuns {
public:
    virtual ~PairedRuns() = default;

    // Writes the start, so that the result shows it while the coarser run goes on.
    virtual void show_start() = 0;
    // Either run; it goes on with the one that was interrupted, if that is the same.
    virtual RunSummary& run_coarser() = 0;
    virtual RunSummary& run_reported(const EndedRun& coarser) = 0;
    // Of the run that has ended last.
    virtual EndedRun ended() = 0;

    // The error of the reported run, absolute. Appends a warning if it is unknown.
    virtual double error(const EndedRun& coarser) = 0;
    // As those of EstimatedRuns.
    virtual bool refine(const RunSummary& last) = 0;
    virtual std::string fixed_by() const = 0;
};

class RunPairs : public EstimatedRuns {
public:
    // `restart`: the record from which the runs go on, or none. If that is of a reported run whose coarser run ended
    // for a reason that no longer applies, such as a time.end that is later now, the coarser one is run again.
    RunPairs(PairedRuns& runs, const Case& c, RunObserver& watch, double begin_time, const Record* restart);

    RunSummary& next() override;
    bool refine(const RunSummary& last) override;
    std::string fixed_by() const override { return runs_.fixed_by(); }

private:
    RunSummary& unfinished(RunSummary& coarser) const;
    void keep_coarser();

    PairedRuns& runs_;
    RunObserver& watch_;
    TimeSpan time_;
    double begin_time_;                              // or that of the reported run which goes on
    bool resumes_ = false, reported_began_ = false;  // a run; the one to be reported
    int number_ = 0;                                 // of the run under way
    std::optional<EndedRun> coarser_;
};

}  // namespace tubule
