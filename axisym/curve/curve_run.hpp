// A case of tier "axisym" whose profile is a curve (r(s), z(s)): every model, closed cells, and tubes that overhang.
#pragma once

#include <string>
#include <vector>

#include "axisym/run.hpp"

namespace tubule::axisym {

std::vector<std::string> curve_series_names(const Case& c);

// As run(). The case is computed twice, with fewer elements and a wider tolerance first: the stated error is how far
// the two energies are apart at the times of the steps. If that is more than asked, the finer one becomes the coarser
// one of the next pair.
RunSummary run_curve(const Case& c, RunObserver& observer, const Record* restart = nullptr);

}  // namespace tubule::axisym
