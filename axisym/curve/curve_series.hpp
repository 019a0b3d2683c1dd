// The series of a run of a curve, a row each step.
#pragma once

#include <string>
#include <vector>

#include "axisym/curve/curve_snapshot.hpp"
#include "axisym/integration/flow.hpp"
#include "common/case/case.hpp"

namespace tubule::axisym {

// What a row has beside what is measured of the curve.
struct CurveRow {
    double time;
    const Snapshot& now;
    const double* y;
    const Flow& flow;
    double identity_defect, energy_error;
    int elements;
    double wall_seconds;
};

std::vector<std::string> curve_series_names(const Case& c);
std::vector<double> curve_values(const Case& c, const CurveMotion& motion, const CurveRow& row);

}  // namespace tubule::axisym
