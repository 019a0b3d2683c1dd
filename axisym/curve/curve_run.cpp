#include "axisym/curve/curve_run.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "axisym/curve/curve_simulation.hpp"
#include "common/run/loop.hpp"
#include "common/run/stall.hpp"

namespace tubule::axisym {
namespace {

constexpr int most_failures = 2;    // pairs of runs that fail, after which nothing else is tried
constexpr int most_stalled = 2000;  // steps, shorter than this part of the end
constexpr double tiny_step = 1e-9;
constexpr double share_of_mesh = 1e-4;  // of the error allowed: what any state may lose to the mesh
constexpr double too_early = 1e-6;      // of time.end: runs that fail so soon say nothing of each other's error

bool failed(const StopReport& stop) {
    return exit_code(stop.reason) == exit_code(Stop::solver_failed);
}

// Whether the energies of two runs of a pair can be compared.
bool comparable(const StopReport& coarse, const StopReport& fine, double end) {
    if (can_go_on(fine.reason)) return true;
    if (coarse.time == 0 && fine.time == 0 && !failed(fine)) return true;  // the initial shape, whose energy is exact
    return coarse.reason == fine.reason && std::min(coarse.time, fine.time) > too_early * end;
}

// Whether a flow may have been ill-posed without being seen to be: the two runs of a pair are at least half as far
// apart as the finer one is from that. A symbol that cannot change its sign may come as close to 0 as it likes.
bool may_be_ill_posed(const Bending& energy, double coarse, double fine) {
    return symbol_may_vanish(energy) && fine < 2 * std::abs(coarse - fine);
}

class CurveRuns : public PairedRuns {
public:
    CurveRuns(const Case& c, RunObserver& watch, const RunClock& clock, const Record* restart)
        : case_(c),
          watch_(watch),
          clock_(clock),
          restart_(restart),
          start_(beginning_of(c)),
          settings_(settings_for(c, start_, first_settings(c, start_.images()))) {
        if (!restart) return;
        begun_ = curve_restart(*restart).settings;
        if (!begun_->is_coarser) settings_ = *begun_;
    }

    void show_start() override {
        make(settings_, nullptr).begin();
        loop().begin(start_.note);
    }
    RunSummary& run_coarser() override { return run(coarser(settings_), nullptr); }
    RunSummary& run_reported(const EndedRun& coarser) override { return run(settings_, &coarser); }
    EndedRun ended() override { return {run_->trace, run_->summary.stop, run_->least_symbol}; }

    double error(const EndedRun& other) override {
        RunSummary& s = run_->summary;
        if (settings_.pair == 1 && coarser(settings_).elements == settings_.elements)
            s.warnings.emplace_back("too few elements for a coarser run to compare with: the error is unknown");
        else if (!comparable(other.stop, s.stop, case_.time.end))
            s.warnings.push_back(
                fmt::format("the coarser run of the pair ended at t = {:.6g} with {}: the error is unknown",
                            other.stop.time, name(other.stop.reason)));
        else if (kind_of(s.stop.reason).exit_code == 0 &&
                 may_be_ill_posed(case_.energy, other.least_symbol, run_->least_symbol))
            s.warnings.push_back(fmt::format(
                "the principal symbol fell to {:.2g}, in the coarser run of the pair to {:.2g}: the flow may be "
                "ill-posed, and the error is unknown",
                run_->least_symbol, other.least_symbol));
        else
            return run_->error;
        return s.reference_energy;
    }

    bool refine(const RunSummary& last) override {
        const bool good = last.as_accurate_as_asked && !failed(last.stop);
        if (good || settings_given(case_) || !can_be_finer(settings_)) return false;
        const bool cheap = last.stop.time == 0;  // a failure at the beginning, where finer meshes may do
        if (failed(last.stop) && !cheap && ++failures_ > most_failures) return false;
        const double excess = last.error_is_known() ? last.estimated_error / case_.accuracy.energy : 1;
        if (may_be_graded() && !failed(last.stop)) {
            const double excess_of_mesh =
                run_->mesh_need.lost / (share_of_mesh * case_.accuracy.energy * last.reference_energy);
            settings_ = finer(settings_, mesh_growth(excess_of_mesh, excess < 0.5 * settings_.excess));
            if (excess_of_mesh > 1) settings_.density = run_->mesh_need.density();
        } else
            settings_ = finer(settings_, mesh_growth(excess));
        settings_.excess = last.error_is_known() ? excess : CurveSettings{}.excess;
        return true;
    }

    std::string fixed_by() const override {
        return settings_given(case_) ? "discretisation.elements or time_tolerance are given" : "";
    }

private:
    CurveSimulation& make(const CurveSettings& settings, const EndedRun* coarser) {
        return run_.emplace(case_, start_, settings, coarser);
    }

    Loop loop() {
        Loop out(*run_, case_, watch_, clock_, run_->is_reported());
        out.add(std::make_unique<Stall>(most_stalled, tiny_step * case_.time.end, case_.accuracy.energy,
                                        "try another accuracy, discretisation.elements or parametrisation"));
        return out;
    }

    // Not where breaks are at jumps of curvature or of H0, nor where small elements make the waves of a fluid shorter.
    bool may_be_graded() const {
        return start_.meridian.seams.empty() && !case_.energy.H0_varies() && motion_law(case_.model).inertia == 0;
    }

    // Resumes the interrupted run if that had the same role in its pair.
    RunSummary& run(const CurveSettings& settings, const EndedRun* coarser) {
        make(settings, coarser);
        Loop steps = loop();
        if (restart_ && begun_->is_coarser == settings.is_coarser) {
            run_->resume(*restart_);
            steps.resume(*std::exchange(restart_, nullptr));
        } else {
            run_->begin();
            steps.begin(start_.note);
        }
        steps.go();
        return run_->summary;
    }

    const Case& case_;
    RunObserver& watch_;
    const RunClock& clock_;
    const Record* restart_;  // until the run resumes from it
    const Beginning start_;
    std::optional<CurveSettings> begun_;  // of the run that was interrupted
    CurveSettings settings_;              // of the run to be reported
    int failures_ = 0;                    // of pairs
    std::optional<CurveSimulation> run_;  // the last one
};

}  // namespace

RunSummary run_curve(const Case& c, RunObserver& observer, const Record* restart) {
    const RunClock clock(c, observer);
    return clock.pausing([&] {
        CurveRuns runs(c, observer, clock, restart);
        RunPairs pairs(runs, c, observer, 0, restart);
        return drive(c, observer, clock, pairs);
    });
}

}  // namespace tubule::axisym
