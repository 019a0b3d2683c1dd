#include "tools/scan/starts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace tubule {
namespace {

bool is_of_start(const Axis& axis) {
    return std::ranges::all_of(axis.keys, [](const std::string& key) {
        return key == "equilibrium.family" || key == "shape" || key.starts_with("shape.");
    });
}

// Whether all that is held has a value of its own, which the start does not change.
bool holds_given_values(const Problem& c) {
    const EquilibriumChoices& e = *c.equilibrium;
    if (c.held == Held::reduced_volume) return e.reduced_volume.has_value();
    return (!holds_area(c.held) || e.area) && (!holds_volume(c.held) || e.volume || e.reduced_volume);
}

bool at_rest(Outcome outcome) {
    return (outcome >= Outcome::uniform_tube && outcome <= Outcome::closed) || outcome >= Outcome::prolate;
}

double free_energy(const PointResult& p) {
    return p[Measure::free_energy];
}

// The places of two neighbours along an axis, for both neighbours of a node that there are: lower and upper one.
std::vector<std::array<std::size_t, 2>> edges_at(const Nodes& nodes, std::size_t node, std::size_t axis) {
    const std::size_t stride = nodes.stride(axis), size = nodes.shape()[axis], at = place_on(nodes.shape(), node)[axis];
    std::vector<std::array<std::size_t, 2>> edges;
    if (at > 0) edges.push_back({node - stride, node});
    if (at + 1 < size) edges.push_back({node, node + stride});
    return edges;
}

// One that leads to this kind at both nodes: the one of the least energy at the first.
std::optional<std::size_t> start_of_kind(const Nodes& nodes, const std::vector<PointResult>& points, std::size_t a,
                                         std::size_t b, Outcome kind) {
    std::optional<std::size_t> best;
    for (std::size_t s = 0; s < nodes.starts(); ++s) {
        const PointResult& p = points[nodes.point_of(a, s)];
        if (p.outcome == kind && points[nodes.point_of(b, s)].outcome == kind &&
            (!best || free_energy(p) < free_energy(points[nodes.point_of(a, *best)])))
            best = s;
    }
    return best;
}

bool all_known(const Nodes& nodes, const std::vector<PointResult>& points, std::size_t node) {
    for (std::size_t s = 0; s < nodes.starts(); ++s)
        if (points[nodes.point_of(node, s)].outcome == Outcome::not_run) return false;
    return true;
}

void add_crossings(const Nodes& nodes, const std::vector<PointResult>& points, std::size_t a, std::size_t b,
                   std::size_t axis, std::vector<EnergyCrossing>& out) {
    if (!all_known(nodes, points, a) || !all_known(nodes, points, b)) return;
    for (int first = 0; first < n_outcomes; ++first)
        for (int second = first + 1; second < n_outcomes; ++second) {
            const std::array kinds{static_cast<Outcome>(first), static_cast<Outcome>(second)};
            if (!at_rest(kinds[0]) || !at_rest(kinds[1])) continue;
            const auto one = start_of_kind(nodes, points, a, b, kinds[0]),
                       other = start_of_kind(nodes, points, a, b, kinds[1]);
            if (!one || !other) continue;
            const auto difference = [&](std::size_t node) {
                return free_energy(points[nodes.point_of(node, *one)]) -
                       free_energy(points[nodes.point_of(node, *other)]);
            };
            const double at_a = difference(a), at_b = difference(b);
            if ((at_a < 0) != (at_b < 0)) out.push_back({a, axis, kinds, {*one, *other}, {at_a, at_b}});
        }
}

}  // namespace

std::optional<std::size_t> start_axis(const Scan& scan) {
    std::optional<std::size_t> found;
    for (std::size_t a = 0; a < scan.axes.size(); ++a) {
        if (!is_of_start(scan.axes[a])) continue;
        if (found) return std::nullopt;
        found = a;
    }
    if (!found) return std::nullopt;
    const Problem c = scan.case_of(0);
    return c.equilibrium && holds_given_values(c) ? found : std::nullopt;
}

Nodes::Nodes(const Scan& scan) : starts_axis_(start_axis(scan)) {
    for (std::size_t a = 0; a < scan.axes.size(); ++a) {
        const bool is_starts = a == starts_axis_;
        shape_.push_back(is_starts ? 1 : scan.axes[a].size());
        if (is_starts) starts_ = scan.axes[a].size();
        if (starts_axis_ && a > *starts_axis_) inner_ *= scan.axes[a].size();
    }
}

