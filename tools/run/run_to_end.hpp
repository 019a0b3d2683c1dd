// A run of a case to its end, which a failure is, too: an exception becomes a summary, in the words of the case.
#pragma once

#include <exception>
#include <optional>

#include "tools/run/engine.hpp"

namespace tubule {

struct Ended {
    RunSummary summary;
    bool failed = false;            // by an exception
    std::optional<double> reached;  // the time of the last row; none if there was none
};

// Runs the case as Engine::run() does. The observer gets a note where frames take much, and the summary warns where
// the balance of the energy is off. Throws Paused, errors of the disk, and bad input that is found before there is a
// row.
Ended run_to_end(const Engine& engine, RunObserver& observer, const Restart* restart = nullptr,
                 const Result* unfinished = nullptr);

// `reached`: the time of the last row; nothing if the run failed before its first.
StopReport failure_of(const Problem& c, const std::exception& error, std::optional<double> reached);

}  // namespace tubule
