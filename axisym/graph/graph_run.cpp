#include "axisym/graph/graph_run.hpp"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "axisym/graph/graph_simulation.hpp"
#include "common/run/driver.hpp"
#include "common/run/loop.hpp"

namespace tubule::axisym {
namespace {

constexpr int most_attempts = 6;

class GraphRuns : public EstimatedRuns {
public:
    GraphRuns(const Problem& c, RunObserver& watch, const RunClock& clock, const Record* restart)
        : case_(c),
          watch_(watch),
          clock_(clock),
          restart_(restart),
          settings_(first_graph_settings(c, c.time.integrator == Integrator::rosenbrock)) {
        if (!restart) return;
        const GraphRestart begun = graph_restart(*restart);
        settings_ = first_graph_settings(c, begun.rosenbrock);
        settings_.time_tolerance = begun.time_tolerance;
        settings_.mesh_loss = begun.mesh_loss / begun.reference_energy;
        count_ = begun.attempts;
        if (c.time.integrator == Integrator::rosenbrock && !begun.rosenbrock)
            fallback_ = "IDA has integrated the run: time.integrator = \"rosenbrock\" failed before it was interrupted";
    }

    RunSummary& next() override {
        settings_.may_give_up = --left_ > 0;
        const Record* restart = std::exchange(restart_, nullptr);
        if (restart)
            run_.emplace(case_, clock_, settings_, *restart);
        else
            run_.emplace(case_, clock_, settings_);
        run_->summary.attempts = count_;
        Loop(*run_, case_, watch_, clock_).go_from(restart);
        if (!fallback_.empty()) run_->summary.warnings.push_back(fallback_);
        return run_->summary;
    }

    bool refine(const RunSummary& last) override {
        if (!run_->gave_up) return fall_back_on_ida(last);
        const double allowed = case_.accuracy.energy * last.reference_energy / stated_over_computed;
        settings_ = tightened(settings_, run_->latest_error(), allowed, count_++);
        return true;
    }

    std::string fixed_by() const override {
        const Discretisation& d = case_.discretisation;
        return d.elements || d.time_tolerance ? "discretisation.elements or time_tolerance are given" : "";
    }

private:
    // Where H is zero an energy of powers of H alone has no stiffness. What appears there within a step, the linearised
    // flow of a Rosenbrock method does not see; Newton's method does.
    bool fall_back_on_ida(const RunSummary& last) {
        const bool lost = last.stop.reason == Stop::resolution_lost || last.stop.reason == Stop::solver_failed;
        if (!settings_.rosenbrock || !lost) return false;
        fallback_ = fmt::format("IDA has integrated the run: time.integrator = \"rosenbrock\" failed at t = {:.4g}, {}",
                                last.stop.time, last.stop.message);
        settings_ = first_graph_settings(case_, false);
        left_ = most_attempts, ++count_;
        return true;
    }

    const Problem& case_;
    RunObserver& watch_;
    const RunClock& clock_;
    const Record* restart_;  // until a run has resumed from it
    GraphSettings settings_;
    std::string fallback_;  // why IDA integrates what Rosenbrock's method should have
    int count_ = 1, left_ = most_attempts;
    std::optional<GraphSimulation> run_;  // the last one
};

}  // namespace

RunSummary run_graph(const Problem& c, RunObserver& observer, const Record* restart) {
    return drive_runs<GraphRuns>(c, observer, restart);
}

}  // namespace tubule::axisym
