#include "tools/run/model_advice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iterator>
#include <numbers>
#include <optional>
#include <span>
#include <string>

#include "common/case/read.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse.hpp"
#include "surface3d/run/motion_settings.hpp"
#include "tools/auto/choice.hpp"
#include "tools/run/engine.hpp"

namespace tubule {
namespace {

// What a pilot may take, in rows (of all its runs) and, should these be slow, in seconds of a processor. A choice of
// the model must be the same each time: rows are counted first.
constexpr int most_rows = 20000, most_rows_of_surface = 600;
constexpr double most_seconds = 20;
// Of the fall of the energy, to see whether it speeds up: what grows from little is late by far more than the criterion
// says, since its delays add up.
constexpr double least_parts = 20, most_parts = 1000;
constexpr double rounding = 1e-12;  // of an energy
constexpr double accuracy = 1e-4;   // of the pilots in tier axisym, or better if the case is
constexpr double accuracy_of_surface = 1e-2;
// Measured (docs/decisions/tiers.md, tests/studies/benchmark/model_differences.py): on a length L the viscosity damps like a
// friction of `viscous`/(Re L^2), and slows what friction alone would drive down by the factor 1 + `slower`/(gamma Re
// L^2).
constexpr double viscous = 2, slower = 4.5;

struct Point {
    double time, energy;
};

class Path : public RunObserver {
public:
    Path(const std::vector<std::string>& names, int most_rows)
        : energy_(index(names, "energy")),
          area_(index(names, "area")),
          r_max_(index(names, "r_max")),
          most_rows_(most_rows) {}
    void row(std::span<const double> values) override {
        ++rows_;
        if (points.empty()) area = values[area_], r_max = values[r_max_];
        points.push_back({values[0], values[energy_]});
    }
    void discard() override { points.clear(); }
    bool interrupted() override { return switched || rows_ > most_rows_ || seconds() > most_seconds; }
    // Tier "auto" tells that it goes on in three dimensions.
    void note(const std::string&) override { switched = switched || !points.empty(); }
    double seconds() const { return static_cast<double>(std::clock() - begin_) / CLOCKS_PER_SEC; }

    double at(double time) const;
    // The largest fall of the energy within this time: what is set in motion lags behind what is not.
    double lag(double tau) const;
    // The largest difference from the path that is slower by this factor.
    double lead(double factor) const;

    // Whether the energy, falling by steps of `part` > 0, needs less than half the time of an earlier step for one of
    // them.
    bool speeds_up(double part) const;
    double fall() const { return points.front().energy - points.back().energy; }
    // Nothing moves: the energy falls by no more than rounding.
    bool rests() const { return !(fall() > rounding * std::abs(points.front().energy)); }

