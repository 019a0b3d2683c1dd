// Cases made in code, and an observer that keeps everything a run hands out.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "axisym/equilibrium/equilibrium_run.hpp"
#include "axisym/run_profile.hpp"
#include "tests/support/summary_detail.hpp"

namespace tubule::axisym {

inline Bending bending(double k20, double H0 = 0, double k40 = 0, double k42 = 0) {
    return {.k = {k20, k40, k42}, .H0 = H0};
}

// With terms that a case adds: by powers, and by a formula.
inline Bending with_terms(Bending energy, std::vector<EnergyTerm> terms) {
    energy.terms = std::move(terms);
    return energy;
}
inline EnergyTerm powers(double modulus, int H, int K) {
    return {.modulus = modulus, .H = H, .K = K};
}
inline EnergyTerm formula(double modulus, const std::string& text) {
    return {.modulus = modulus, .formula = std::make_shared<const Formula>(parse_formula(text, EnergyTerm::variables))};
}

// r0 = radius + SUM amplitude cos(2 pi n z/length + phase)
inline Case tube_case(const Bending& energy, double radius, double length, std::vector<TubeMode> modes, double end,
                      std::vector<double> output = {}) {
    Case c;
    c.energy = energy;
    c.shape = Tube{.radius = radius, .length = length, .modes = std::move(modes)};
    c.time.end = end;
    c.time.output = std::move(output);
    return c;
}

// Settings of the integration by hand: what is left is the error of the discretisation.
inline Case& explicitly(Case& c, int elements, double time_tolerance, int order = 5) {
    c.discretisation.elements = elements;
    c.discretisation.time_tolerance = time_tolerance;
    c.discretisation.order = order;
    return c;
}

struct Recorder : RunObserver {
    std::vector<std::vector<double>> rows;
    std::vector<Record> frames, checkpoints;
    int discards = 0;
    std::function<bool(double time)> stop_when;  // what interrupted() says
    double latest = 0;

    void row(std::span<const double> values) override { rows.emplace_back(values.begin(), values.end()); }
    void frame(const std::function<Record()>& make) override { frames.push_back(make()); }
    void checkpoint(const Record& r) override { checkpoints.push_back(r); }
    void discard() override {
        rows.clear(), frames.clear(), checkpoints.clear();
        ++discards;
    }
    void progress(double time, double, double) override { latest = time; }
    bool interrupted() override { return stop_when && stop_when(latest); }
};

struct Outcome {
    RunSummary summary;
    Recorder log;
    std::map<std::string, std::vector<double>> series;

    const std::vector<double>& operator[](const std::string& name) const { return series.at(name); }
    // A series at one of its times. std::out_of_range if there is no row of that time.
    double at(const std::string& name, double time) const {
        const auto& t = series.at("time");
        const auto it = std::find(t.begin(), t.end(), time);
        if (it == t.end()) throw std::out_of_range("no row at t = " + std::to_string(time));
        return series.at(name)[it - t.begin()];
    }
    double last(const std::string& name) const { return series.at(name).back(); }
};

inline Outcome run_case(const Case& c, const Record* restart = nullptr,
                        std::function<bool(double)> stop_when = nullptr) {
    Outcome out;
    out.log.stop_when = std::move(stop_when);
    std::optional<Restart> from;
    if (restart) from = Restart{*restart};
    out.summary = run_profile(c, out.log, from ? &*from : nullptr);
    const auto names = series_names(c);
    for (std::size_t i = 0; i < names.size(); ++i)
        for (const auto& row : out.log.rows) out.series[names[i]].push_back(row.at(i));
    return out;
}

inline Outcome run_shapes(const Case& c) {
    Outcome out;
    out.summary = run_equilibrium(c, out.log);
    const auto names = equilibrium_series_names(c);
    for (std::size_t i = 0; i < names.size(); ++i)
        for (const auto& row : out.log.rows) out.series[names[i]].push_back(row.at(i));
    return out;
}

inline const char* word(Stop reason) {
    return name(reason).data();
}

}  // namespace tubule::axisym