std::size_t Nodes::node_of(std::size_t point) const {
    if (!starts_axis_) return point;
    return point / (inner_ * starts_) * inner_ + point % inner_;
}

std::size_t Nodes::point_of(std::size_t node, std::size_t start) const {
    if (!starts_axis_) return node;
    return (node / inner_ * starts_ + start) * inner_ + node % inner_;
}

std::size_t best_start(const Nodes& nodes, std::size_t node, const std::vector<PointResult>& points) {
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t s = 0; s < nodes.starts(); ++s) {
        const PointResult& p = points[nodes.point_of(node, s)];
        if (!at_rest(p.outcome) || !(free_energy(p) < least)) continue;
        best = s;
        least = free_energy(p);
    }
    return best;
}

EnergyCrossing crossing_of(const Scan& scan, std::size_t number) {
    std::size_t rest = number - scan.size();
    EnergyCrossing out;
    for (const std::size_t k : {1, 0}) {
        out.kinds[k] = static_cast<Outcome>(rest % n_outcomes);
        rest /= n_outcomes;
    }
    out.axis = rest % scan.axes.size();
    out.node = rest / scan.axes.size();
    return out;
}

std::size_t number_of(const Scan& scan, const EnergyCrossing& crossing) {
    std::size_t number = crossing.node * scan.axes.size() + crossing.axis;
    for (const Outcome kind : crossing.kinds) number = number * n_outcomes + static_cast<std::size_t>(kind);
    return scan.size() + number;
}

std::vector<EnergyCrossing> energy_crossings(const Nodes& nodes, const std::vector<PointResult>& points,
                                             std::size_t node) {
    std::vector<EnergyCrossing> out;
    for (std::size_t axis = 0; axis < nodes.shape().size(); ++axis)
        for (const auto& [a, b] : edges_at(nodes, node, axis)) add_crossings(nodes, points, a, b, axis, out);
    return out;
}

namespace {

// The shape of a point of the grid, with another value of the key.
PointResult shape_at(const Scan& scan, std::size_t point, const std::string& key, double value) {
    std::vector<std::string> sets = scan.sets_of(point);
    for (std::string& set : sets)
        if (set.starts_with(key + "=")) set = fmt::format("{}={}", key, value);
    return run_point(scan.case_with(sets), scan.to_the_end);
}

double known_to(const PointResult& p) {
    return p[Measure::energy_error] * p[Measure::E_ref];
}

}  // namespace

PointResult find_crossing(const Scan& scan, const EnergyCrossing& crossing) {
    constexpr int most = 40;
    const Nodes nodes(scan);
    const Axis& axis = scan.axes[crossing.axis];
    const std::string& key = axis.keys[0];
    const std::size_t at = scan.place(nodes.point_of(crossing.node, 0))[crossing.axis];
    double low = 0, high = 1, at_low = crossing.differences[0], at_high = crossing.differences[1];
    PointResult found = unknown_point(0);
    double cpu = 0, wall = 0;
    const auto result = [&] {
        found.point = number_of(scan, crossing);
        found[Measure::cpu_seconds] = cpu, found[Measure::wall_seconds] = wall;
        return found;
    };
    for (int k = 0, side = 0; k < most; ++k) {  // regula falsi (Illinois)
        const double part = (low * at_high - high * at_low) / (at_high - at_low), value = axis.value(at, part);
        std::array<PointResult, 2> shapes;
        for (const std::size_t i : {0, 1}) {
            found = shapes[i] = shape_at(scan, nodes.point_of(crossing.node, crossing.starts[i]), key, value);
            cpu += found[Measure::cpu_seconds], wall += found[Measure::wall_seconds];
            if (found.outcome == crossing.kinds[i]) continue;
            found.outcome = Outcome::failed;
            found.message = fmt::format("there is no {} at {} = {}", name(crossing.kinds[i]), key, value);
            return result();
        }
        found.value = value;
        const double difference = free_energy(shapes[0]) - free_energy(shapes[1]);
        if (std::abs(difference) <= known_to(shapes[0]) + known_to(shapes[1])) break;
        const bool below = (difference < 0) == (at_low < 0);
        (below ? low : high) = part;
        (below ? at_low : at_high) = difference;
        if (side == (below ? 1 : -1)) (below ? at_high : at_low) /= 2;
        side = below ? 1 : -1;
    }
    return result();
}

}  // namespace tubule
