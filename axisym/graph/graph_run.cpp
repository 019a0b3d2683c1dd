#include "axisym/graph/graph_run.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "axisym/graph/graph_attempt.hpp"
#include "common/run/driver.hpp"

namespace tubule::axisym {
namespace {

constexpr int most_attempts = 6;

class GraphRuns : public EstimatedRuns {
public:
    GraphRuns(const Case& c, RunObserver& watch, const RunClock& clock, const Record* restart)
        : case_(c), watch_(watch), clock_(clock), restart_(restart), settings_(first_graph_settings(c)) {}

    RunSummary& next() override {
        settings_.may_give_up = count_ < most_attempts;
        run_.emplace(case_, watch_, clock_, settings_);
        if (restart_)
            run_->resume(*std::exchange(restart_, nullptr));
        else
            run_->begin();
        run_->go();
        run_->summary.attempts = count_;
        describe_effort(run_->summary);
        return run_->summary;
    }

    bool refine(const tubule::RunSummary& last) override {
        if (!run_->gave_up) return false;
        const double allowed = case_.accuracy.energy * last.reference_energy / stated_over_computed;
        const double of_space = std::abs(run_->latest_error().spatial);
        const bool space_is_stuck = of_space > 0.5 * of_space_;
        settings_ = tightened(settings_, run_->latest_error(), allowed, count_++, space_is_stuck);
        of_space_ = of_space;
        return true;
    }

    std::string fixed_by() const override {
        const Discretisation& d = case_.discretisation;
        return d.elements || d.time_tolerance ? "discretisation.elements or time_tolerance are given" : "";
    }

    const RunSummary& summary() const { return run_->summary; }

private:
    const Case& case_;
    RunObserver& watch_;
    const RunClock& clock_;
    const Record* restart_;  // until the run goes on from it
    GraphSettings settings_;
    int count_ = 1;
    double of_space_ = std::numeric_limits<double>::infinity();  // error of the attempt before the last
    std::optional<GraphAttempt> run_;  // the last one
};

}  // namespace

RunSummary run_graph(const Case& c, RunObserver& observer, const Record* restart) {
    const RunClock clock(c, observer);
    return clock.pausing([&] {
        GraphRuns runs(c, observer, clock, restart);
        drive(c, observer, clock, runs);
        return runs.summary();
    });
}

}  // namespace tubule::axisym
