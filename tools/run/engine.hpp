// Runs a case: the one place that chooses its tier.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/case/problem.hpp"
#include "common/run/forecast.hpp"
#include "common/run/run.hpp"
#include "surface3d/run/run.hpp"

namespace tubule {

// A case, checked and with its start prepared: what it starts from is read once.
class Engine {
public:
    explicit Engine(Problem c) : case_(std::move(c)) {}
    virtual ~Engine() = default;

    // Names of the series that a run writes, "time" first.
    virtual std::vector<std::string> series_names() const = 0;

    // Throws std::runtime_error where a run cannot resume from this record, such as one of another version.
    virtual void check_restart(const Record& record) const = 0;

    // What a run will take that takes more than a minute; nothing of others, or where that cannot be told at little
    // cost.
    virtual std::optional<Forecast> forecast_if_long() const { return std::nullopt; }

    // What is to be said before it runs; empty if nothing.
    virtual std::string warning() const { return {}; }

    // Runs the case, or resumes from `restart`, of the file `unfinished` (which tier "auto" needs). Throws as the
    // tier's own run.
    virtual RunSummary run(RunObserver& observer, const Restart* restart = nullptr,
                           const Result* unfinished = nullptr) const = 0;

protected:
    const Problem case_;
};

// Throws CaseError where the shape of the case cannot be meshed, or the result that it starts from cannot be read.
std::unique_ptr<const Engine> engine_for(const Problem& c);

}  // namespace tubule
