#include <algorithm>
#include <limits>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "tools/confirm/confirm.hpp"
#include "tools/scan/plan.hpp"

namespace tubule::confirm {
namespace {

// Places on the axes, each from 0 to 1.
std::vector<double> place(const GridShape& shape, std::size_t point) {
    std::vector<double> at;
    const auto on = place_on(shape, point);
    for (std::size_t a = 0; a < shape.size(); ++a)
        at.push_back(static_cast<double>(on[a]) / static_cast<double>(std::max<std::size_t>(shape[a], 2) - 1));
    return at;
}

// Squared, to the nearest of the picks.
double distance(const GridShape& shape, std::size_t point, const std::vector<Pick>& picks) {
    double nearest = std::numeric_limits<double>::infinity();
    const auto at = place(shape, point);
    for (const Pick& pick : picks) {
        const auto other = place(shape, pick.point);
        double sum = 0;
        for (std::size_t a = 0; a < at.size(); ++a) sum += (at[a] - other[a]) * (at[a] - other[a]);
        nearest = std::min(nearest, sum);
    }
    return nearest;
}

// std::shuffle is not the same everywhere.
template <class T>
void shuffle(std::vector<T>& values, std::mt19937& random) {
    for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[random() % i]);
}

void add(std::vector<Pick>& picks, std::size_t point, Why why, std::size_t most) {
    const bool there = std::any_of(picks.begin(), picks.end(), [&](const Pick& p) { return p.point == point; });
    if (!there && picks.size() < most) picks.push_back({point, why});
}

void add_boundary(std::vector<Pick>& picks, const GridShape& shape, const std::vector<Outcome>& outcomes,
                  std::vector<Edge> edges, std::size_t most) {
    std::set<std::pair<Outcome, Outcome>> kinds;
    while (!edges.empty() && picks.size() + 2 <= most) {
        const auto kind = [&](const Edge& e) { return std::minmax(outcomes[e.first], outcomes[e.second]); };
        const auto worth = [&](const Edge& e) {
            return std::pair(!kinds.contains(kind(e)), distance(shape, e.first, picks));
        };
        const auto best = std::max_element(edges.begin(), edges.end(),
                                           [&](const Edge& a, const Edge& b) { return worth(a) < worth(b); });
        kinds.insert(kind(*best));
        add(picks, best->first, Why::boundary, most);
        add(picks, best->second, Why::boundary, most);
        edges.erase(best);
    }
}

bool is_corner(const GridShape& shape, std::size_t point) {
    for (const double part : place(shape, point))
        if (part != 0 && part != 1) return false;
    return true;
}

}  // namespace

std::string_view name(Why why) {
    static constexpr std::string_view names[] = {"boundary", "extreme", "random"};
    return names[static_cast<int>(why)];
}

std::vector<Pick> pick_points(const GridShape& shape, const std::vector<Outcome>& outcomes,
                              std::optional<Outcome> around, std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    const auto counts = [&](std::size_t p) {
        return outcomes[p] != Outcome::not_run && outcomes[p] != Outcome::failed;
    };
    std::vector<Edge> edges = boundary_edges(shape, outcomes, around);
    std::erase_if(edges, [&](const Edge& e) { return !counts(e.first) || !counts(e.second); });
    std::vector<std::size_t> corners, all;
    for (std::size_t p = 0; p < outcomes.size(); ++p) {
        if (!counts(p)) continue;
        all.push_back(p);
        if (is_corner(shape, p)) corners.push_back(p);
    }
    shuffle(edges, random);
    shuffle(corners, random);
    shuffle(all, random);
    std::vector<Pick> picks;
    const std::size_t half = (count + 1) / 2;
    add_boundary(picks, shape, outcomes, edges, std::max(half, std::min<std::size_t>(count, 2)));
    const std::size_t extremes = std::min(count, picks.size() + (count + 3) / 4);
    for (const std::size_t p : corners) add(picks, p, Why::extreme, extremes);
    for (const std::size_t p : all) add(picks, p, Why::random, count);
    return picks;
}

}  // namespace tubule::confirm
