// Which points a scan runs. The maps are made up, so that the lines between outcomes are known.
#include "tools/scan/plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace tubule::plan_test {

using Map = std::function<Outcome(std::size_t, std::size_t)>;
constexpr std::size_t n = 60;

// Runs a plan on a made-up map, finishing points in random order; gives what is known in the end.
std::vector<Outcome> run(Plan plan, const Map& map, unsigned seed, const std::vector<Outcome>& before = {}) {
    std::vector<Outcome> known(n * n, Outcome::not_run);
    for (std::size_t i = 0; i < before.size(); ++i)
        if (before[i] != Outcome::not_run) plan.done(i, known[i] = before[i]);
    std::mt19937 random(seed);
    std::vector<std::size_t> running;
    while (true) {
        while (running.size() < 3)
            if (const auto point = plan.next())
                running.push_back(*point);
            else
                break;
        if (running.empty()) return known;
        const auto which = std::uniform_int_distribution<std::size_t>(0, running.size() - 1)(random);
        const std::size_t point = running[which];
        running.erase(running.begin() + static_cast<std::ptrdiff_t>(which));
        EXPECT_EQ(known[point], Outcome::not_run) << "point " << point << " is run twice";
        plan.done(point, known[point] = map(point / n, point % n));
    }
}

std::vector<Outcome> whole(const Map& map) {
    std::vector<Outcome> all;
    for (std::size_t i = 0; i < n * n; ++i) all.push_back(map(i / n, i % n));
    return all;
}

std::size_t count_known(const std::vector<Outcome>& outcomes) {
    return outcomes.size() - static_cast<std::size_t>(std::count(outcomes.begin(), outcomes.end(), Outcome::not_run));
}

Outcome slope(std::size_t i, std::size_t j) {
    return i + 2 * j < 70 ? Outcome::uniform_tube : Outcome::pinched;
}
Outcome disc(std::size_t i, std::size_t j) {
    return std::hypot(static_cast<double>(i) - 30, static_cast<double>(j) - 25) < 12 ? Outcome::unduloid
                                                                                     : Outcome::uniform_tube;
}
Outcome three(std::size_t i, std::size_t j) {  // three regions that meet at one place
    return i < 31 ? Outcome::uniform_tube : j < 17 ? Outcome::pinched : Outcome::overhang;
}

TEST(Plan, MapRunsEveryPointOnce) {
    EXPECT_EQ(run(Plan({n, n}), slope, 1), whole(slope));
}

// Every edge of the whole map is found, from points that are as in it; and a line costs its length, not the area:
// a cell along it has two points that its neighbour has not.
TEST(Plan, FollowsLines) {
    for (const Map& map : {Map(slope), Map(disc), Map(three)}) {
        const auto found = run(Plan({n, n}, 8, std::nullopt), map, 1);
        const auto edges = boundary_edges({n, n}, whole(map));
        EXPECT_EQ(boundary_edges({n, n}, found), edges);
        EXPECT_LT(count_known(found), 81 + 3 * edges.size());
    }
}

TEST(Plan, DoesNotDependOnTheOrder) {
    const auto once = run(Plan({n, n}, 8, std::nullopt), three, 1);
    for (unsigned seed = 2; seed < 6; ++seed) EXPECT_EQ(run(Plan({n, n}, 8, std::nullopt), three, seed), once);
}

// As after a kill: some of the points are known before anything is run.
TEST(Plan, GoesOnFromKnownPoints) {
    const auto once = run(Plan({n, n}, 8, std::nullopt), disc, 1);
    std::mt19937 random(7);
    auto some = once;
    for (Outcome& outcome : some)
        if (random() % 2) outcome = Outcome::not_run;
    EXPECT_EQ(run(Plan({n, n}, 8, std::nullopt), disc, 3, some), once);
}

