#include "tools/confirm/confirm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
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
#include "tools/scan/plan.hpp"

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
namespace {

constexpr int last_m = 4, modes = 12;
constexpr double accuracy = 1e-4;
constexpr double neutral = 1e-3;  // of the fastest decay: smaller rates have no sign

double last(const Result& result, const std::string& name) {
    const auto found = result.series.find(name);
    if (found == result.series.end() || found->second.empty()) return not_known;
    return found->second.back();
}

// Rates by m, several of one m in three dimensions.
using Rates = std::vector<std::pair<int, double>>;

Rates rates_of_profile(const Result& result) {
    Rates out;
    for (int m = 0; m <= last_m; ++m)
        if (const double rate = last(result, fmt::format("growth_{}", m)); std::isfinite(rate))
            out.emplace_back(m, rate);
    return out;
}

Rates rates_of_surface(const Result& result) {
    Rates out;
    for (int i = 1; i <= modes; ++i)
        if (const double rate = last(result, fmt::format("rate_{}", i)); std::isfinite(rate))
            out.emplace_back(static_cast<int>(last(result, fmt::format("wave_number_{}", i))), rate);
    return out;
}

double size_of(const Rates& rates) {
    double out = 0;
    for (const auto& [m, rate] : rates) out = std::max(out, std::abs(rate));
    return out;
}

// With rates above `least`; of those that tier axisym looks for.
std::set<int> growing(const Rates& rates, double least) {
    std::set<int> out;
    for (const auto& [m, rate] : rates)
        if (m <= last_m && rate > least) out.insert(m);
    return out;
}

bool includes(const std::set<int>& a, const std::set<int>& b) {
    return std::includes(a.begin(), a.end(), b.begin(), b.end());
}

}  // namespace

std::string profile_case(const Problem& c) {
    Case out = c;
    out.equilibrium->modes = std::max(c.equilibrium->modes.value_or(0), last_m);
    out.expect = {};
    const std::string text = effective_toml(out);
    parse_case(text, {}, c.path);
    return text;
}

std::string lifted_case(const Problem& c, const Result& profile, const std::string& path, std::optional<int> elements) {
    Case out = c.of_surface();
    out.shape = ResultFrame{.path = path};
    out.accuracy.energy = std::max(c.accuracy.energy, accuracy);
    out.discretisation = {};
    out.surface = {};
    out.surface.elements = elements;
    out.expect = {};
    EquilibriumChoices& e = *out.equilibrium;
    e.family.reset(), e.modes.reset();
    e.held = c.held, e.descend = false, e.rates = modes;
    // As tier axisym held them, not as the triangles of the initial shape have them.
    if (holds_area(c.held)) e.area = last(profile, "area");
    if (holds_volume(c.held)) e.volume = last(profile, "volume"), e.reduced_volume.reset();
    if (c.held == Held::reduced_volume) e.reduced_volume = last(profile, "reduced_volume");
    const std::string text = effective_toml(out);
    parse_case(text, {}, c.path);
    return text;
}

EquilibriumEnd equilibrium_end(const Result& profile, const Result& surface) {
    EquilibriumEnd a;
    a.axisym_stop = compare::stop_word(profile), a.stop = compare::stop_word(surface);
    if (!stop_from_name(a.axisym_stop) || !stop_from_name(a.stop))
        throw std::runtime_error("the result is not complete");
    if (a.axisym_stop != name(Stop::finished) || a.stop != name(Stop::finished)) return a;
    a.axisym_energy = last(profile, "energy"), a.energy = last(surface, "energy");
    const double E_ref = compare::reference_energy(surface);
    a.energy_difference = (a.energy - a.axisym_energy) / E_ref;
    a.energy_error = (last(profile, "energy_error") + last(surface, "energy_error")) / E_ref;

    const Rates of_profile = rates_of_profile(profile), of_surface = rates_of_surface(surface);
    const double least_profile = neutral * size_of(of_profile), least = neutral * size_of(of_surface);
    a.axisym_growing = growing(of_profile, least_profile), a.growing = growing(of_surface, least);
    if (!of_surface.empty()) {
        a.m = of_surface.front().first, a.rate = of_surface.front().second;
        for (const auto& [m, rate] : of_profile)
            if (m == a.m) a.axisym_rate = rate;
    }
    // What grows in one tier is at least neutral in the other. With a free period tier axisym has no rates of m = 0.
    std::set<int> allowed = growing(of_profile, -least_profile);
    if (std::isnan(last(profile, "growth_0"))) allowed.insert(0);
    const bool same = includes(growing(of_surface, -least), a.axisym_growing) && includes(allowed, a.growing);
    if (!same || std::abs(a.energy_difference) > 3 * a.energy_error)
        a.verdict = Verdict::other_outcome;
    else
        a.verdict = a.growing.empty() || *a.growing.rbegin() == 0 ? Verdict::agrees : Verdict::symmetry_broken;
    return a;
}
namespace {

using Shape = std::vector<std::size_t>;

// Places on the axes, each from 0 to 1.
std::vector<double> place(const Shape& shape, std::size_t point) {
    std::vector<double> at(shape.size());
    for (std::size_t a = shape.size(); a-- > 0; point /= shape[a])
        at[a] = shape[a] > 1 ? static_cast<double>(point % shape[a]) / static_cast<double>(shape[a] - 1) : 0;
    return at;
}

// Squared, to the nearest of the picks.
double distance(const Shape& shape, std::size_t point, const std::vector<Pick>& picks) {
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

void add_boundary(std::vector<Pick>& picks, const Shape& shape, const std::vector<Outcome>& outcomes,
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

bool is_corner(const Shape& shape, std::size_t point) {
    for (const double part : place(shape, point))
        if (part != 0 && part != 1) return false;
    return true;
}

}  // namespace

std::string_view name(Why why) {
    static constexpr std::string_view names[] = {"boundary", "extreme", "random"};
    return names[static_cast<int>(why)];
}

std::vector<Pick> pick_points(const Shape& shape, const std::vector<Outcome>& outcomes, std::optional<Outcome> around,
                              std::size_t count, unsigned seed) {
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
