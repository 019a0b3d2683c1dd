// Two results made up here against each other: series between their rows, frames of both tiers over time.
#include "tools/compare/results.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/geometry/profile_point.hpp"
#include "common/shapes/sphere.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "tests/support/message_of.hpp"
#include "tools/compare/series.hpp"

namespace tubule::compare::results_test {

using Function = std::function<double(double)>;

std::vector<double> evenly(double end, int steps) {
    std::vector<double> out;
    for (int i = 0; i <= steps; ++i) out.push_back(end * i / steps);
    return out;
}

void add_series(Result& result, const std::string& name, const std::vector<double>& values) {
    result.series_names.push_back(name);
    result.series[name] = values;
}

Result result_of(const std::vector<double>& times, const std::vector<std::pair<std::string, Function>>& series) {
    Result out;
    add_series(out, "time", times);
    for (const auto& [name, f] : series) {
        std::vector<double> values;
        for (const double t : times) values.push_back(f(t));
        add_series(out, name, values);
    }
    return out;
}

SeriesDifference find(const Result& a, const Result& b, const std::string& name) {
    for (const SeriesDifference& d : compare_series(a, b))
        if (d.name == name) return d;
    ADD_FAILURE() << name << " was not compared";
    return {};
}

double cubic(double t) {
    return 3 - 2 * t + t * t - 0.5 * t * t * t;
}
double downhill(double t) {  // of it
    return 2 - 2 * t + 1.5 * t * t;
}

TEST(Series, EnergyAndItsSlopeGiveCubicsExactly) {
    const Result coarse = result_of(evenly(1, 4), {{"energy", cubic}, {"dissipation", downhill}}),
                 fine = result_of(evenly(1, 7), {{"energy", cubic}, {"dissipation", downhill}});
    const SeriesDifference d = find(coarse, fine, "energy");
    EXPECT_EQ(d.times.size(), 11u);  // 5 and 8 times, of which 0 and 1 are the same
    EXPECT_EQ(d.rows_in_both, 2u);
    EXPECT_LT(d.largest + d.largest_unsure, 1e-15);
    // The dissipation has no slope of its own: parabolas, exact for it.
    EXPECT_LT(find(coarse, fine, "rate").largest, 1e-15);
}

TEST(Series, WithKineticEnergyTheSlopeOfTheEnergyIsNotTheDissipation) {
    // E = cos(t) + 2 bounces, E + E_kinetic = 3 never falls: with -dissipation as its slope E would have steps.
    const auto bouncing = [](int steps) {
        return result_of(evenly(6, steps), {{"energy", [](double t) { return 2 + std::cos(t); }},
                                            {"kinetic_energy", [](double t) { return 1 - std::cos(t); }},
                                            {"dissipation", [](double) { return 0.0; }}});
    };
    const SeriesDifference d = find(bouncing(40), bouncing(67), "energy");
    // Parabolas' slopes are off by h^2/6 |E'''| and cubics with them by h/4 of that: 2e-4 in the middle at most.
    for (std::size_t i = 0; i < d.times.size(); ++i) EXPECT_NEAR(d.a[i], d.b[i], 4e-4) << d.times[i];
    EXPECT_EQ(find(bouncing(40), bouncing(67), "rate").largest, 0);
}

TEST(Series, WhatInterpolationMayHaveMadeDoesNotCount) {
    const Function fast = [](double t) { return std::exp(-8 * t); };
    const Result coarse = result_of(evenly(1, 20), {{"area", fast}}),
                 fine = result_of(evenly(1, 470), {{"area", fast}});
    const SeriesDifference same = find(coarse, fine, "area");
    double off = 0;
    for (std::size_t i = 0; i < same.times.size(); ++i) off = std::max(off, std::abs(same.a[i] - same.b[i]));
    EXPECT_GT(off, 1e-3);  // cubics over 20 rows
    EXPECT_LT(same.largest, 0.1 * off);
    EXPECT_EQ(same.largest_in_rows, 0);  // 21 rows at exactly the same times
    EXPECT_EQ(same.rows_in_both, 11u);   // t = i/10: 470/20 is 23.5
    const Result other = result_of(evenly(1, 470), {{"area", [&](double t) { return fast(t) + 0.01 * t; }}});
    const SeriesDifference apart = find(coarse, other, "area");
    EXPECT_NEAR(apart.largest, 0.01, 1e-12);
    EXPECT_EQ(apart.when, 1);
    EXPECT_EQ(apart.at_end, apart.largest);
}

TEST(Series, ScalesAreThoseOfA) {
    Result a = result_of(evenly(1, 4), {{"energy", cubic}, {"area", [](double t) { return 5 - t; }}}), b = a;
    EXPECT_EQ(find(a, b, "energy").scale, 3);
    EXPECT_EQ(find(a, b, "area").scale, 5);
    a.about.emplace_back("E_ref", 12.0);
    EXPECT_EQ(find(a, b, "energy").scale, 12);
    EXPECT_EQ(find(a, b, "area").scale, 5);
}

TEST(Series, OnlyTimesOfBothAndWhatBothHave) {
    const Result a = result_of({0, 1, 2}, {{"energy", cubic}, {"r_min", cubic}, {"wall_seconds", cubic}}),
                 b = result_of({1.5, 2.5}, {{"energy", cubic}, {"wall_seconds", cubic}}),
                 later = result_of({7, 8}, {{"energy", cubic}});
    const auto found = compare_series(a, b);
    ASSERT_EQ(found.size(), 2u);  // energy and rate
    EXPECT_EQ(found[0].times, (std::vector<double>{1.5, 2}));
    EXPECT_TRUE(compare_series(a, later).empty());
    EXPECT_EQ(drift(a, "r_max"), 0);
}

// ---- frames

// A sphere of radius r about (x, 0, 0) as a mesh, or about the origin as a profile.
void add_mesh_frame(Result& result, double time, double r, double x) {
    const Sphere sphere{r, {}};
    const auto mesh = surface3d::mapped_mesh(surface3d::icosphere(3), 4, [&](const Eigen::Vector3d& p) {
        return Eigen::Vector3d(position(sphere, p) + x * Eigen::Vector3d::UnitX());
    });
    Array points{"points", {mesh.nodes.size(), 3}, {}};
    for (const Eigen::Vector3d& node : mesh.nodes) points.data.insert(points.data.end(), node.begin(), node.end());
    result.meshes = {{mesh.order, mesh.nodes.size(), mesh.cells, 0, {}}};
    result.frames.push_back({time, {}, {points}, 0});
}
void add_profile_frame(Result& result, double time, double r) {
    Array rs{"r", {121}, {}}, zs{"z", {121}, {}};
    for (int i = 0; i <= 120; ++i) {
        rs.data.push_back(i % 120 == 0 ? 0 : r * std::sin(pi * i / 120));
        zs.data.push_back(-r * std::cos(pi * i / 120));
    }
    result.frames.push_back({time, {{"length", 0}}, {rs, zs}});
}

TEST(Frames, OfBothTiersOverTime) {
    // Radii 1 + t and 1 + 1.5 t: t/2 apart, of a size of 1 + t. The second one drifts by t, and its mesh is off
    // by 1.5e-6 of its radius (distance_test).
    Result a, b;
    add_series(a, "time", {}), add_series(b, "time", {});
    for (const double t : {0.1, 0.2, 0.6}) add_profile_frame(a, t, 1 + t);
    for (const double t : {0.1, 0.3, 0.6 * (1 + 1e-9)}) add_mesh_frame(b, t, 1 + 1.5 * t, t);
    const std::vector<FramePair> pairs = frames_in_common(a, b);
    ASSERT_EQ(pairs, (std::vector<FramePair>{{0, 0}, {2, 2}}));
    for (const FramePair& pair : pairs) {
        const ShapeDifference still = compare_shapes(a, b, pair, false);
        const double t = still.time;
        // Moved by t and larger by t/2: the farthest point is 3/2 t away.
        EXPECT_NEAR(still.distance.hausdorff, 1.5 * t, 2e-5);
        if (t < 0.5) continue;
        const ShapeDifference aligned = compare_shapes(a, b, pair, true);
        EXPECT_NEAR(aligned.distance.hausdorff, t / 2, 2e-5);
        EXPECT_NEAR(aligned.distance.l2, t / 2, 2e-5);
        EXPECT_NEAR(aligned.distance.size, 1 + t, 1e-7);
        EXPECT_LT((aligned.moved + t * Eigen::Vector3d::UnitX()).norm(), 1e-5);
        EXPECT_FALSE(aligned.energy);
    }
}

TEST(Frames, ThatHoldNoSurfaceAreNamed) {
    Result a, b;
    add_series(a, "time", {}), add_series(b, "time", {});
    add_profile_frame(a, 0.5, 1);
    b.frames.push_back({0.5, {}, {}});
    EXPECT_EQ(test::message_of<std::invalid_argument>([&] {
                  compare_shapes(a, b, {0, 0}, false);
              }),
              "frame 0 of B, t = 0.5: it holds neither a surface nor a profile");
}

TEST(Outcomes, AreWhatTheRunSays) {
    Result result = result_of({0, 1, 2.5}, {});
    EXPECT_EQ(stop_word(result), "unfinished");
    EXPECT_EQ(stop_time(result), 2.5);
    EXPECT_FALSE(stated_error(result));
    result.about = {{"stop", std::string("pinch-off")}, {"stop_time", 2.25}, {"estimated_error", 1e-5}};
    EXPECT_EQ(stop_word(result), "pinch-off");
    EXPECT_EQ(stop_time(result), 2.25);
    EXPECT_EQ(stated_error(result), 1e-5);
}

}  // namespace tubule::compare::results_test