// Around one outcome only its own line is followed: pinched meets the others along 28 + 17 edges, less where it ends.
TEST(Plan, FollowsTheLineAroundOneOutcome) {
    const auto found = run(Plan({n, n}, 8, Outcome::pinched), three, 1);
    const auto edges = boundary_edges({n, n}, whole(three), Outcome::pinched);
    EXPECT_EQ(edges.size(), 17u + (n - 31));
    EXPECT_EQ(boundary_edges({n, n}, found, Outcome::pinched), edges);
    EXPECT_LT(count_known(found), count_known(run(Plan({n, n}, 8, std::nullopt), three, 1)));
}

// What separates no two neighbours of the lattice (7 or 8 points apart) and meets no line that does is not seen.
TEST(Plan, MissesWhatFitsBetweenTheSeeds) {
    const Map speck = [](std::size_t i, std::size_t j) {
        return i >= 31 && i < 34 && j >= 31 && j < 34 ? Outcome::pinched : Outcome::uniform_tube;
    };
    EXPECT_TRUE(boundary_edges({n, n}, run(Plan({n, n}, 8, std::nullopt), speck, 1)).empty());
    EXPECT_EQ(boundary_edges({n, n}, run(Plan({n, n}, 30, std::nullopt), speck, 1)).size(), 12u);
}

// Along one axis following is bisection: 2 ends and log2 of the 1000 intervals.
TEST(Plan, BisectsALine) {
    Plan plan({1001}, 1, std::nullopt);
    std::size_t runs = 0;
    for (auto point = plan.next(); point; point = plan.next(), ++runs)
        plan.done(*point, *point < 437 ? Outcome::uniform_tube : Outcome::pinched);
    EXPECT_LE(runs, 2u + 10u);
}

// Points between those of the grid at their true places, on a map that is known everywhere.
TEST(Plan, HalvesTheEdgesThatALineCrosses) {
    constexpr int halvings = 6;
    constexpr std::size_t rows = 12, columns = 9, steps = std::size_t{1} << halvings;
    const auto map = [](double x, double y) {  // crosses every edge at most once
        return x + 1.7 * y < 14.31 ? Outcome::uniform_tube : Outcome::pinched;
    };
    const BetweenNumbers numbers{rows * columns, 2, halvings};
    for (const unsigned seed : {1u, 2u}) {
        Plan plan({rows, columns}, 4, std::nullopt, halvings);
        std::vector<Outcome> known(rows * columns, Outcome::not_run);
        std::vector<std::size_t> open;
        std::mt19937 random(seed);
        std::size_t between = 0;
        while (true) {
            while (const auto point = plan.next()) open.push_back(*point);
            if (open.empty()) break;
            std::swap(open[random() % open.size()], open.back());
            const std::size_t point = open.back();
            open.pop_back();
            const Between at = point < known.size() ? Between{point, 0, 0} : numbers.of(point);
            const double part = static_cast<double>(at.step) / steps;
            const Outcome outcome = map(static_cast<double>(at.point / columns) + (at.axis == 0 ? part : 0),
                                        static_cast<double>(at.point % columns) + (at.axis == 1 ? part : 0));
            if (point < known.size())
                known[point] = outcome;
            else
                ++between;
            plan.done(point, outcome);
        }
        const auto edges = boundary_edges({rows, columns}, known);
        ASSERT_GT(edges.size(), 8u);
        EXPECT_EQ(between, halvings * edges.size());  // one a halving
        EXPECT_EQ(plan.known(), plan.wanted());
        for (const Edge& edge : edges) {
            const auto [from, to] = plan.crossing(edge);
            EXPECT_EQ(to - from, 1u);
            const double x = static_cast<double>(edge.first / columns), y = static_cast<double>(edge.first % columns);
            const double crossing = edge.second == edge.first + columns ? 14.31 - 1.7 * y - x : (14.31 - x) / 1.7 - y;
            EXPECT_LE(static_cast<double>(from), crossing * steps);
            EXPECT_GE(static_cast<double>(to), crossing * steps);
        }
    }
}

}  // namespace tubule::plan_test
