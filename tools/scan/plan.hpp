// Which points a scan runs, and in what order: all of them, or those along the lines between outcomes.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "tools/scan/outcome.hpp"

namespace tubule {

// How many values each axis of a grid has. Points are numbered row by row, the last axis fastest.
using GridShape = std::vector<std::size_t>;
std::size_t count_points(const GridShape& shape);
// From a point to the next one, along each axis; and where it is on each.
std::vector<std::size_t> strides(const GridShape& shape);
std::vector<std::size_t> place_on(const GridShape& shape, std::size_t point);

// ---- points between those of the grid, where a line is traced more finely than by the grid

// On the edge from a point of the grid to the next one along an axis, `step` of 2^halvings steps on.
struct Between {
    std::size_t point = 0, axis = 0, step = 0;
};

// Their numbers, which follow those of the grid.
struct BetweenNumbers {
    std::size_t grid = 0, axes = 1;  // points of the grid
    int halvings = 0;

    std::size_t steps() const { return std::size_t{1} << halvings; }  // of an edge
    std::size_t operator()(const Between& b) const { return grid + (b.point * axes + b.axis) * steps() + b.step; }
    Between of(std::size_t number) const {
        const std::size_t edge = (number - grid) / steps();
        return {edge / axes, edge % axes, (number - grid) % steps()};
    }
};

// ----

// Points that are neighbours on the grid, but not in outcome.
using Edge = std::pair<std::size_t, std::size_t>;

// Following the lines: first the nodes of a coarse lattice; where two neighbours of it differ, the point halfway
// between them, and so on down to neighbours on the grid; from each such crossing edge, all corners of the cells beside
// it. The result does not depend on the order in which points are finished. With `halvings`, each
// crossing edge of the grid is bisected so many times more, by points between those of the grid.
class Plan {
public:
    // All points of a grid of this shape, row by row.
    explicit Plan(GridShape shape);
    // Along the lines between all outcomes, or between one outcome and the others.
    Plan(GridShape shape, int seeds, std::optional<Outcome> around, int halvings = 0);

    std::optional<std::size_t> next();              // a point to run, if there is one by now
    void done(std::size_t point, Outcome outcome);  // also of points that were run before a resume

    std::size_t known() const { return outcomes_known_; }  // points done
    std::size_t wanted() const { return wanted_count_; }   // points asked for by now
    bool follows() const { return follows_; }

    // For a crossing edge of the grid, the steps (Between) from and to which it is known to cross.
    std::pair<std::size_t, std::size_t> crossing(const Edge& edge) const;
    Between between(const Edge& edge, std::size_t step) const;

private:
    void want(std::size_t point);
    void bisect(std::size_t a, std::size_t b);
    void try_bisect(std::size_t interval);
    void look_around(std::size_t point);
    void halve(const Edge& edge);
    Outcome outcome(std::size_t point) const;  // of any
    void want_cells_beside(std::size_t a, std::size_t b);
    bool differ(std::size_t a, std::size_t b) const;
    std::vector<std::size_t> place(std::size_t point) const { return place_on(shape_, point); }

    GridShape shape_;
    std::vector<std::size_t> stride_;
    bool follows_ = false;
    std::optional<Outcome> around_;
    std::vector<Outcome> outcomes_;  // on the grid
    std::vector<char> wanted_;
    BetweenNumbers numbers_;
    std::map<std::size_t, Outcome> between_;  // wanted ones
    std::deque<std::size_t> queue_;
    std::size_t outcomes_known_ = 0, wanted_count_ = 0;
    std::vector<Edge> intervals_;                    // of seed lines, to be bisected when both ends are known
    std::vector<std::vector<std::size_t>> waiting_;  // intervals that wait for a point
};

// All edges of a grid whose ends differ, both known.
std::vector<Edge> boundary_edges(const GridShape& shape, const std::vector<Outcome>& outcomes,
                                 std::optional<Outcome> around = std::nullopt);

}  // namespace tubule
