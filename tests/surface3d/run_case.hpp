// Whole runs of cases that are given as text, and what they report.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/case/read.hpp"
#include "surface3d/run/run_surface.hpp"
#include "tests/support/summary_detail.hpp"

namespace tubule::surface3d {

struct Watch : RunObserver {
    std::vector<std::vector<double>> rows;
    std::vector<Record> frames;
    std::optional<Record> saved;
    std::vector<SurfaceCells> meshes;
    std::size_t most_rows = 1000000;  // then it is interrupted
    int most_looks = 1000000;         // at whether it is: so a run is that writes no rows
    int looks = 0;
    std::vector<int> looks_at_discard;

    void row(std::span<const double> row) override { rows.emplace_back(row.begin(), row.end()); }
    std::size_t mesh(const SurfaceCells& cells) override {
        const auto same = std::find(meshes.begin(), meshes.end(), cells);
        const auto number = static_cast<std::size_t>(same - meshes.begin());
        if (same == meshes.end()) meshes.push_back(cells);
        return number;
    }
    void frame(const std::function<Record()>& make) override { frames.push_back(make()); }
    void checkpoint(const Record& state) override { saved = state; }
    void discard() override {
        rows.clear(), frames.clear(), meshes.clear(), saved.reset();
        looks_at_discard.push_back(looks);
    }
    bool interrupted() override { return rows.size() >= most_rows || ++looks > most_looks; }
};

struct Outcome {
    Case c;
    Watch watch;
    RunSummary summary;

    std::vector<double> series(const std::string& name) const {
        const std::vector<std::string> names = series_names(c);
        const auto column = std::find(names.begin(), names.end(), name) - names.begin();
        std::vector<double> out;
        for (const auto& row : watch.rows) out.push_back(row.at(column));
        return out;
    }
    double last(const std::string& name) const { return series(name).back(); }
};

inline Outcome begin(const std::string& text, const std::vector<std::string>& sets) {
    return {parse_case("tier = \"surface3d\"\n" + text, sets, "case.toml"), {}, {}};
}

inline Outcome run_case(const std::string& text, const std::vector<std::string>& sets = {}) {
    Outcome out = begin(text, sets);
    out.summary = run_surface(out.c, out.watch);
    return out;
}

// The undisturbed run again, interrupted after so many rows and resumed: series end as its own. The interrupted run.
inline Outcome expect_the_same_resumed(const Outcome& whole, const std::string& text,
                                       const std::vector<std::string>& sets, const std::vector<std::string>& names,
                                       std::size_t rows) {
    Outcome first = begin(text, sets), second = begin(text, sets);
    first.watch.most_rows = rows;
    first.summary = run_surface(first.c, first.watch);
    EXPECT_EQ(first.summary.stop.reason, Stop::interrupted);
    if (!first.watch.saved) throw std::runtime_error("no state was saved");
    const Restart restart{*first.watch.saved, first.watch.meshes.at(*first.watch.saved->mesh)};
    second.summary = run_surface(second.c, second.watch, &restart);
    EXPECT_EQ(second.summary.stop.reason, Stop::finished) << second.summary.stop.message;
    for (const std::string& name : names)
        EXPECT_NEAR(second.last(name), whole.last(name), 1e-9 * whole.summary.reference_energy) << name;
    // Nothing of the past is forgotten: steps continue as if there had been no end.
    EXPECT_EQ(first.watch.rows.size() + second.watch.rows.size(), whole.watch.rows.size());
    EXPECT_NEAR(second.summary.estimated_error, whole.summary.estimated_error, 1e-6 * whole.summary.estimated_error);
    return first;
}
inline void expect_the_same_resumed(const std::string& text, const std::vector<std::string>& sets,
                                    const std::vector<std::string>& names) {
    const Outcome whole = run_case(text, sets);
    expect_the_same_resumed(whole, text, sets, names, whole.watch.rows.size() / 2);
}

}  // namespace tubule::surface3d
