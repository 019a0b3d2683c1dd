// A case of tier "auto": axisymmetric while that is adequate, in three dimensions where it is not.
#pragma once

#include "common/case/problem.hpp"
#include "common/result/record.hpp"
#include "common/run/run_observer.hpp"
#include "tools/auto/choice.hpp"

namespace tubule {

// `choice` is that for the case. An axisymmetric start is run in tier axisym, with the growth rates of modes m > 0
// at many times. Where the noise of the case grows to auto.largest by them, the run is made again until then, and
// continues in tier surface3d with these modes on the profile. `unfinished` is the file that `restart` belongs to. What
// was chosen, and why, is in the details of the summary ("choice", "reason", ...) and goes to note().
RunSummary run_auto(const Problem& c, const Choice& choice, RunObserver& file, const Restart* restart,
                    const Result* unfinished);

}  // namespace tubule
