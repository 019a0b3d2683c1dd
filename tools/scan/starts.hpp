// Equilibria from several starts in a scan: the shape of least energy, and where the energies of two
// kinds are equal.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "tools/scan/description.hpp"
#include "tools/scan/plan.hpp"
#include "tools/scan/point.hpp"

namespace tubule {

// The axis that varies where the search begins and nothing else (equilibrium.family, or keys of [shape] where area and
// volume are given): shapes along it belong to one problem, so their energies can be compared. Nothing if there is no
// such axis, or more than one.
std::optional<std::size_t> start_axis(const Scan& scan);

// The grid without the axis of starts: a node stands for one point of each start.
class Nodes {
public:
    explicit Nodes(const Scan& scan);  // with or without an axis of starts

    bool has_starts() const { return starts_axis_.has_value(); }
    const GridShape& shape() const { return shape_; }  // 1 along the axis of starts
    std::size_t starts() const { return starts_; }
    std::size_t stride(std::size_t axis) const { return strides(shape_)[axis]; }  // to the next node along an axis
    std::size_t node_of(std::size_t point) const;
    std::size_t point_of(std::size_t node, std::size_t start) const;

private:
    std::optional<std::size_t> starts_axis_;
    GridShape shape_;
    std::size_t starts_ = 1, inner_ = 1;  // points along the axes behind that of starts
};

// The best start of a node whose points are all known: that of the least energy, E + tension A - pressure V with given
// loads, among equilibria; else the first.
std::size_t best_start(const Nodes& nodes, std::size_t node, const std::vector<PointResult>& points);

// Two kinds of shapes, each from its start, on the edge from a node to the next one along an axis. Their energies
// differ in sign at its ends.
struct EnergyCrossing {
    std::size_t node = 0, axis = 0;
    std::array<Outcome, 2> kinds{};
    std::array<std::size_t, 2> starts{};
    std::array<double, 2> differences{};  // first kind less second, at the ends
};
// Its number, behind those of the points of the grid. The former gives node, axis and kinds.
EnergyCrossing crossing_of(const Scan& scan, std::size_t number);
std::size_t number_of(const Scan& scan, const EnergyCrossing& crossing);

// Those on the edges from a node to its neighbours, where both ends are known.
std::vector<EnergyCrossing> energy_crossings(const Nodes& nodes, const std::vector<PointResult>& points,
                                             std::size_t node);

// Where it is: `value` of the axis' key, with the energy there. Outcome::failed if a start leads to another kind there.
PointResult find_crossing(const Scan& scan, const EnergyCrossing& crossing);

}  // namespace tubule
