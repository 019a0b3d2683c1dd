#include "tools/run/model_advice.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iterator>
#include <numbers>
#include <optional>
#include <span>
#include <string>

#include "axisym/run.hpp"
#include "common/solve/interrupt.hpp"

namespace tubule {
namespace {

constexpr double simpler_limit = 1;  // seconds of a processor: a busy machine must not change what is advised
constexpr double accuracy = 1e-4;    // of the pilots, or better if the case is
// Measured (docs/decisions/tiers.md, tests/benchmark/model_differences.py): on a length L the viscosity damps like a
// friction of `viscous`/(Re L^2), and slows what friction alone would drive down by the factor 1 + `slower`/(gamma Re
// L^2).
constexpr double viscous = 2, slower = 4.5;

struct Point {
    double time, energy;
};

class Path : public RunObserver {
public:
    explicit Path(const std::vector<std::string>& names)
        : energy_(index(names, "energy")), area_(index(names, "area")), r_max_(index(names, "r_max")) {}
    void row(std::span<const double> values) override {
        if (points.empty()) area = values[area_], r_max = values[r_max_];
        points.push_back({values[0], values[energy_]});
    }
    void discard() override { points.clear(); }
    bool interrupted() override { return tubule::interrupted() || seconds() > simpler_limit; }
    double seconds() const { return static_cast<double>(std::clock() - begin_) / CLOCKS_PER_SEC; }

    double at(double time) const;
    // The largest fall of the energy within this time: what is set in motion lags behind what is not.
    double lag(double tau) const;
    // The largest difference from the path that is slower by this factor.
    double lead(double factor) const;

    std::vector<Point> points;
    double area = 0, r_max = 0;  // at the start

private:
    static std::size_t index(const std::vector<std::string>& names, const char* name) {
        return std::find(names.begin(), names.end(), name) - names.begin();
    }
    std::size_t energy_, area_, r_max_;
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

// The case in tier axisym with this model, whose time is `scale` of that of the case.
Case with_model(const Case& c, ModelKind kind, double scale) {
    Case out = c;
    out.tier = Tier::axisym;
    out.model.kind = kind;
    out.accuracy.energy = std::min(c.accuracy.energy, accuracy);
    out.discretisation = {};
    out.time = {.end = c.time.end * scale, .output = {}, .stationary = {}, .limit = {}};
    return out;
}

std::optional<SimplerModel> compared(const Case& c, ModelKind kind) {
    // Time of the simpler model, of that of the case.
    const double scale = kind == ModelKind::overdamped ? 1 / c.model.gamma : 1;
    const Case simple = with_model(c, kind, scale);
    Path path(axisym::series_names(simple));
    const RunSummary s = axisym::run(simple, path);
    if ((s.stop.reason != Stop::finished && s.stop.reason != Stop::stationary) || path.points.empty()) return {};
    const double length2 = may_have_period(c.shape) ? path.r_max * path.r_max : path.area / (4 * std::numbers::pi);
    const double viscosity = 1 / (c.model.Re * length2);
    const bool inertia = model_entry(c.model.kind).inertia;
    const double tau = inertia ? scale / (c.model.gamma + viscous * viscosity) : 0;
    const double factor = kind == ModelKind::overdamped ? 1 + slower * viscosity / c.model.gamma : 1;
    const double end = path.points.back().time, rest = path.points.back().energy;
    return SimplerModel{kind, (path.lag(tau) + path.lead(factor)) / s.reference_energy,
                        (path.at((end - tau) / factor) - rest) / s.reference_energy, path.seconds()};
}

}  // namespace

std::vector<SimplerModel> simpler_models(const Case& c) {
    const MotionLaw law = motion_law(c.model);
    const bool plain = law.without_loads() && !law.reservoir && !law.free_period;
    if (!model_entry(c.model.kind).viscous || !plain || c.velocity.initial != InitialVelocity::rest) return {};
    std::vector<SimplerModel> out;
    for (const ModelKind kind : {ModelKind::overdamped, ModelKind::stokes}) {
        if (kind == c.model.kind || (kind == ModelKind::overdamped && !(c.model.gamma > 0))) continue;
        if (const auto one = compared(c, kind)) out.push_back(*one);
    }
    return out;
}

}  // namespace tubule
