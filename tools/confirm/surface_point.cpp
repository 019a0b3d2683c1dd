#include "tools/confirm/surface_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <stdexcept>

#include "common/case/read.hpp"
#include "common/theory/waves.hpp"
#include "surface3d/surface_modes.hpp"

namespace tubule::confirm {
namespace {

constexpr int most_waves = 20;         // along a tube: shorter ones are not added
constexpr int frames = 10;             // after the start, evenly in time
constexpr int more_n = 2, most_m = 3;  // waves that are looked for beside those that were added

constexpr double rough = 0.05;          // accuracy of the energy: few triangles are not worth finer steps
constexpr double thinnest_neck = 1e-2;  // that triangles are asked to follow

bool at_rest(Outcome outcome) {
    return outcome == Outcome::uniform_tube || outcome == Outcome::unduloid || outcome == Outcome::sphere ||
           outcome == Outcome::closed;
}

double radius_of_start(const Tube& tube) {
    double radius = tube.radius;
    for (const TubeMode& mode : tube.modes)
        if (mode.n == 0 && mode.m == 0) radius += mode.amplitude * std::cos(mode.phase);
    return radius;
}

// The tension of the membrane that is the straight tube of this radius. Where area and volume are both kept, that of
// the waves at the start of the case decides, if there are any.
double tension(const Case& c, double radius) {
    const auto& tube = std::get<Tube>(c.shape);
    if (c.model.kind == ModelKind::gradient_flow) return 0;
    if (!theory::keeps_volume(c.model)) return theory::tension_of_free_volume(c.energy, radius);
    std::map<std::pair<int, int>, double> amplitudes;
    for (const TubeMode& mode : tube.modes)
        if (mode.amplitude != 0 && (mode.n != 0 || mode.m != 0))
            amplitudes[{mode.n, mode.m}] = std::hypot(amplitudes[{mode.n, mode.m}], mode.amplitude);
    if (amplitudes.empty()) return theory::tension_of_free_volume(c.energy, radius);
    std::vector<theory::Wave> waves;
    for (const auto& [wave, amplitude] : amplitudes) waves.push_back({wave.first, wave.second, amplitude, 0});
    return theory::tension_of_waves({c.energy, radius, 0}, c.model, tube.length, waves);
}

// The one that grows fastest or decays slowest, rigid motions and the change of radius left out.
theory::FittingWave fastest(const theory::UniformTube& tube, const Model& model, double length, int m) {
    theory::FittingWave best{0, m, 0, -std::numeric_limits<double>::infinity()};
    for (int n = m < 2 ? 1 : 0; n <= most_waves; ++n) {
        const double q = 2 * std::numbers::pi * n / length, rate = theory::growth(tube, model, q, m).rate();
        if (std::isfinite(rate) && rate > best.rate) best = {n, m, q, rate};
    }
    return best;
}

double largest_radius(const Case& c) {
    if (const auto* tube = std::get_if<Tube>(&c.shape)) return radius_of_start(*tube);
    return std::get<Sphere>(c.shape).radius;
}

// Relative to the radius, as those of a sphere are by themselves.
double amplitude(const surface3d::CurvedMesh& mesh, const Case& c, AddedWave wave) {
    if (std::holds_alternative<Sphere>(c.shape)) return surface3d::sphere_mode_amplitude(mesh, wave.n, wave.m);
    return surface3d::tube_mode_amplitude(mesh, wave.n, wave.m) / surface3d::tube_mode_amplitude(mesh, 0, 0);
}

// All waves with m >= 1 that are looked for, but for a tube that is moved or turned as a whole.
std::vector<AddedWave> watched(const Case& c, const std::vector<AddedWave>& added) {
    int highest = 0;
    for (const AddedWave& wave : added) highest = std::max(highest, wave.n);
    const bool tube = std::holds_alternative<Tube>(c.shape);
    std::vector<AddedWave> waves;
    for (int m = 1; m <= most_m; ++m)
        for (int n = tube ? (m == 1 ? 1 : 0) : std::max(m, 2); n <= highest + more_n; ++n) waves.push_back({n, m});
    return waves;
}

double value_at(const std::vector<double>& times, const std::vector<double>& values, double t) {
    const auto later = std::lower_bound(times.begin(), times.end(), t);
    if (later == times.end()) return values.back();
    const auto i = static_cast<std::size_t>(later - times.begin());
    if (i == 0 || times[i] == times[i - 1]) return values[i];
    return values[i - 1] + (values[i] - values[i - 1]) * (t - times[i - 1]) / (times[i] - times[i - 1]);
}

const Value* find(const About& about, std::string_view key) {
    for (const auto& [name, value] : about)
        if (name == key) return &value;
    return nullptr;
}
double number(const About& about, std::string_view key) {
    const Value* value = find(about, key);
    const double* number = value ? std::get_if<double>(value) : nullptr;
    return number ? *number : std::numeric_limits<double>::quiet_NaN();
}

// What became of it, if its symmetry held. A run that goes on to the end has come to rest if the one in tier 1 has.
Outcome outcome_in_3d(const Case& c, const PointResult& axisymmetric, Stop stop, const Result& surface) {
    const EndShape end{std::holds_alternative<Tube>(c.shape), surface.series.at("r_min").back(),
                       surface.series.at("r_max").back(), surface.series.at("area").back(),
                       surface.series.at("volume").back()};
    const bool rests = stop == Stop::finished && axisymmetric.outcome != Outcome::undecided;
    return outcome_of(rests ? Stop::stationary : stop, end);
}

}  // namespace

std::vector<AddedWave> added_waves(const Case& c, const PointResult& axisymmetric) {
    if (std::holds_alternative<Sphere>(c.shape)) return {{2, 1}, {2, 2}, {3, 1}};
    const auto* tube = std::get_if<Tube>(&c.shape);
    if (!tube)
        throw CaseError(c.path + ": only tubes and spheres are confirmed: waves cannot be added to another shape");
    std::vector<AddedWave> waves{{1, 1}, {1, 2}};
    for (const Explanation& one : explain(c, axisymmetric))
        for (const theory::FittingWave& wave : one.waves) {
            const bool there = std::any_of(waves.begin(), waves.end(),
                                           [&](const AddedWave& w) { return w.n == wave.n && w.m == wave.m; });
            if (wave.m > 0 && !there) waves.push_back({wave.n, wave.m});
        }
    return waves;
}

std::string surface_case(const Case& c, const std::vector<AddedWave>& waves, const Choices& choices) {
    Case s = c;
    s.tier = Tier::surface3d;
    s.accuracy.r_min = std::max(c.accuracy.r_min, thinnest_neck);
    s.accuracy.energy = std::max(c.accuracy.energy, rough);
    s.discretisation = {};
    s.surface = {};
    s.surface.elements = choices.elements;
    s.expect = {};
    s.time.stationary.reset();
    s.time.end = choices.end.value_or(c.time.end);
    s.time.output.clear();
    for (int i = 1; i < frames; ++i) s.time.output.push_back(s.time.end * i / frames);
    double phase = 0;  // each its own, so that no mirror is left
    for (const AddedWave& wave : waves) {
        if (auto* tube = std::get_if<Tube>(&s.shape))
            tube->modes.push_back({choices.noise * largest_radius(c), wave.n, wave.m, phase += 1});
        else
            std::get<Sphere>(s.shape).modes.push_back({choices.noise, wave.n, wave.m});
    }
    const std::string text = effective_toml(s);
    parse_case(text, {}, c.path);  // what is no case is refused before anything is run
    return text;
}

std::string_view name(Verdict verdict) {
    static constexpr std::string_view names[] = {"agrees", "symmetry-broken", "wave-grows", "other-outcome",
                                                 "no-answer"};
    return names[static_cast<int>(verdict)];
}

Answer answer(const Case& c, const PointResult& axisymmetric, const std::vector<AddedWave>& waves,
              const Result& surface) {
    const Value* stop = find(surface.about, "stop");
    if (!stop || surface.frames.empty()) throw std::runtime_error("the result is not complete");
    Answer a;
    a.stop = stop_from_name(std::get<std::string>(*stop)).value();
    const auto& times = surface.series.at("time");
    a.time = times.back();
    a.energy_error = number(surface.about, "estimated_error");
    const double common = std::min(axisymmetric[Measure::time], a.time);
    // Before tier 1's own end its energy is not kept.
    a.energy_difference = common < axisymmetric[Measure::time]
                              ? std::numeric_limits<double>::quiet_NaN()
                              : (value_at(times, surface.series.at("energy"), common) - axisymmetric[Measure::energy]) /
                                    axisymmetric[Measure::E_ref];
    const auto mesh_of = [&](const Record& frame) {
        return surface3d::frame_surface(frame, surface.meshes.at(frame.mesh.value()));
    };
    const auto first = mesh_of(surface.frames.front()), last = mesh_of(surface.frames.back());
    for (const AddedWave& wave : waves) a.noise = std::hypot(a.noise, amplitude(first, c, wave));
    for (const AddedWave& wave : watched(c, waves))
        if (const double size = amplitude(last, c, wave); size > a.amplitude) a.largest = wave, a.amplitude = size;
    a.outcome = outcome_in_3d(c, axisymmetric, a.stop, surface);
    const bool grows = a.amplitude > growing * a.noise;
    if (grows && a.amplitude > large_wave)
        a.verdict = Verdict::symmetry_broken;
    else if (a.outcome == Outcome::failed || a.stop == Stop::time_limit)
        a.verdict = Verdict::no_answer;
    else if (grows)
        a.verdict = Verdict::wave_grows;
    else
        a.verdict = a.outcome == axisymmetric.outcome ? Verdict::agrees : Verdict::other_outcome;
    return a;
}

std::vector<Explanation> explain(const Case& c, const PointResult& axisymmetric) {
    const auto* tube = std::get_if<Tube>(&c.shape);
    if (!tube) return {};
    std::vector<double> radii{radius_of_start(*tube)};
    const double end = std::sqrt(axisymmetric[Measure::volume] / (std::numbers::pi * tube->length));
    if (at_rest(axisymmetric.outcome) && std::abs(end - radii[0]) > large_wave * radii[0]) radii.push_back(end);
    std::vector<Explanation> all;
    for (const double radius : radii) {
        Explanation one{radius, tension(c, radius), {}};
        for (int m = 0; m <= 2; ++m)
            one.waves.push_back(fastest({c.energy, radius, one.tension}, c.model, tube->length, m));
        all.push_back(one);
    }
    return all;
}

}  // namespace tubule::confirm
