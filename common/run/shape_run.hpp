// Runs that look for stationary shapes, in either tier: a row and a frame for the shape, or for each of a branch.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/equilibrium/continuation.hpp"
#include "common/run/energy_checks.hpp"
#include "common/run/run_clock.hpp"
#include "common/series/table.hpp"

namespace tubule {

// The table [equilibrium] of a case, resolved for its initial shape.
template <class Shape, class Settings>
struct ShapeTask {
    StationaryProblem problem;
    Settings settings;
    SetParameter set;  // of a branch
    BranchSettings<Shape, Settings> branch;

    // From the problem and the settings. Throws as branch_outputs().
    void resolve_branch(const Problem& c) {
        const BranchChoices& b = c.equilibrium->branch;
        if (!b.parameter) return;
        set = setter(*b.parameter);
        branch.shapes = settings;
        branch.output = branch_outputs(c, problem);
        branch.from = branch.output.front(), branch.to = branch.output.back();
        branch.branches = b.branches;
        branch.mode = b.mode.value_or(0), branch.amplitude = b.amplitude.value_or(branch.amplitude);
    }
};

// What the values of a row come from.
template <class Shape>
struct ShapeRow {
    int number;
    const BranchPoint<Shape>& point;
    StationaryProblem problem;  // with the parameter of the point
    double energy;
    Extents extents;
    int elements;
    double wall_seconds;
};

// The columns that rows of both tiers begin with, up to the energy; that follow the energy's parts; that they end with.
template <class Row>
void add_first_columns(SeriesTable<Row>& table, const BranchChoices& branch) {
    table.add({{"time", [](const Row& r) { return static_cast<double>(r.number); }}});
    if (branch.parameter)
        table.add({{"parameter", [](const Row& r) { return r.point.parameter; }},
                   {"special", [](const Row& r) { return static_cast<double>(r.point.kind); }}});
    if (branch.branches) table.add({{"branch", [](const Row& r) { return static_cast<double>(r.point.branch); }}});
    table.add({{"energy", [](const Row& r) { return r.energy; }}});
}
template <class Row>
void add_extents(SeriesTable<Row>& table) {
    table.add({{"free_energy",
                [](const Row& r) {
                    const auto [area, volume, length] = r.extents;
                    return r.energy + r.problem.loads.energy(area, volume, length);
                }},
               {"area", [](const Row& r) { return r.extents.area; }},
               {"volume", [](const Row& r) { return r.extents.volume; }},
               {"reduced_volume", [](const Row& r) { return reduced_volume(r.extents.area, r.extents.volume); }},
               {"tension", [](const Row& r) { return r.point.shape.sigma; }},
               {"pressure", [](const Row& r) { return -r.point.shape.lambda; }}});
}
template <class Row>
void add_last_columns(SeriesTable<Row>& table) {
    table.add(
        {{"energy_error", [](const Row& r) { return r.point.shape.estimated_error * r.point.shape.reference_energy; }},
         {"elements", [](const Row& r) { return static_cast<double>(r.elements); }},
         {"wall_seconds", [](const Row& r) { return r.wall_seconds; }}});
}

// The shapes that a run has found.
template <class Shape>
struct FoundShapes {
    int count = 0, iterations = 0;
    double worst = 0;  // estimated error
    Shape last{};
};

// Finds the shape, or those of the branch, gives each to `write` and says how it ended; adds what to warn of.
template <class Tier, class Write>
StopReport find_shapes(Tier& tier, const Write& write, std::vector<std::string>& warnings) {
    using Shape = typename Tier::Shape;
    const auto& task = tier.task();
    BranchPoint<Shape> first;
    first.shape = tier.find();
    const Stop stop = first.shape.stop;
    if (stop != Stop::finished || !task.set) {
        first.parameter = task.branch.from;
        first.index = stop == Stop::finished ? tier.negative_directions(first.shape) : -1;
        write(first);
        return {stop, 0, stop == Stop::finished ? "the shape is stationary" : first.shape.message, tier.advice(stop)};
    }
    auto settings = task.branch;
    settings.found = [&](const BranchPoint<Shape>& point) {
        write(point);
        pause_if_due();
    };
    Branch<Shape> branch = follow_branches(task.problem, first.shape, task.set, settings,
                                           [](const auto&... of) { return follow_branch(of...); });
    warnings = std::move(branch.warnings);
    return {branch.stop, 0, branch.message, tier.advice(branch.stop)};
}

// Hands over the shape, or those of the branch, as they are found, and sums up. `Tier` offers
//   Shape, task()                the latter a ShapeTask
//   find()                       the first shape
//   negative_directions(shape)   of one that was found
//   energy(shape), extents(problem, shape), elements(shape)
//   write(row, observer)         its row and its frame
//   advice(stop)                 what to try, or empty
//   describe(found, summary)     sets effort and details, and adds what else to warn of
// and follow_branch() goes with its Shape. Throws Paused where no shape was found before.
template <class Tier>
RunSummary run_shapes(const Problem& c, Tier& tier, const RunClock& clock, RunObserver& observer) {
    using Shape = typename Tier::Shape;
    FoundShapes<Shape> found;
    const auto write = [&](const BranchPoint<Shape>& point) {
        const Shape& shape = point.shape;
        StationaryProblem problem = tier.task().problem;
        if (tier.task().set) tier.task().set(problem, point.parameter);
        const Extents extents = tier.extents(problem, shape);
        const double energy = tier.energy(shape);
        if (!(extents.area > 0 && std::isfinite(energy))) return;
        tier.write({found.count, point, std::move(problem), energy, extents, tier.elements(shape), clock.seconds()},
                   observer);
        observer.progress(point.parameter, energy, 0);
        found.worst = std::max(found.worst, shape.estimated_error), found.iterations += shape.iterations;
        found.last = shape;
        ++found.count;
    };
    RunSummary s;
    try {
        s.stop = find_shapes(tier, write, s.warnings);
    } catch (const Paused& pause) {
        if (found.count == 0) throw;
        s.stop = pause_report(pause, 0);
        s.stop.message += " before all shapes were found";
        s.stop.advice = "run the case again: equilibria are not resumed";
    }
    s.stop.time = std::max(found.count - 1, 0);
    if (std::string endless = unbounded_below(c.energy); !endless.empty()) s.warnings.push_back(std::move(endless));
    s.energy = tier.energy(found.last), s.reference_energy = found.last.reference_energy;
    s.elements = found.count > 0 ? tier.elements(found.last) : 0;
    s.estimated_error = found.count > 0 ? std::min(found.worst, 1.0) : 1;
    s.as_accurate_as_asked = s.estimated_error <= c.accuracy.energy;
    s.details = {{"shapes", std::int64_t{found.count}}, {"elements", std::int64_t{s.elements}}};
    tier.describe(found, s);
    return s;
}

}  // namespace tubule
