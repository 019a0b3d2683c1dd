// The coarser run of a pair. It leads the run that is compared with it; or it is the reported run of the pair before,
// which has ended.
#pragma once

#include <memory>
#include <optional>

#include "axisym/curve/curve_simulation.hpp"
#include "common/run/loop.hpp"

namespace tubule::axisym {

class CoarserCurve {
public:
    // References must outlive it. A new run; one that was saved (throws as RecordReader); one that has ended.
    CoarserCurve(const Problem& c, const InitialShape& start, const RunClock& clock, const CurveSettings& settings);
    CoarserCurve(const Problem& c, const InitialShape& start, const RunClock& clock, const Record& record);
    CoarserCurve(const Problem& c, std::unique_ptr<CurveSimulation> ended);
    static void check_restart(const Record& record);
    void save(Record& record) const;

    // Until its time is at least this, or it ends.
    void lead_to(double t);

    // The error of a run of this trace and these settings, whose free energy at the time t is this, by the difference.
    std::optional<double> error_of(const EnergyTrace& trace, const CurveSettings& settings, double t,
                                   double energy) const;
    double least_symbol() const { return run_->least_symbol; }
    std::optional<StopReport> stop() const { return loop_ ? loop_->stop() : run_->summary.stop; }

private:
    double share(const EnergyTrace& trace, const CurveSettings& settings, double t) const;

    const Problem& case_;
    std::unique_ptr<CurveSimulation> run_;
    std::optional<Loop> loop_;  // none: the run has ended before this pair
};

}  // namespace tubule::axisym
