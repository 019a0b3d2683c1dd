// Whether a simpler model shows what a case with inertia or viscosity does, as far as its own path tells: the choice of
// model.kind = "auto".
#pragma once

#include <string>

#include "common/case/problem.hpp"

namespace tubule {

struct ModelChoice {
    ModelKind kind;
    std::string reason;    // in words
    bool unknown = false;  // whether a simpler model does
    double seconds = 0;    // of a simpler model, that its trial run took
};

// The simplest model whose expected difference is at most accuracy.energy, else that of the case; "auto" counts as a
// fluid. By trial runs, and the same each time, unless one takes more than 20 s of a processor. Throws as an engine and
// its run; Paused where a PauseWatch of this thread ends a trial run.
ModelChoice choose_model(const Problem& c);

// The case itself or, of model.kind = "auto", with the model of that choice instead, which from then on stands among
// its overrides as model.chosen. Throws CaseError.
struct ChosenCase {
    Problem c;
    std::string reason;  // empty where nothing was to be chosen
    double seconds = 0;  // of wall time, that the choice took: they count for time.limit
};
ChosenCase with_model(const Problem& c, const ModelChoice& choice);
// Throws Paused, too, where time.limit passes or a signal comes.
ChosenCase with_chosen_model(const Problem& c);

// "model overdamped: ...", with the reason of a choice.
std::string words_of_choice(const ChosenCase& chosen);

}  // namespace tubule
