// Why a run of a curve ends early.
#pragma once

#include <optional>
#include <span>

#include "axisym/curve/curve_snapshot.hpp"
#include "common/solve/stop.hpp"

namespace tubule::axisym {

// A value that is positive while the run may continue, and the report for when it is not.
struct CurveGuard {
    double (*value)(const Snapshot& s, double r_min);
    StopReport (*report)(const Snapshot& s, double time);
};
std::span<const CurveGuard> curve_guards();

// Checked at intervals: a profile that intersects itself or the axis, elements too long for its curvature.
std::optional<StopReport> find_bad_profile(const CurveSpace& space, const Eigen::VectorXd& x, const Snapshot& s,
                                           double time);

}  // namespace tubule::axisym
