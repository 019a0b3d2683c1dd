// The loop of runs in time, on x' = -x: whose steps, rows and events are known.
#include "common/run/loop.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/run/stall.hpp"
#include "common/solve/stop.hpp"

namespace tubule::loop_test {

constexpr double step_length = 0.25;

struct Watch : RunObserver {
    std::vector<std::vector<double>> rows;
    std::vector<Record> frames, checkpoints;
    double interrupt_at = HUGE_VAL, latest = 0;

    void row(std::span<const double> values) override { rows.emplace_back(values.begin(), values.end()); }
    void frame(const std::function<Record()>& make) override { frames.push_back(make()); }
    void checkpoint(const Record& record) override { checkpoints.push_back(record); }
    void progress(double time, double, double) override { latest = time; }
    bool interrupted() override { return latest >= interrupt_at; }
};

// x(t) = exp(-t), exact steps; the energy x^2 falls by what dissipates, 2 x^2.
class Decay : public Simulation {
public:
    explicit Decay(bool lands) : lands_(lands) { summary.reference_energy = 1; }
    void resume(const Record& record) { time_ = record.time, step_ = step_length; }

    struct View : StateView {
        double t;
        explicit View(double time) : t(time) {}
        std::vector<double> row(double) const override { return {t, std::exp(-t)}; }
        Record record() const override {
            Record out;
            out.time = t;
            return out;
        }
    };

    double time() const override { return time_; }
    double step_size() const override { return step_; }
    Energetics energetics() const override {
        const double x = std::exp(-time_);
        return {.bending = x * x,
                .free_energy = x * x,
                .total = x * x,
                .total_start = 1,
                .total_least = x * x,
                .dissipation = 2 * x * x,
                .area = 1};
    }
    std::unique_ptr<StateView> at(double t) override { return std::make_unique<View>(t); }
    std::optional<StopReport> check_start() override { return find_event(false); }
    std::optional<StopReport> advance(double until) override {
        if (time_ >= fails_at) throw SolveError("singular");
        if (time_ >= rises_at) return StopReport{Stop::resolution_lost, time_, "the energy rises", ""};
        step_ = std::min(step_length, until - time_), time_ += step_;
        return std::nullopt;
    }
    bool lands_on_outputs() const override { return lands_; }
    std::optional<StopReport> update_error() override {
        if (time_ < inaccurate_from) return std::nullopt;
        return StopReport{Stop::resolution_lost, time_, "too inaccurate", ""};
    }
    std::optional<StopReport> find_event(bool) override {
        if (std::exp(-time_) > least_x) return std::nullopt;
        return StopReport{Stop::pinch_off, time_, "x is small", ""};
    }
    std::optional<StopReport> adapt_mesh() override {
        ++adapted;
        return std::nullopt;
    }
    StopReport failure(const SolveError& error) override { return {Stop::solver_failed, time_, error.what(), ""}; }
    void summarise() override { summary.effort = "done"; }

    double fails_at = HUGE_VAL, rises_at = HUGE_VAL, inaccurate_from = HUGE_VAL, least_x = 0;
    int adapted = 0;

private:
    bool lands_;
    double time_ = 0, step_ = 0;
};

Case decay_case(double end, std::vector<double> output = {}) {
    Case c;
    c.model.kind = ModelKind::gradient_flow;
    c.time.end = end, c.time.output = std::move(output);
    return c;
}

struct Ended {
    Problem c;
    Decay run;
    Watch watch;

