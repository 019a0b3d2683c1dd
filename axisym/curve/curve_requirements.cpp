#include "axisym/curve/curve_requirements.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "axisym/curve/bead_forms.hpp"
#include "axisym/curve/shape_integrals.hpp"
#include "axisym/splines/arc_length.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/case/read.hpp"
#include "common/run/energy_checks.hpp"

namespace tubule::axisym {

bool is_flat(const Curve& shape) {
    constexpr int points = 64;
    const double z = shape.at(0)[2], size = std::max(shape.at(0)[0], shape.at(1)[0]);
    for (int i = 1; i <= points; ++i)
        if (std::abs(shape.at(static_cast<double>(i) / points)[2] - z) > 1e-6 * size) return false;
    return true;
}

namespace {

// Half a tube, which stands for the whole, has mirror-symmetric formulas.
void require_mirror_symmetry(const Problem& c, const Curve& shape) {
    if (shape.topology != Topology::half_tube) return;
    for (const Potential& p : c.energy.potentials)
        for (int i = 1; i <= 24; ++i) {
            const double z = 0.0203 * shape.length * i, r = 0.6 + 0.07 * i, place[]{r, z}, mirrored[]{r, -z},
                         here = evaluate(*p.formula, place), there = evaluate(*p.formula, mirrored);
            if (std::abs(there - here) > 1e-6 * (1 + std::abs(here)))
                throw complaint(c, "energy.potential",
                                fmt::format("must be mirror-symmetric as tubes in equilibrium are, but a formula is "
                                            "{:.6g} at z = {:.4g} and {:.6g} at z = {:.4g}: try cosines",
                                            here, z, there, -z));
        }
}

}  // namespace

void require_place(const Problem& c, const Curve& shape) {
    constexpr int points = 400;
    const std::vector<Potential>& potentials = c.energy.potentials;
    if (potentials.empty()) return;
    double distance = HUGE_VAL;  // to a wall
    for (int i = 0; i <= points; ++i) {
        const auto at = shape.at(static_cast<double>(i) / points);  // r, r', z, z'
        for (const Potential& p : potentials)
            if (p.is_wall()) distance = std::min(distance, p.distance(at[0], at[2]));
    }
    const bool tube = shape.topology == Topology::tube || shape.topology == Topology::half_tube;
    refuse_potentials(c, tube ? shape.length : 0, bending_energy(shape, c.energy).potential, distance);  // 0 of a torus
    require_mirror_symmetry(c, shape);
}

double bead_distance(const Problem& c, const Curve& shape) {
    constexpr int elements = 100;  // the distance to rounding
    const double width = c.law.beads->width;
    const bool cap = shape.topology == Topology::cap;
    if (shape.topology != Topology::cell && !cap) require_beads(c, false, 0);
    const ArcLength arc(shape);
    const CurveSpace space(shape.topology,
                           refined_at_beads(shape.topology, equal_breaks(elements), width / 2, arc.total()), 5, 4);
    const std::optional<double> foot = cap ? std::optional(shape.at(0)[2]) : std::nullopt;
    const double distance = BeadForms(space, width, foot).distance(fit(space, arc).data());
    require_beads(c, std::isfinite(distance), cap ? arc.total() : distance);
    return distance;
}

void require_patch(const Problem& c, const Curve& shape) {
    if (!is_patch(shape.topology)) return;
    const auto refuse = [&](bool asked, const char* key, const char* why) {
        if (asked) throw complaint(c, key, why);
    };
    refuse(c.energy.kg > 0, "energy.kg", "must be 0 where the shape is a patch");
    refuse(c.energy.alpha.has_value(), "energy.alpha", "must be absent: a patch has no area difference of its own");
    if (c.energy.H0_varies()) throw complaint_about_H0(c, "must be a number where the shape is a patch");
    refuse(c.discretisation.order == 5 && c.discretisation.smoothness == 1, "discretisation.smoothness",
           "must be at least 2 where a patch has splines of order 5: four points per element do not determine them");
    refuse(c.law.reservoir && c.discretisation.parametrisation == Parametrisation::material,
           "discretisation.parametrisation", "must not be \"material\": membrane flows in through the ring");
    refuse(c.velocity.initial == InitialVelocity::rotation, "velocity.initial",
           "must not be \"rotation\": the ring holds the membrane");
    refuse(c.held == Held::reduced_volume && c.is_equilibrium(), "equilibrium.held",
           "must not be \"reduced-volume\", which is that of a closed surface");
    const char* holds = c.is_equilibrium() ? "equilibrium.held" : "model.area";
    const bool area = c.is_equilibrium() ? holds_area(c.held) : !c.law.area_is_free();
    refuse(area && is_flat(shape), holds, "must leave the area free where the patch is flat: give shape.height");
    const auto* patch = std::get_if<Patch>(&c.shape);
    const bool alike = patch && patch->second_radius.value_or(patch->radius) == patch->radius;
    refuse(alike && c.is_equilibrium() && c.held == Held::area_and_volume, holds,
           "must leave the area or the volume free: of a part of a sphere or a cylinder they are one condition");
}

}  // namespace tubule::axisym
