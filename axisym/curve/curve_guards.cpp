#include "axisym/curve/curve_guards.hpp"

#include <fmt/format.h>

#include <cmath>

#include "axisym/curve/curve_measures.hpp"
#include "common/run/stops.hpp"

namespace tubule::axisym {
namespace {

constexpr double steepest = 3;  // largest curvature times element length: beyond it the curve is not resolved
// Longest element at a wall over its range, or at a bead over its width: half of it, of the finer of two runs.
constexpr double coarsest = 0.75;
constexpr double stretched = 1e-3;  // least over largest |X_s|

}  // namespace

std::span<const CurveGuard> curve_guards() {
    static const CurveGuard list[]{
        {[](const Snapshot& s, double r_min) { return std::isfinite(s.neck.radius) ? s.neck.radius - r_min : 1; },
         [](const Snapshot& s, double time) {
             return neck_closed(s.neck.radius, fmt::format("z = {:.6g}", s.neck.z), time);
         }},
        {[](const Snapshot& s, double) { return s.o.symbol; },
         [](const Snapshot& s, double time) { return ill_posed(fmt::format("s = {:.4g}", s.o.s_symbol), time); }},
        {[](const Snapshot& s, double) { return s.o.domain.is_small() ? -1 : 1.0; },
         [](const Snapshot& s, double time) {
             return undefined_energy(s.o.domain, time, fmt::format("s = {:.4g}", s.o.domain.place));
         }},
        {[](const Snapshot& s, double) { return s.o.potential.distance; },
         [](const Snapshot& s, double time) {
             return behind_wall(fmt::format("s = {:.4g}", s.o.potential.s_distance), time);
         }},
        {[](const Snapshot& s, double) { return s.pressure_domain.is_small() ? -1 : 1.0; },
         [](const Snapshot& s, double time) { return undefined_pressure(s.pressure_domain, time); }},
        {[](const Snapshot& s, double) { return s.o.g_min / s.o.g_max - stretched; },
         [](const Snapshot& s, double time) {
             return StopReport{Stop::mesh_lost, time,
                               fmt::format("the parametrisation speed varies by a factor {:.3g} along the profile",
                                           s.o.g_max / s.o.g_min),
                               "set discretisation.parametrisation = \"even\", which a number for energy.H0 allows"};
         }}};
    return list;
}

std::optional<StopReport> find_bad_profile(const CurveSpace& space, const Eigen::VectorXd& x, const Snapshot& s,
                                           double time) {
    if (const auto crossing = self_intersection(space, x)) {
        const CurveSample p = space.evaluate(x, (*crossing)[0]);
        return StopReport{
            Stop::self_intersection, time,
            fmt::format("the profile intersects itself or crosses the axis at r = {:.4g}, z = {:.4g}", p.r, p.z),
            "contact is not modelled: later results are invalid"};
    }
    if (const PotentialObservation& potential = s.o.potential; potential.coarse > coarsest)
        return StopReport{
            Stop::resolution_lost, time,
            fmt::format("an element near s = {:.4g} is {:.2g} times as long as the range of the wall there",
                        potential.s_coarse, potential.coarse),
            "use a tighter accuracy.energy, or set discretisation.elements; a longer range needs fewer elements"};
    if (s.coarse_bead > coarsest)
        return StopReport{
            Stop::resolution_lost, time,
            fmt::format("an element near a bead is {:.2g} times as long as model.bead_width", s.coarse_bead),
            "use a tighter accuracy.energy, or set discretisation.elements; wider beads need fewer elements"};
    if (s.o.coarse > 1)
        return unresolved_waves(fmt::format("an element near s = {:.4g} is", s.o.s_coarse), s.o.coarse, time,
                                "use a tighter accuracy.energy, or set discretisation.elements");
    const std::vector<double>& breaks = space.splines().breaks();
    const int e = space.splines().element_at(s.o.s_curvature);
    const double turn = s.o.curvature * s.o.g_max * (breaks[e + 1] - breaks[e]);
    if (turn <= steepest) return std::nullopt;
    return StopReport{
        Stop::resolution_lost, time,
        fmt::format("the tangent rotates across one element by {:.2g} radians near s = {:.4g}", turn, s.o.s_curvature),
        "use a tighter accuracy.energy, or set discretisation.elements"};
}

}  // namespace tubule::axisym
