// Runs a case: the one place that chooses its tier.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/case/problem.hpp"
#include "common/result/record.hpp"
#include "common/run/run_observer.hpp"
#include "tools/auto/choice.hpp"

namespace tubule {

// A case, checked and with its start prepared: what it starts from is read once.
class Engine {
public:
    // Throws CaseError where the shape of the case cannot be meshed, or the result that it starts from cannot be read.
    explicit Engine(Problem c);
    // For a surface whose initial shape is read and ready.
    Engine(Problem c, surface3d::Start start) : case_(std::move(c)), choice_{false, "", std::move(start)} {}

    const Problem& problem() const { return case_; }
    // That of a surface, if the case has one; nothing for profiles.
    const std::optional<surface3d::Start>& start() const { return choice_.start; }

    // Names of the series that a run writes, "time" first.
    std::vector<std::string> series_names() const;

    // Throws std::runtime_error where a run cannot resume from this record, such as one of another version.
    void check_restart(const Record& record) const;

    // What is to be said before it runs; empty if nothing.
    std::string warning() const { return start() ? start()->time_scale() : ""; }

    // Runs the case, or resumes from `restart`, of the file `unfinished` (which tier "auto" needs). Throws as the
    // tier's own run.
    RunSummary run(RunObserver& observer, const Restart* restart = nullptr, const Result* unfinished = nullptr) const;

private:
    Problem case_;
    Choice choice_;
};

}  // namespace tubule
