// The rows and frames of both tiers in one result file: docs/results.md, "Both tiers in one file".
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/case/problem.hpp"
#include "common/run/run_observer.hpp"

namespace tubule {

// Names of the series, "time" first. Of a run that begins axisymmetric: those that both tiers have, momenta that vanish
// by symmetry, and `tier`, 1 or 2. One that begins in three dimensions has all of that tier, and `tier`.
std::vector<std::string> joined_series_names(const Problem& c, bool begins_axisymmetric);

// A tier's rows as those of the file.
class RowMap {
public:
    // The tier: 1 or 2.
    RowMap(const std::vector<std::string>& file, const std::vector<std::string>& own, int tier);
    std::vector<double> operator()(std::span<const double> row) const;

private:
    std::vector<int> source_;  // of each column, or one of these:
    static constexpr int zero = -1, tier_number = -2;
    int tier_;
};

// What the file holds before a run in three dimensions goes on with it.
struct Before {
    std::vector<std::vector<double>> rows;
    std::vector<Record> frames;
};

// The axisymmetric part of an unfinished file.
Before axisymmetric_part(const Result& unfinished);

// A run in one tier, as a part of the file.
class TierPart : public PassingOn {
public:
    TierPart(RunObserver& file, RowMap map) : PassingOn(file), map_(std::move(map)) {}
    void row(std::span<const double> values) override { PassingOn::row(map_(values)); }
    void note(const std::string&) override {}  // notes are of the whole run

protected:
    RowMap map_;
};

// A run in three dimensions, the second part or all of the file: where it begins again, the first part stays.
class SurfacePart : public TierPart {
public:
    SurfacePart(RunObserver& file, RowMap map, const Before& before) : TierPart(file, map), before_(before) {}
    void discard() override;

private:
    const Before& before_;
};

}  // namespace tubule
