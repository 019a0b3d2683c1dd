// A point of a scan of equilibria: one stationary shape.
#include <algorithm>
#include <cmath>
#include <variant>
#include <vector>

#include "axisym/curve/curve_measures.hpp"
#include "axisym/equilibrium/equilibrium_run.hpp"
#include "common/result/frame_profile.hpp"
#include "tools/scan/point.hpp"

namespace tubule {
namespace {

// Points along the whole cell or period.
ProfilePoints points_of(const axisym::Equilibrium& shape) {
    constexpr int intervals = 400;
    const Curve whole = axisym::meridian(*shape.space, shape.x);
    ProfilePoints out{{}, {}, whole.length};
    for (int i = 0; i <= intervals; ++i) {
        const auto at = whole.at(static_cast<double>(i) / intervals);
        out.r.push_back(at[0]), out.z.push_back(at[2]);
    }
    return out;
}

class Interruptible : public RunObserver {
public:
    explicit Interruptible(const std::function<bool()>& interrupted) : interrupted_(interrupted) {}
    bool interrupted() override { return interrupted_(); }

private:
    const std::function<bool()>& interrupted_;
};

Outcome outcome_of_shape(const axisym::Equilibrium& shape, const ProfilePoints& profile, const EndShape& end) {
    if (shape.stop != Stop::finished) return outcome_of(shape.stop, end);
    if (shape.space->topology() == Topology::cell) return cell_at_rest(profile.r, profile.z, end.area, end.volume);
    return outcome_of(Stop::stationary, end);
}

}  // namespace

PointResult equilibrium_point(const Problem& c, const std::function<bool()>& interrupted) {
    Interruptible observer(interrupted);
    const auto [shape, modes, limit, meets_constraints] = axisym::find_shape(c, observer);
    PointResult p = unknown_point(0);
    p.stop = stop_word(shape.stop);
    p.message = shape.stop == Stop::finished ? "the shape is stationary" : shape.message;
    p[Measure::energy_error] = shape.estimated_error;
    p[Measure::E_ref] = shape.reference_energy;
    p[Measure::elements] = shape.space->images() * shape.space->splines().elements();
    if (limit) p[Measure::limit_energy] = limit->energy;
    const bool tube = std::holds_alternative<Tube>(c.shape);
    ProfilePoints profile;
    if (shape.stop == Stop::finished || shape.stop == Stop::self_intersection) {
        profile = points_of(shape);
        const axisym::ShapeMeasures measured = axisym::measures(*shape.space, shape.x);
        p[Measure::energy] = shape.observed.energy;
        p[Measure::area] = shape.observed.area;
        p[Measure::volume] = shape.observed.volume;
        p[Measure::r_max] = measured.r_max;
        if (tube) p[Measure::r_min] = *std::min_element(profile.r.begin(), profile.r.end());
        p[Measure::height] = measured.height;
        p[Measure::tension] = shape.sigma;
        p[Measure::pressure] = -shape.lambda;
    }
    if (meets_constraints)
        p[Measure::free_energy] =
            shape.observed.energy + loads_at(c.law, 0).energy(shape.observed.area, shape.observed.volume, shape.length);
    for (const axisym::ModeRates& mode : modes)
        if (!mode.rates.empty()) p[Measure::growth] = std::fmax(p[Measure::growth], mode.rates.front());
    const EndShape end{tube, p[Measure::r_min], p[Measure::r_max], p[Measure::area], p[Measure::volume]};
    p.outcome = outcome_of_shape(shape, profile, end);
    return p;
}

}  // namespace tubule
