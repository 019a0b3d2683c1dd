// The driver of runs that estimate their error, and the energies that two runs are compared by. What is expected
// follows from the fake runs: each is ten times as accurate as the one before.
#include "common/run/driver.hpp"

#include <gtest/gtest.h>

#include "common/result/record.hpp"
#include "common/run/energy_trace.hpp"
#include "common/run/run_output.hpp"
#include "tests/missing_fields.hpp"

namespace tubule::driver_test {

struct Watch : RunObserver {
    int discards = 0;
    bool stop = false;
    void discard() override { ++discards; }
    bool interrupted() override { return stop; }
};

class FakeRuns : public EstimatedRuns {
public:
    RunSummary& next() override {
        summary_ = {};
        summary_.stop = {Stop::finished, 2, "reached time.end", ""};
        summary_.estimated_error = error;
        return summary_;
    }
    bool refine(const RunSummary& last) override {
        if (last.as_accurate_as_asked || error < least) return false;
        error /= 10;
        return true;
    }
    std::string fixed_by() const override { return fixed; }

    double error = 1, least = 0;
    std::string fixed;

private:
    RunSummary summary_;
};

RunSummary driven(FakeRuns& runs, Watch& watch) {
    Case c;
    c.accuracy.energy = 2e-3;
    const RunClock clock(c.time, watch);
    return drive(c, watch, clock, runs);
}

TEST(Driver, RefinesUntilTheRunIsAsAccurateAsAsked) {
    FakeRuns runs;
    Watch watch;
    const RunSummary s = driven(runs, watch);
    EXPECT_EQ(s.stop.reason, Stop::finished);
    EXPECT_DOUBLE_EQ(s.estimated_error, 1e-3);
    EXPECT_TRUE(s.as_accurate_as_asked);
    EXPECT_EQ(watch.discards, 3);
}

TEST(Driver, SaysWhatIsMissed) {
    FakeRuns runs;
    runs.least = 0.5;  // one refinement
    Watch watch;
    const RunSummary lost = driven(runs, watch);
    EXPECT_EQ(lost.stop.reason, Stop::resolution_lost);
    EXPECT_EQ(lost.stop.message, "the estimated error of the energy is 0.1 of E_ref, but 0.002 was asked for");
    EXPECT_TRUE(lost.warnings.empty());

    FakeRuns given;
    given.least = 2, given.fixed = "the triangles are given";
    const RunSummary warned = driven(given, watch);
    EXPECT_EQ(warned.stop.reason, Stop::finished);
    ASSERT_EQ(warned.warnings.size(), 1u);
    EXPECT_EQ(warned.warnings[0],
              "the error of the energy is unknown, but 0.002 was asked for: the triangles are given");
}

TEST(Driver, PausesBeforeAFinerRun) {
    FakeRuns runs;
    Watch watch;
    watch.stop = true;
    const RunSummary s = driven(runs, watch);
    EXPECT_EQ(s.stop.reason, Stop::interrupted);
    EXPECT_EQ(s.stop.message, "a signal ended the run, before a finer run");
    EXPECT_EQ(s.stop.time, 2);
    EXPECT_EQ(watch.discards, 0);
}

TEST(OutputTimes, AreThoseAfterTheBeginInOrder) {
    Case c;
    c.time.end = 3, c.time.output = {2, 1, 0, 2};
    OutputTimes times(c.time);
    EXPECT_EQ(times.pass(), 1);
    EXPECT_TRUE(times.due(2));
    EXPECT_FALSE(times.due(1.9));
    times.go_on_from(2);
    EXPECT_EQ(times.pass(), 3);
    EXPECT_TRUE(times.done());
}

TEST(EnergyTrace, IsTheSameFromARecord) {
    // A cubic and its slope: what is interpolated is exact.
    EnergyTrace trace;
    for (const double t : {0.0, 1.0, 2.5, 3.0}) trace.add(t, t * t * t, 3 * t * t);
    trace.add(2.0, 7, 7);  // not later than all before
    EXPECT_NEAR(trace(2), 8, 1e-14);
    EXPECT_NEAR(trace.difference(2, 9.0).value(), 1, 1e-14);
    EXPECT_FALSE(trace.difference(3.1, 0));

    Record record;
    EnergyTrace::fields(RecordWriter(record), trace, "restart_trace");
    EnergyTrace restored;
    EnergyTrace::fields(RecordReader(record), restored, "restart_trace");
    EXPECT_EQ(restored(2.75), trace(2.75));
    restored.cut_after(2.5);
    EXPECT_EQ(restored.end(), 2.5);
    expect_each_field_is_needed<std::runtime_error>(record, "restart_", [](const Record& damaged) {
        EnergyTrace again;
        EnergyTrace::fields(RecordReader(damaged), again, "restart_trace");
    });
}

TEST(Record, HoldsAnotherOne) {
    Record inner, outer;
    inner.time = 2, inner.kind = RecordKind::curve;
    inner.numbers = {{"step", 0.5}}, inner.arrays = {array("r", std::vector<double>{1, 2})};
    outer.time = 3, outer.numbers = {{"step", 7}};
    nest(outer, "coarser_", inner);
    EXPECT_EQ(outer.numbers.front(), (std::pair<std::string, double>{"step", 7}));
    const Record found = nested(outer, "coarser_", RecordKind::curve);
    EXPECT_EQ(found.time, 2);
    EXPECT_EQ(find_number(found, "step"), 0.5);
    EXPECT_EQ(find_array(found, "r")->data, (std::vector<double>{1, 2}));
    EXPECT_THROW(nested(inner, "coarser_", RecordKind::curve), std::runtime_error);
}

}  // namespace tubule::driver_test
