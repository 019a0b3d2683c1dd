// A case of tier "auto": axisymmetric while that is adequate, in three dimensions where it is not.
#pragma once

#include <optional>
#include <string>

#include "common/case/problem.hpp"
#include "common/run/run_observer.hpp"
#include "surface3d/run/run_surface.hpp"
#include "surface3d/run/start.hpp"

namespace tubule {

struct Choice {
    bool axisymmetric = true;
    std::string reason;                     // in words
    std::optional<surface3d::Start> start;  // of a run in three dimensions
};

// By the start alone: all models are axisymmetric, and so are all velocities to start with. Throws CaseError where a
// result that the case starts from cannot be read, or a start in three dimensions cannot be meshed.
Choice choice_for(const Problem& c);

// Whether 80 triangles are enough, fewer than runs begin with: a smooth start, little accuracy, and no mesh of its own
// or by the case.
bool few_triangles_do(const Problem& c, const surface3d::Start& start);

// `choice` is that for the case. An axisymmetric start is run in tier axisym, with the growth rates of modes m > 0
// at many times. Where the noise of the case grows to auto.largest by them, the run is made again until then, and
// continues in tier surface3d with these modes on the profile. `unfinished` is the file that `restart` belongs to. What
// was chosen, and why, is in the details of the summary ("choice", "reason", ...) and goes to note().
RunSummary run_auto(const Problem& c, const Choice& choice, RunObserver& file, const Restart* restart,
                    const Result* unfinished);

}  // namespace tubule