    std::vector<Point> points;
    double area = 0, r_max = 0;  // at the start
    bool switched = false;

private:
    static std::size_t index(const std::vector<std::string>& names, const char* name) {
        return std::find(names.begin(), names.end(), name) - names.begin();
    }
    std::size_t energy_, area_, r_max_;
    int rows_ = 0, most_rows_;
    std::clock_t begin_ = std::clock();
};

double Path::at(double time) const {
    const auto after =
        std::upper_bound(points.begin(), points.end(), time, [](double t, const Point& p) { return t < p.time; });
    if (after == points.begin()) return points.front().energy;
    const Point& a = *std::prev(after);
    if (after == points.end()) return a.energy;
    return std::lerp(a.energy, after->energy, (time - a.time) / (after->time - a.time));
}

double Path::lag(double tau) const {
    double largest = 0;
    for (const Point& p : points) largest = std::max(largest, p.energy - at(p.time + tau));
    return largest;
}

double Path::lead(double factor) const {
    double largest = 0;
    for (const Point& p : points) largest = std::max(largest, at(p.time / factor) - p.energy);
    return largest;
}

bool Path::speeds_up(double part) const {
    const double top = points.front().energy;
    double since = points.front().time, longest = 0;
    const Point* before = &points.front();
    int parts = 1;
    for (const Point& p : points) {
        // More parts than there are in the whole fall would only be counted where the energy rises again.
        for (; parts <= 2 * most_parts && p.energy <= top - parts * part; ++parts) {
            const double level = top - parts * part;
            const double along = (before->energy - level) / (before->energy - p.energy);
            const double time = std::lerp(before->time, p.time, along);
            if (time - since < longest / 2) return true;
            longest = std::max(longest, time - since), since = time;
        }
        before = &p;
    }
    return false;
}

// The case with this model in the tier that shows its path: tier axisym; of starts that may leave it, tier "auto"; of
// others, few triangles.
Case pilot_of(const Case& c, ModelKind kind, bool axisymmetric) {
    Case out = c;
    out.model.kind = kind;
    out.time = {.end = c.time.end, .output = {}, .stationary = {}, .limit = {}};
    out.discretisation = {}, out.surface = {};
    if (axisymmetric) {
        out.accuracy.energy = std::min(c.accuracy.energy, accuracy);
        if (c.tier != Tier::axisym) out.tier = Tier::automatic;
        return out;
    }
    out.tier = Tier::surface3d;
    out.surface.elements = surface3d::least_triangles;
    out.accuracy.energy = std::max(c.accuracy.energy, accuracy_of_surface), out.accuracy.estimate = false;
    return out;
}

std::optional<SimplerModel> compared(const Case& c, ModelKind kind, bool axisymmetric) {
    const Case simple = pilot_of(c, kind, axisymmetric);
    const auto engine = engine_for(simple);
    Path path(engine->series_names(), axisymmetric ? most_rows : most_rows_of_surface);
    RunSummary s;
    try {
        s = engine->run(path);
    } catch (const SolveError&) {
        return {};
    }
    pause_if_due();
    if ((s.stop.reason != Stop::finished && s.stop.reason != Stop::stationary) || path.points.empty()) return {};
    if (path.rests()) return SimplerModel{.kind = kind, .seconds = path.seconds(), .rests = true};
    if (path.speeds_up(std::clamp(c.accuracy.energy * s.reference_energy / 2, path.fall() / most_parts,
                                  path.fall() / least_parts)))
        return SimplerModel{kind, HUGE_VAL, HUGE_VAL, path.seconds()};
    const double length2 = may_have_period(c.shape) ? path.r_max * path.r_max : path.area / (4 * std::numbers::pi);
    const double viscosity = 1 / (c.model.Re * length2), gamma = motion_law(c.model).friction;
    const double tau = model_entry(c.model.kind).inertia ? 1 / (gamma + viscous * viscosity) : 0;
    const double factor = kind == ModelKind::overdamped ? 1 + slower * viscosity / gamma : 1;
    const double end = path.points.back().time, rest = path.points.back().energy;
    return SimplerModel{kind, (path.lag(tau) + path.lead(factor)) / s.reference_energy,
                        (path.at((end - tau) / factor) - rest) / s.reference_energy, path.seconds()};
}

// Why a path does not tell; empty if it does.
std::string untold(const Case& c, const Choice& choice) {
    const MotionLaw law = motion_law(c.model);
    if (c.velocity.initial != InitialVelocity::rest) return "the case gives a velocity";
    if (law.reservoir || law.free_period || !law.without_loads())
        return "loads, a reservoir or a free period act on the membrane";
    if (c.energy.H0_varies() && c.tier != Tier::axisym) return "energy.H0 varies";
    if (!choice.axisymmetric && !choice.start->resizable()) return "the start brings its own triangles";
    return {};
}

std::string two_digits(double value) {
    return fmt::format("{:.2g}", value);
}

}  // namespace

SimplerModels simpler_models(const Case& c) {
    if (!model_entry(c.model.kind).viscous) return {{}, "no model is simpler"};
    const Choice choice = c.tier == Tier::axisym ? Choice{} : choice_for(c);
    if (std::string why = untold(c, choice); !why.empty()) return {{}, std::move(why)};
    SimplerModels out;
    for (const ModelKind kind : {ModelKind::overdamped, ModelKind::stokes}) {
        if (kind == c.model.kind || (kind == ModelKind::overdamped && !(motion_law(c.model).friction > 0))) continue;
        const auto one = compared(c, kind, choice.axisymmetric);
        if (one && std::isinf(one->on_the_way)) return {{}, "the fall of the energy speeds up, as where waves grow"};
        if (one) out.models.push_back(*one);
        if (one && one->rests) return out;
    }
    if (out.models.empty())
        out.unknown = choice.axisymmetric && c.tier != Tier::axisym
                          ? "trial runs of simpler models do not come to the end as axisymmetric ones"
                          : "trial runs of simpler models do not come to the end";
    return out;
}

ModelChoice choose_model(const Case& c) {
    Case full = c;
    if (c.model.kind == ModelKind::automatic) full.model.kind = ModelKind::fluid;
    const auto simpler = simpler_models(full);
    if (!simpler.unknown.empty())
        return {full.model.kind, "whether a simpler model does is unknown: " + simpler.unknown, true};
    for (const SimplerModel& m : simpler.models)
        if (m.rests || m.on_the_way <= c.accuracy.energy)
            return {m.kind,
                    m.rests ? fmt::format("nothing moves in a trial run of \"{}\"", model_entry(m.kind).name)
                            : fmt::format("the path of \"{}\" differs by about {} of E_ref from that of \"{}\"",
                                          model_entry(m.kind).name, two_digits(m.on_the_way), name(full.model)),
                    false, m.seconds};
    const SimplerModel& best = *std::ranges::min_element(simpler.models, {}, &SimplerModel::on_the_way);
    return {full.model.kind,
            fmt::format("model \"{}\" would differ by about {} of E_ref on the way, by {} at the end",
                        model_entry(best.kind).name, two_digits(best.on_the_way), two_digits(best.at_end))};
}

ChosenCase with_model(const Case& c, const ModelChoice& choice) {
    std::vector<std::string> sets = c.sets;
    sets.push_back(fmt::format("model.chosen={}", model_entry(choice.kind).name));
    return {parse_case(c.text, sets, c.path, inputs_of(c)), choice.reason, 0};
}

ChosenCase with_chosen_model(const Case& c) {
    if (c.model.kind != ModelKind::automatic) return {c, "", 0};
    const PauseWatch watch(c.time.limit, interrupted);
    const double before = watch.seconds();
    ChosenCase out = with_model(c, choose_model(c));
    out.seconds = watch.seconds() - before;
    return out;
}

std::string words_of_choice(const ChosenCase& chosen) {
    return fmt::format("model {}: {}", name(chosen.c.model), chosen.reason);
}

}  // namespace tubule
