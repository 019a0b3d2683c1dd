#include "tools/scan/plan.hpp"

#include <algorithm>

namespace tubule {
namespace {

// Whether a line runs between two outcomes.
bool line_between(Outcome a, Outcome b, std::optional<Outcome> around) {
    return a != b && (!around || a == *around || b == *around);
}

// Calls visit(point) for all points whose place on each axis is one of those given.
template <class Visit>
void for_each_place(const std::vector<std::vector<std::size_t>>& places, const std::vector<std::size_t>& stride,
                    const Visit& visit) {
    std::vector<std::size_t> at(places.size(), 0);
    while (true) {
        std::size_t point = 0;
        for (std::size_t a = 0; a < at.size(); ++a) point += places[a][at[a]] * stride[a];
        visit(point);
        std::size_t a = at.size();
        while (a > 0 && ++at[a - 1] == places[a - 1].size()) at[--a] = 0;
        if (a == 0) return;
    }
}

}  // namespace

std::size_t count_points(const GridShape& shape) {
    std::size_t n = 1;
    for (const std::size_t extent : shape) n *= extent;
    return n;
}

std::vector<std::size_t> strides(const GridShape& shape) {
    std::vector<std::size_t> stride(shape.size(), 1);
    for (std::size_t a = shape.size(); a-- > 1;) stride[a - 1] = stride[a] * shape[a];
    return stride;
}

std::vector<std::size_t> place_on(const GridShape& shape, std::size_t point) {
    std::vector<std::size_t> at(shape.size());
    for (std::size_t a = shape.size(); a-- > 0; point /= shape[a]) at[a] = point % shape[a];
    return at;
}

Plan::Plan(GridShape shape) : shape_(std::move(shape)), stride_(strides(shape_)) {
    outcomes_.assign(count_points(shape_), Outcome::not_run);
    wanted_.assign(outcomes_.size(), 0);
    for (std::size_t i = 0; i < outcomes_.size(); ++i) want(i);
}

Plan::Plan(GridShape shape, int seeds, std::optional<Outcome> around, int halvings)
    : shape_(std::move(shape)),
      stride_(strides(shape_)),
      follows_(true),
      around_(around),
      numbers_{count_points(shape_), shape_.size(), halvings} {
    outcomes_.assign(numbers_.grid, Outcome::not_run);
    wanted_.assign(outcomes_.size(), 0);
    waiting_.resize(outcomes_.size());
    std::vector<std::vector<std::size_t>> nodes;
    for (const std::size_t extent : shape_) {
        std::vector<std::size_t>& line = nodes.emplace_back();
        const auto intervals =
            std::min<std::size_t>(static_cast<std::size_t>(seeds), std::max<std::size_t>(extent, 2) - 1);
        for (std::size_t i = 0; i <= intervals; ++i) line.push_back(i * (extent - 1) / intervals);
        line.erase(std::unique(line.begin(), line.end()), line.end());
    }
    for_each_place(nodes, stride_, [&](std::size_t point) { want(point); });
    for (std::size_t a = 0; a < shape_.size(); ++a) {
        auto lower = nodes;
        lower[a].pop_back();
        if (lower[a].empty()) continue;
        for_each_place(lower, stride_, [&](std::size_t point) {
            const std::size_t at = place(point)[a];
            const std::size_t next = *std::upper_bound(nodes[a].begin(), nodes[a].end(), at);
            bisect(point, point + (next - at) * stride_[a]);
        });
    }
}

bool Plan::differ(std::size_t a, std::size_t b) const {
    return line_between(outcomes_[a], outcomes_[b], around_);
}

void Plan::want(std::size_t point) {
    const bool on_grid = point < wanted_.size();
    if (on_grid ? wanted_[point] != 0 : between_.contains(point)) return;
    if (on_grid)
        wanted_[point] = 1;
    else
        between_[point] = Outcome::not_run;
    ++wanted_count_;
    queue_.push_back(point);
}

// Two points of a seed line between which there is at least one more.
void Plan::bisect(std::size_t a, std::size_t b) {
    const auto at = place(a), end = place(b);
    std::size_t gap = 0;
    for (std::size_t i = 0; i < at.size(); ++i) gap += end[i] - at[i];
    if (gap < 2) return;
    intervals_.emplace_back(a, b);
    for (const std::size_t point : {a, b}) waiting_[point].push_back(intervals_.size() - 1);
    try_bisect(intervals_.size() - 1);
}

void Plan::try_bisect(std::size_t interval) {
    const auto [a, b] = intervals_[interval];
    if (outcomes_[a] == Outcome::not_run || outcomes_[b] == Outcome::not_run || !differ(a, b)) return;
    const auto at = place(a), end = place(b);
    std::size_t middle = 0;
    for (std::size_t i = 0; i < at.size(); ++i) middle += (at[i] + end[i]) / 2 * stride_[i];
    want(middle);
    bisect(a, middle);
    bisect(middle, b);
}

void Plan::want_cells_beside(std::size_t a, std::size_t b) {
    const auto at = place(a), end = place(b);
    std::vector<std::vector<std::size_t>> corners(at.size());
    for (std::size_t i = 0; i < at.size(); ++i) {
        const std::size_t low = std::min(at[i], end[i]), high = std::max(at[i], end[i]);
        const bool across = low == high;  // the cells lie to both sides of the edge
        for (std::size_t k = across && low > 0 ? low - 1 : low; k <= std::min(across ? high + 1 : high, shape_[i] - 1);
             ++k)
            corners[i].push_back(k);
    }
    for_each_place(corners, stride_, [&](std::size_t point) { want(point); });
}

void Plan::look_around(std::size_t point) {
    const auto at = place(point);
    for (std::size_t a = 0; a < shape_.size(); ++a)
        for (const bool up : {false, true}) {
            if (up ? at[a] + 1 == shape_[a] : at[a] == 0) continue;
            const std::size_t other = up ? point + stride_[a] : point - stride_[a];
            if (outcomes_[other] == Outcome::not_run || !differ(point, other)) continue;
            want_cells_beside(point, other);
            halve(std::minmax(point, other));
        }
}

Outcome Plan::outcome(std::size_t point) const {
    if (point < outcomes_.size()) return outcomes_[point];
    const auto known = between_.find(point);
    return known == between_.end() ? Outcome::not_run : known->second;
}

// Neighbours on the grid are a stride apart, but where an axis has one value its stride is that of another.
Between Plan::between(const Edge& edge, std::size_t step) const {
    std::size_t axis = 0;
    while (stride_[axis] != edge.second - edge.first || shape_[axis] == 1) ++axis;
    return {edge.first, axis, step};
}

std::pair<std::size_t, std::size_t> Plan::crossing(const Edge& edge) const {
    std::size_t low = 0, high = numbers_.steps();
    while (high - low > 1) {
        const std::size_t middle = (low + high) / 2;
        const Outcome there = outcome(numbers_(between(edge, middle)));
        if (there == Outcome::not_run) break;
        (line_between(outcomes_[edge.first], there, around_) ? high : low) = middle;
    }
    return {low, high};
}

void Plan::halve(const Edge& edge) {
    const auto [low, high] = crossing(edge);
    if (high - low > 1) want(numbers_(between(edge, (low + high) / 2)));
}

std::optional<std::size_t> Plan::next() {
    while (!queue_.empty()) {
        const std::size_t point = queue_.front();
        queue_.pop_front();
        if (outcome(point) == Outcome::not_run) return point;  // else it was done before a resume
    }
    return std::nullopt;
}

void Plan::done(std::size_t point, Outcome outcome) {
    if (this->outcome(point) != Outcome::not_run) return;
    ++outcomes_known_;
    if (point >= outcomes_.size()) {
        if (!between_.contains(point)) ++wanted_count_;  // was run before a resume
        between_[point] = outcome;
        const Between at = numbers_.of(point);
        halve({at.point, at.point + stride_[at.axis]});
        return;
    }
    outcomes_[point] = outcome;
    if (!follows_) return;
    const std::vector<std::size_t> intervals = waiting_[point];  // grows while it is worked off
    for (const std::size_t interval : intervals) try_bisect(interval);
    look_around(point);
}

std::vector<Edge> boundary_edges(const GridShape& shape, const std::vector<Outcome>& outcomes,
                                 std::optional<Outcome> around) {
    const auto stride = strides(shape);
    std::vector<Edge> edges;
    for (std::size_t point = 0; point < outcomes.size(); ++point)
        for (std::size_t a = 0; a < shape.size(); ++a) {
            if (point / stride[a] % shape[a] + 1 == shape[a]) continue;
            const std::size_t other = point + stride[a];
            if (outcomes[point] != Outcome::not_run && outcomes[other] != Outcome::not_run &&
                line_between(outcomes[point], outcomes[other], around))
                edges.emplace_back(point, other);
        }
    return edges;
}

}  // namespace tubule
