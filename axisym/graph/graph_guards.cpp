#include "axisym/graph/graph_guards.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/run/stops.hpp"

namespace tubule::axisym {
namespace {

constexpr double overhang_steepness = 30;  // see Observation::steepness
constexpr double symbol_lost = 1e-3;       // of the initial one; on the way to 0 the solution loses its smoothness

}  // namespace

std::span<const GraphGuard> graph_guards() {
    static const GraphGuard list[]{
        {[](const Observation& o, const GraphLimits& limits) { return o.r_min - limits.r_min; },
         [](const Observation& o, const GraphMesh& mesh, const double*, double time) {
             return neck_closed(o.r_min, fmt::format("z = {:.6g}", mesh.place(o.z_min)), time);
         }},
        {[](const Observation& o, const GraphLimits&) { return overhang_steepness - o.steepness; }, overhang},
        {[](const Observation& o, const GraphLimits& limits) { return o.symbol - limits.least_symbol; },
         [](const Observation& o, const GraphMesh& mesh, const double*, double time) {
             return StopReport{
                 Stop::ill_posed, time,
                 fmt::format("the flow lost its well-posedness at z = {:.6g}: f_HH + 2 f_HK x + f_KK x^2 fell to "
                             "{:.3g} at x = kappa_theta",
                             mesh.place(o.z_symbol), o.symbol),
                 "refinement does not help: the energy does not resist short waves there"};
         }},
        {[](const Observation& o, const GraphLimits&) { return 1 - o.coarse; },
         [](const Observation& o, const GraphMesh& mesh, const double*, double time) {
             return unresolved_waves(fmt::format("an element near z = {:.6g} is", mesh.place(o.z_coarse)), o.coarse,
                                     time, "use a tighter accuracy.energy, or set discretisation.elements");
         }},
        {[](const Observation& o, const GraphLimits&) { return o.domain.is_small() ? -1 : 1.0; },
         [](const Observation& o, const GraphMesh& mesh, const double*, double time) {
             return undefined_energy(o.domain, time, fmt::format("z = {:.6g}", mesh.place(o.domain.place)));
         }}};
    return list;
}

StopReport overhang(const Observation& o, const GraphMesh& mesh, const double* x, double time) {
    const double steepness = std::abs(mesh.space.evaluate(x, mesh.space.element_at(o.z_steep), o.z_steep)[1]);
    return {Stop::overhang, time,
            fmt::format("the profile r(z) turned vertical at z = {:.6g} (|r'| = {:.3g} away from a neck)",
                        mesh.place(o.z_steep), steepness),
            "the shape is about to overhang, which a graph r(z) cannot follow; the results until here are valid"};
}

bool is_about_to_overhang(const Observation& o) {
    return o.steepness > overhang_steepness / 4;
}

// A symbol that cannot change its sign may come arbitrarily close to 0.
double least_symbol_of(const Bending& energy, const Observation& o) {
    return symbol_may_vanish(energy) ? symbol_lost * o.symbol : 0;
}

}  // namespace tubule::axisym
