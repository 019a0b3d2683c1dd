// Whether a simpler model shows what a case with inertia or viscosity does, as far as its own path tells, and the
// choice of model.kind = "auto": docs/choosing.md.
#pragma once

#include <string>
#include <vector>

#include "common/case/case.hpp"

namespace tubule {

// A model with fewer terms instead of that of a case, its path being the energy over time.
struct SimplerModel {
    ModelKind kind = ModelKind::overdamped;
    // Expected differences from the path of the case, the largest and that at the end, relative to E_ref: in
    // docs/model_differences.csv 0.9 to 6.6 times the measured ones.
    double on_the_way = 0, at_end = 0;
    double seconds = 0;  // that its trial run took: in tier axisym what it takes
    bool rests = false;  // nothing moves
};
struct SimplerModels {
    std::vector<SimplerModel> models;
    std::string unknown;  // why there are none, in words
};

// By trial runs of these models: of an axisymmetric start in tier axisym, while no mode m > 0 grows if the
// case has another tier, else on 80 triangles. Nothing is known where a velocity is given, loads or a reservoir act, a
// start brings its own triangles, or a trial run does not come to its end. Where nothing moves the simplest is the only
// one. Throws as an engine and its run; Paused where a PauseWatch of this thread ends a trial run.
SimplerModels simpler_models(const Case& c);

struct ModelChoice {
    ModelKind kind;
    std::string reason;    // in words
    bool unknown = false;  // whether a simpler model does
    double seconds = 0;    // of a simpler model, that its trial run took
};

// The simplest model whose expected difference is at most accuracy.energy, else that of the case; "auto" counts as a
// fluid. The same each time, unless a trial run takes more than 20 s of a processor. Throws as simpler_models().
ModelChoice choose_model(const Case& c);

// The case itself or, of model.kind = "auto", with the model of that choice instead, which from then on stands among
// its overrides as model.chosen. Throws CaseError.
struct ChosenCase {
    Case c;
    std::string reason;  // empty where nothing was to be chosen
    double seconds = 0;  // of wall time, that the choice took: they count for time.limit
};
ChosenCase with_model(const Case& c, const ModelChoice& choice);
// Throws Paused, too, where time.limit passes or a signal comes.
ChosenCase with_chosen_model(const Case& c);

// "model overdamped: ...", with the reason of a choice.
std::string words_of_choice(const ChosenCase& chosen);

}  // namespace tubule
