// Why a run of a curve ends before its time.
#pragma once

#include <optional>
#include <span>

#include "axisym/curve/curve_snapshot.hpp"
#include "common/solve/stop.hpp"

namespace tubule::axisym {

// Positive while all is well; what to report once it is not.
struct CurveGuard {
    double (*value)(const Snapshot& s, double r_min);
    StopReport (*report)(const Snapshot& s, double time);
};
std::span<const CurveGuard> curve_guards();

// Looked for now and then: a profile that meets itself or the axis, elements that its curvature is too much for.
std::optional<StopReport> find_bad_profile(const CurveSpace& space, const Eigen::VectorXd& x, const Snapshot& s,
                                           double time);

// Steps that lead nowhere: IDA may go on with them for ever.
class CurveStall {
public:
    std::optional<StopReport> after_step(double time, double step, double end);

private:
    double since_ = 0;
    int steps_ = 0;
};

}  // namespace tubule::axisym
