// A case of tier "axisym" whose profile is a curve (r(s), z(s)): every model, closed cells, and tubes that overhang.
#pragma once

#include "axisym/curve/curve_output.hpp"
#include "common/run/run_observer.hpp"

namespace tubule::axisym {

// As run_profile(). Each run is compared with a coarser one (coarser_curve.hpp), which has fewer elements and a wider
// tolerance. The stated error is how far the two energies are apart at the times of the steps.
RunSummary run_curve(const Problem& c, RunObserver& observer, const Record* restart = nullptr);

}  // namespace tubule::axisym
