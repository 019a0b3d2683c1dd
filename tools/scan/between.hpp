// Points between those of a scan's grid: where a line is traced more finely than by the grid.
#pragma once

#include <cstddef>

namespace tubule {

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

}  // namespace tubule
