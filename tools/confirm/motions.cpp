
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/theory/waves.hpp"
#include "surface3d/curvature/surface_modes.hpp"
#include "surface3d/run/mesh_record.hpp"
#include "tools/compare/results.hpp"
#include "tools/compare/series.hpp"
#include "tools/confirm/confirm.hpp"

namespace tubule::confirm {
namespace {

constexpr int most_waves = 20;         // along a tube: shorter ones are not added
constexpr int more_n = 2, most_m = 3;  // waves that are looked for beside those of the start
constexpr int frames = 20;             // of the first part of the run, and of the rest
constexpr double rounding = 0.01;      // fraction of the noise below which amplitudes say nothing about rates
constexpr double e_folds = 6;          // from the noise to what is large

constexpr double rough = 0.05;          // accuracy of the energy: few triangles are not worth finer steps
constexpr double thinnest_neck = 1e-2;  // that triangles are asked to follow

// Numbers of waves along and around the axis; l and m of a sphere.
using Wave = std::pair<int, int>;

std::set<Wave> added_waves(const Problem& c) {
    if (std::holds_alternative<Sphere>(c.shape)) return {{2, 1}, {2, 2}, {3, 1}};
    std::set<Wave> waves{{1, 1}, {1, 2}};
    for (const theory::FittingWave& wave : fastest_waves(c))
        if (wave.m > 0) waves.insert({wave.n, wave.m});
    return waves;
}

void add_waves(Case& c, double noise) {
    if (auto* sphere = std::get_if<Sphere>(&c.shape)) {
        for (const auto& [l, m] : added_waves(c)) sphere->modes.push_back({noise, l, m});
        return;
    }
    const auto start = theory::tube_start(c);
    if (!start)
        throw CaseError(c.path + ": only tubes and spheres can be confirmed: waves cannot be added to other shapes");
    double phase = 0;  // each its own, so that no mirror is left
    for (const auto& [n, m] : added_waves(c))
        std::get<Tube>(c.shape).modes.push_back({noise * start->tube.radius, n, m, phase += 1});
}

// The first part lasts until tier 1's end or, where a wave with m >= 1 grows, as long as it grows by linear theory.
std::vector<double> output_times(const Problem& c, const PointResult& axisymmetric, double end) {
    double fastest = 0;
    for (const theory::FittingWave& wave : fastest_waves(c))
        if (wave.m > 0) fastest = std::max(fastest, wave.rate);
    const double first_end = fastest > 0 ? e_folds / fastest : axisymmetric[Measure::time];
    std::vector<double> times;
    for (int i = 1; i <= frames; ++i) times.push_back(std::min(first_end, end) * i / frames);
    for (int i = 1; i <= frames && first_end < end; ++i) times.push_back(first_end + (end - first_end) * i / frames);
    times.pop_back();  // there is always a frame at the end
    return times;
}

// All waves with m >= 1 that are considered, except a translation of the tube.
std::vector<Wave> watched(const Problem& c) {
    int highest = 0;
    std::vector<Wave> waves;
    if (const auto* sphere = std::get_if<Sphere>(&c.shape)) {
        for (const auto& mode : sphere->modes) highest = std::max(highest, mode.l);
        for (int m = 1; m <= most_m; ++m)
            for (int l = std::max(m, 2); l <= highest + more_n; ++l) waves.push_back({l, m});
    } else {
        for (const TubeMode& mode : std::get<Tube>(c.shape).modes) highest = std::max(highest, mode.n);
        for (int m = 1; m <= most_m; ++m)
            for (int n = m == 1 ? 1 : 0; n <= highest + more_n; ++n) waves.push_back({n, m});
    }
    return waves;
}

// Relative to the radius.
double amplitude(const Result& result, const Record& frame, Wave wave) {
    const auto mesh = surface3d::frame_surface(frame, result.meshes.at(frame.mesh.value()));
    const auto [n, m] = wave;
    if (mesh.period > 0) return surface3d::tube_mode_amplitude(mesh, n, m) / surface3d::tube_mode_amplitude(mesh, 0, 0);
    return surface3d::sphere_mode_amplitude(mesh, n, m);
}

// And which wave it is.
std::pair<double, Wave> largest_wave(const Problem& c, const Result& result, const Record& frame) {
    std::pair<double, Wave> largest{0, {}};
    for (const Wave& wave : watched(c)) largest = std::max(largest, {amplitude(result, frame, wave), wave});
    return largest;
}

void fit_largest_wave(SurfaceEnd& a, const Problem& c, const Result& result) {
    std::vector<double> times, amplitudes;
    for (const Record& frame : result.frames) {
        times.push_back(frame.time);
        amplitudes.push_back(amplitude(result, frame, {a.n, a.m}));
    }
    try {
        a.fit = theory::fit_growth(times, amplitudes, rounding * a.noise);
        a.linear_rate = theory::mean_rate(c, a.n, a.m, a.fit.from, a.fit.to).value_or(not_known);
    } catch (const std::invalid_argument&) {  // it ended, or decayed, within a few frames
    }
}

// The outcome, if the symmetry held. A run that goes on to its end has come to rest if the one in tier 1 had by
// then.
Outcome outcome_in_3d(const SurfaceEnd& a, const PointResult& axisymmetric, const Result& surface) {
    const auto last = [&](const char* name) { return surface.series.at(name).back(); };
    const EndShape end{surface.meshes.front().period > 0, last("r_min"), last("r_max"), last("area"), last("volume")};
    const Stop stop = stop_from_name(a.stop).value();
    if (stop != Stop::finished) return outcome_of(stop, end);
    if (axisymmetric.outcome == Outcome::undecided || a.time < axisymmetric[Measure::time]) return Outcome::undecided;
    return outcome_of(Stop::stationary, end);
}

Verdict verdict(const SurfaceEnd& a, const PointResult& axisymmetric) {
    if (a.amplitude > grown * a.noise) return Verdict::symmetry_broken;
    if (a.outcome == Outcome::failed || a.stop == name(Stop::time_limit)) return Verdict::no_answer;
    if (a.outcome == axisymmetric.outcome) return Verdict::agrees;
    return a.outcome == Outcome::undecided ? Verdict::no_answer : Verdict::other_outcome;
}

}  // namespace

std::vector<theory::FittingWave> fastest_waves(const Problem& c) {
    const auto start = theory::tube_start(c);
    if (!start) return {};
    std::vector<theory::FittingWave> all;
    for (int m = 0; m <= 2; ++m) {
        theory::FittingWave best{0, m, 0, -std::numeric_limits<double>::infinity()};
        for (int n = m < 2 ? 1 : 0; n <= most_waves; ++n) {
            const double q = 2 * pi * n / start->length, rate = theory::growth(start->tube, c.law, q, m).rate();
            if (std::isfinite(rate) && rate > best.rate) best = {n, m, q, rate};
        }
        all.push_back(best);
    }
    return all;
}

std::string surface_case(const Problem& c, const PointResult& axisymmetric, const Choices& choices) {
    Case s = c.of_surface();
    s.accuracy.r_min = std::max(c.accuracy.r_min, thinnest_neck);
    s.accuracy.energy = std::max(c.accuracy.energy, rough);
    s.discretisation = {};
    s.surface = {};
    s.surface.elements = choices.elements.value_or(200);
    s.expect = {};
    s.time.stationary.reset();
    s.time.end = choices.end.value_or(c.time.end);
    s.time.output = output_times(c, axisymmetric, s.time.end);
    add_waves(s, choices.noise);
    const std::string text = effective_toml(s);
    parse_case(text, {}, c.path);  // refuses a bad case before anything runs
    return text;
}

std::string_view name(Verdict verdict) {
    static constexpr std::string_view names[] = {"agrees", "symmetry-broken", "other-outcome", "no-answer"};
    return names[static_cast<int>(verdict)];
}

SurfaceEnd surface_end(const PointResult& axisymmetric, const Result& surface) {
    const std::string stop = compare::stop_word(surface);
    if (!stop_from_name(stop) || surface.frames.empty()) throw std::runtime_error("the result is not complete");
    const Problem c = parse_case(surface.case_text.text, surface.case_text.sets, "result", surface.case_text.inputs);
    SurfaceEnd a{.stop = stop, .time = compare::stop_time(surface)};
    a.energy_error = compare::stated_error(surface).value_or(not_known);
    if (const double t = axisymmetric[Measure::time]; t <= a.time)
        a.energy_difference =
            (compare::trace_of(surface, "energy")(t) - axisymmetric[Measure::energy]) / axisymmetric[Measure::E_ref];
    a.noise = largest_wave(c, surface, surface.frames.front()).first;
    const auto [size, wave] = largest_wave(c, surface, surface.frames.back());
    a.amplitude = size, a.n = wave.first, a.m = wave.second;
    fit_largest_wave(a, c, surface);
    a.outcome = outcome_in_3d(a, axisymmetric, surface);
    a.verdict = verdict(a, axisymmetric);
    return a;
}

}  // namespace tubule::confirm
