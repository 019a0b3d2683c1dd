#include "surface3d/run/guards.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "common/geometry/profile_point.hpp"
#include "common/run/stops.hpp"
#include "surface3d/mesh/curved_intersection.hpp"

namespace tubule::surface3d {

std::optional<StopReport> find_fold(const MeshQuality& quality) {
    if (quality.worst > 0) return std::nullopt;
    return StopReport{Stop::mesh_lost, 0,
                      fmt::format("triangle {} folds at {}", quality.worst_cell, words_of_place(quality.where, 6)),
                      "use more elements, or discretisation.mesh = \"graded\""};
}

std::optional<StopReport> find_impossible_curvature(const Observables& o, const CurvedMesh& mesh, double allowed) {
    const std::string advice = "use more elements, or another discretisation.recovery";
    if (mesh.period == 0 && !(o.integral_H2 >= (1 - allowed) * willmore_bound))
        return StopReport{Stop::resolution_lost, 0,
                          fmt::format("INT H^2 = {:.6g} is below 16 pi = {:.6g}, which no closed surface can have",
                                      o.integral_H2, willmore_bound),
                          advice};
    const double defect = gauss_bonnet_defect(o, mesh);
    const int surplus = mesh.period == 0 ? std::abs(euler_characteristic(mesh)) : 0;
    if (!(std::abs(defect) <= allowed * 2 * pi * std::max(2, surplus)))
        return StopReport{Stop::resolution_lost, 0,
                          fmt::format("INT K = {:.6g} differs by {:.3g} from 2 pi times the Euler characteristic {}",
                                      o.integral_K, defect, euler_characteristic(mesh)),
                          advice};
    return std::nullopt;
}

std::optional<StopReport> find_self_intersection(const CurvedMesh& mesh) {
    const auto at = first_intersection(mesh);
    if (!at) return std::nullopt;
    return StopReport{Stop::self_intersection, 0, "the surface intersects itself near " + words_of_place(*at),
                      "contact is not modelled: later results are invalid"};
}

namespace {

// Measured choices: docs/decisions/surface_motion.md, "Surfaces in motion".
constexpr double creep = 10;    // increase since its lowest, of the asked accuracy
constexpr double climb = 0.25;  // increase of the energy in a step, of the asked accuracy
constexpr double worst_quality = 0.03, sharpest_turn = 2;

// A neck that becomes too thin for its triangles closes; one that is too thin initially may open.
StopReport find_sharp_turn(const MeshTurn& turn, double time) {
    const bool closes = turn.saddle && time > 0;
    return {closes ? Stop::pinch_off : Stop::resolution_lost, time,
            fmt::format("{} at {}: the normal turns by {:.2g} radians from node to node",
                        closes        ? "a neck is closing"
                        : turn.saddle ? "a neck is too thin for the triangles"
                                      : "the surface bends too sharply",
                        words_of_place(turn.where), turn.angle),
            closes ? "use more elements to follow the neck further" : "use more elements"};
}

}  // namespace

StopReport undefined_energy(const MotionMeasures& m, double time) {
    return tubule::undefined_energy(m.domain, time, words_of_place(m.least_defined));
}

double least_neck(const Problem& c, double area) {
    const bool by_size = std::holds_alternative<MeshFile>(c.shape) && !c.places.contains("accuracy.r_min");
    return c.accuracy.r_min * (by_size ? std::sqrt(area / (4 * pi)) : 1);
}

std::optional<StopReport> find_bad_shape(const MotionMeasures& m, double r_min, double time) {
    if (!(m.symbol > 0)) return ill_posed(words_of_place(m.least_symbol), time);
    if (m.domain.is_small()) return undefined_energy(m, time);
    if (m.pressure_domain.is_small()) return undefined_pressure(m.pressure_domain, time);
    if (!(m.wall.value > 0)) return behind_wall(words_of_place(m.wall.where), time);
    if (!(m.neck_radius >= r_min)) return neck_closed(m.neck_radius, words_of_place(m.narrowest), time);
    if (!(m.turn.angle <= sharpest_turn)) return find_sharp_turn(m.turn, time);
    if (!(m.quality.worst > worst_quality))
        return StopReport{Stop::mesh_lost, time,
                          fmt::format("a triangle at {} has quality {:.2g} (1: equilateral)",
                                      words_of_place(m.quality.where), m.quality.worst),
                          "use more elements or a shorter discretisation.relaxation"};
    return std::nullopt;
}

std::optional<StopReport> find_coarse_place(const MotionMeasures& m, double most, double time) {
    if (m.coarse_wave.value > 1)
        return unresolved_waves(fmt::format("near {} the distance of nodes is", words_of_place(m.coarse_wave.where)),
                                m.coarse_wave.value, time, "use more elements");
    const bool at_wall = m.coarse_wall.value >= m.coarse_bead.value;
    const Coarseness& coarse = at_wall ? m.coarse_wall : m.coarse_bead;
    if (!(coarse.value > most)) return std::nullopt;
    return StopReport{
        Stop::resolution_lost, time,
        fmt::format("near {} nodes are {:.2g} times {} apart, and may be {:.2g} times", words_of_place(coarse.where),
                    coarse.value, at_wall ? "the range of the wall there" : "model.bead_width", most),
        at_wall ? "use more elements; a longer range needs fewer" : "use more elements; wider beads need fewer"};
}

std::optional<StopReport> find_rise_in_step(double rise, double asked, double time, double step) {
    if (rise <= climb * asked) return std::nullopt;
    return StopReport{
        Stop::resolution_lost, time,
        fmt::format("the energy increased by {:.3g} of E_ref in a step of {:.3g}, which the model forbids", rise, step),
        "use more elements, a looser accuracy.energy, or a smaller discretisation.step where one is given"};
}

std::optional<StopReport> find_slow_rise(double rise, double asked, double time) {
    if (rise <= creep * asked) return std::nullopt;
    return StopReport{
        Stop::resolution_lost, time,
        fmt::format("the energy gradually increased by {:.3g} of E_ref, which the model forbids", rise),
        "use more elements, a looser accuracy.energy, or a smaller discretisation.step where one is given"};
}

std::optional<StopReport> find_impossible_motion(const Observables& o, const CurvedMesh& mesh, double allowed,
                                                 double time) {
    auto found = find_impossible_curvature(o, mesh, allowed);
    if (found) found->time = time, found->advice = "use more elements, or another discretisation.order";
    return found;
}

std::optional<StopReport> find_drift(double change, double asked, double time) {
    if (std::abs(change) <= most_drift * asked) return std::nullopt;
    if (!std::isfinite(change))
        return StopReport{Stop::resolution_lost, time, "the volume is not finite", "use more elements"};
    return StopReport{
        Stop::resolution_lost, time,
        fmt::format("the relative volume drift is {:.3g}: on so few triangles, keeping the area does not keep the "
                    "volume",
                    std::abs(change)),
        "use more elements"};
}

}  // namespace tubule::surface3d
