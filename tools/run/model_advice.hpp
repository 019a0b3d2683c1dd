// Whether a simpler model shows what a case with inertia or viscosity does, as far as its own path tells.
#pragma once

#include <vector>

#include "common/case/case.hpp"

namespace tubule {

// A model with fewer terms instead of that of a case, its path being the energy over time.
struct SimplerModel {
    ModelKind kind = ModelKind::overdamped;
    // Expected differences from the path of the case, the largest and that at the end, relative to E_ref: in
    // docs/model_differences.csv 0.9 to 6.6 times the measured ones.
    double on_the_way = 0, at_end = 0;
    double seconds = 0;  // that it takes in tier axisym
};

// Of an axisymmetric start, by runs of these models in tier axisym, of a second each at most; the overdamped one until
// time.end/gamma. None where that cannot be told: of other models, where a velocity is given, loads or a
// reservoir act, or where a run does not come to its end in time.
std::vector<SimplerModel> simpler_models(const Case& c);

}  // namespace tubule