    Ended(const Case& given, bool lands) : c(given), run(lands) {}
    const RunSummary& go(const Record* restart = nullptr) {
        const RunClock clock(c.time, watch);
        Loop loop(run, c, watch, clock);
        if (restart) {
            run.resume(*restart);
            loop.resume(*restart);
        } else {
            loop.begin();
        }
        loop.go();
        return run.summary;
    }
    std::vector<double> times() const {
        std::vector<double> out;
        for (const auto& row : watch.rows) out.push_back(row[0]);
        return out;
    }
};

std::vector<double> times_of(const std::vector<Record>& records) {
    std::vector<double> out;
    for (const Record& r : records) out.push_back(r.time);
    return out;
}

TEST(Loop, WritesRowsOfStepsAndOutputs) {
    Ended within(decay_case(0.75, {0.3, 0.5}), false);
    EXPECT_EQ(within.go().stop.reason, Stop::finished);
    EXPECT_EQ(within.times(), (std::vector<double>{0, 0.25, 0.3, 0.5, 0.75}));
    EXPECT_EQ(times_of(within.watch.frames), (std::vector<double>{0, 0.3, 0.5, 0.75}));
    EXPECT_EQ(within.watch.rows[2][1], std::exp(-0.3));
    EXPECT_DOUBLE_EQ(within.run.summary.energy, std::exp(-1.5));
    EXPECT_EQ(within.run.summary.effort, "done");
    EXPECT_EQ(within.run.adapted, 2);  // not where the run has ended

    Ended lands(decay_case(0.75, {0.3, 0.5}), true);
    lands.go();
    EXPECT_EQ(lands.times(), (std::vector<double>{0, 0.25, 0.3, 0.5, 0.75}));
}

TEST(Loop, StopsAtAnEventAndWritesIt) {
    Ended run(decay_case(10), false);
    run.run.least_x = 0.5;
    const RunSummary& s = run.go();
    EXPECT_EQ(s.stop.reason, Stop::pinch_off);
    EXPECT_EQ(s.stop.time, 0.75);
    EXPECT_EQ(run.times().back(), 0.75);
    EXPECT_EQ(times_of(run.watch.frames), (std::vector<double>{0, 0.75}));

    Ended at_once(decay_case(10), false);
    at_once.run.least_x = 2;
    EXPECT_EQ(at_once.go().stop.time, 0);
    EXPECT_EQ(at_once.times(), (std::vector<double>{0}));
}

TEST(Loop, StopsWithoutARowWhereNoStepLeadsOn) {
    for (const auto limit : {&Decay::fails_at, &Decay::rises_at}) {
        Ended run(decay_case(10), false);
        run.run.*limit = 0.5;
        EXPECT_EQ(run.go().stop.reason, limit == &Decay::fails_at ? Stop::solver_failed : Stop::resolution_lost);
        EXPECT_EQ(run.times(), (std::vector<double>{0, 0.25, 0.5}));
    }
    Ended inaccurate(decay_case(10), false);
    inaccurate.run.inaccurate_from = 0.5;
    EXPECT_EQ(inaccurate.go().stop.message, "too inaccurate");
}

TEST(Loop, StopsWhenNothingChanges) {
    Case c = decay_case(100);
    c.time.stationary = 1e-6;
    Ended run(c, false);
    const RunSummary& s = run.go();
    EXPECT_EQ(s.stop.reason, Stop::stationary);
    // 2 x^2 (100 - t) < 1e-6 from t = 9.5 on; sqrt(2) x is below sqrt(1e-6) times the size, sqrt(1/(4 pi)), before
    EXPECT_NEAR(s.stop.time, 9.5, 0.3);
}

// A run that was interrupted and resumed looks for rest and for stalls as one that was not.
TEST(Loop, ResumesWithWhatItsCallbacksKnow) {
    Case c = decay_case(100);
    c.time.stationary = 1e-6;
    Ended whole(c, false);
    const double rests_at = whole.go().stop.time;

    for (const double interrupt_at : {0.25, 5.0, 9.0}) {
        Ended first(c, false);
        first.watch.interrupt_at = interrupt_at;
        EXPECT_EQ(first.go().stop.reason, Stop::interrupted);
        ASSERT_EQ(times_of(first.watch.checkpoints), (std::vector<double>{interrupt_at}));
        Ended rest(c, false);
        EXPECT_EQ(rest.go(&first.watch.checkpoints[0]).stop.time, rests_at);
        EXPECT_EQ(rest.times().front(), interrupt_at + step_length);
    }

    Stall before(3, 1, 1e-3, ""), after(3, 1, 1e-3, "");
    for (int i = 0; i < 4; ++i) EXPECT_FALSE(before.look(1, 1e-3, 1));
    Record record;
    before.save(record);
    after.restore(record);
    EXPECT_TRUE(after.look(1, 1e-3, 1));
}

TEST(Loop, ResumesAtItsEnd) {
    Record record;
    record.time = 0.5;
    Ended run(decay_case(0.5), false);
    EXPECT_EQ(run.go(&record).stop.reason, Stop::finished);
    EXPECT_TRUE(run.watch.rows.empty());
}

}  // namespace tubule::loop_test
