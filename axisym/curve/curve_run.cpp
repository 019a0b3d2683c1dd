#include "axisym/curve/curve_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "axisym/curve/coarser_curve.hpp"
#include "common/run/driver.hpp"

namespace tubule::axisym {
namespace {

constexpr int most_failures = 2;        // pairs of runs that fail, after which nothing else is tried
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

// Whether the flow may have been ill-posed unnoticed: the least symbols of the two runs of a pair differ by at least
// half of that of the finer one. A symbol that cannot change its sign may come arbitrarily close to 0.
bool may_be_ill_posed(const Bending& energy, double coarse, double fine) {
    return symbol_may_vanish(energy) && fine < 2 * std::abs(coarse - fine);
}

// Errors estimated by pairs of runs: that of the finer one, which is reported, from the energies of a coarser one.
// Where it exceeds the tolerance, the finer run becomes the coarser one of the next pair.
class CurveRuns : public EstimatedRuns {
public:
    CurveRuns(const Problem& c, RunObserver& watch, const RunClock& clock, const Record* restart)
        : case_(c),
          watch_(watch),
          clock_(clock),
          restart_(restart),
          start_(initial_shape(c)),
          settings_(restart ? curve_restart(*restart).settings
                            : settings_for(c, start_, first_settings(c, start_.meridian.images()))) {}

    RunSummary& next() override {
        const Record* restart = std::exchange(restart_, nullptr);
        if (restart)
            coarser_ = std::make_unique<CoarserCurve>(case_, start_, clock_, *restart);
        else if (!coarser_)
            coarser_ = std::make_unique<CoarserCurve>(case_, start_, clock_, coarser(settings_));
        run_ = std::make_unique<CurveSimulation>(case_, start_, settings_, coarser_.get());
        if (restart)
            run_->resume(*restart);
        else
            run_->begin();
        loop_of(*run_, case_, watch_, clock_).go_from(restart, start_.note);
        // Only ends that are alike can be compared.
        if (!can_go_on(run_->summary.stop.reason)) coarser_->lead_to(HUGE_VAL);
        judge();
        return run_->summary;
    }

    bool refine(const RunSummary& last) override {
        const bool good = last.as_accurate_as_asked && !failed(last.stop);
        if (good || case_.profile_resolution_given() || !can_be_finer(settings_)) return false;
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
        coarser_ = std::make_unique<CoarserCurve>(case_, std::move(run_));
        return true;
    }

    std::string fixed_by() const override {
        return case_.profile_resolution_given() ? "discretisation.elements or time_tolerance are given" : "";
    }

private:
    // The stated error.
    void judge() {
        RunSummary& s = run_->summary;
        const StopReport other = coarser_->stop().value_or(StopReport{s.stop.reason, s.stop.time, "", ""});
        s.estimated_error = s.reference_energy > 0 ? run_->error / s.reference_energy : 1;
        const auto unknown = [&](const std::string& why) {
            s.warnings.push_back(why + ": the error is unknown");
            s.estimated_error = 1;
        };
        if (can_go_on(other.reason) && !can_go_on(s.stop.reason)) {  // --resume lets the coarser run continue
            s.stop = {other.reason, s.stop.time, other.message + ", before the coarser run had ended", other.advice};
            s.estimated_error = 1;
        } else if (settings_.pair == 1 && coarser(settings_).elements == settings_.elements)
            unknown("too few elements for a coarser run to compare with");
        else if (!comparable(other, s.stop, case_.time.end))
            unknown(
                fmt::format("the coarser run of the pair ended at t = {:.6g} with {}", other.time, name(other.reason)));
        else if (kind_of(s.stop.reason).exit_code == 0 &&
                 may_be_ill_posed(case_.energy, coarser_->least_symbol(), run_->least_symbol))
            unknown(
                fmt::format("the principal symbol fell to {:.2g}, in the coarser run of the pair to {:.2g}: the "
                            "flow may be ill-posed",
                            run_->least_symbol, coarser_->least_symbol()));
    }

    // Not where breaks are at jumps of curvature or of H0, nor where small elements make the waves of a fluid shorter.
    bool may_be_graded() const {
        return start_.meridian.seams.empty() && !case_.energy.H0_varies() && case_.law.inertia == 0;
    }

    const Problem& case_;
    RunObserver& watch_;
    const RunClock& clock_;
    const Record* restart_;  // until the run resumes from it
    const InitialShape start_;
    CurveSettings settings_;  // of the run to be reported
    int failures_ = 0;        // of pairs
    std::unique_ptr<CoarserCurve> coarser_;
    std::unique_ptr<CurveSimulation> run_;  // the last one
};

}  // namespace

RunSummary run_curve(const Problem& c, RunObserver& observer, const Record* restart) {
    return drive_runs<CurveRuns>(c, observer, restart);
}

}  // namespace tubule::axisym
