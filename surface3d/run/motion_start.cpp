#include "surface3d/run/motion_start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/case/read.hpp"
#include "common/run/energy_checks.hpp"
#include "surface3d/fem/places.hpp"

namespace tubule::surface3d {
namespace {

// Measured choices: docs/decisions/surface_motion.md, "Surfaces in motion".
constexpr double relaxes_in = 0.2;   // of the time that the shape needs to change
constexpr double much_finer = 2.25;  // times more triangles: by this, errors of the initial energy fall at least
// H counts as constant if it varies by less than this, or by `times_noise` times the difference of two recoveries.
constexpr double same_everywhere = 1e-9, times_noise = 4;

// The time that the model needs to change the shape as a whole, from what drives it (E/R^2) and what resists.
double time_to_change(const MotionLaw& law, const Observables& o, bool closed, double energy) {
    const double R = (closed ? 3 : 2) * std::abs(o.volume) / o.area;
    const double drive = energy / o.area;
    return (law.friction * R * R + law.viscosity) / drive + std::sqrt(law.inertia * R * R / drive);
}

// theory.md (11.1)
double own_scale(const Problem& c, const Observables& o, double length) {
    return std::max(std::abs(free_energy(c, o, length)), o.magnitude + load_scale(c.law, o.area, o.volume, length));
}

}  // namespace

VectorField start_velocity(const Problem& c, const StartMesh& start) {
    if (start.velocity.size() > 0 || c.velocity.initial != InitialVelocity::rotation) return start.velocity;
    VectorField u = VectorField::Zero(3, start.mesh.size());
    for (int i = 0; i < start.mesh.size(); ++i) {
        const Eigen::Vector3d& x = start.mesh.nodes[i];
        u.col(i) = c.velocity.omega * Eigen::Vector3d(-x.y(), x.x(), 0);
    }
    return u;
}

Observables observe_start(const Problem& c, const StartMesh& start) {
    const SurfaceSpace space(start.mesh);
    const MotionFields fields = motion_fields(space, start.mesh, Projection(space, start.mesh));
    return observe(space, start.mesh, {fields.normal, {}, fields.H, fields.K}, c.energy, start_H0(c, start));
}

double start_length(const Problem& c, const CurvedMesh& mesh) {
    return c.law.beads ? bead_distance(mesh, c.law.beads->width) : mesh.period;
}

double free_energy(const Problem& c, const Observables& o, double length) {
    return o.energy + SurfaceLaw(c.law).potential(c.begin_time, {o.area, o.volume, length});
}

double error_of_start(const Problem& c, const Start& start, int elements, double energy, bool rough) {
    if (!start.resizable()) return 0;
    try {
        const StartMesh finer = start.mesh(static_cast<int>(much_finer * elements), c.element_order);
        const double change = free_energy(c, observe_start(c, finer), start_length(c, finer.mesh)) - energy;
        const double falls = rough ? std::sqrt(much_finer) : much_finer;
        return std::abs(change) * falls / (falls - 1);
    } catch (const SolveError&) {
        return 0;
    }
}

double reference_energy(const Problem& c, const Observables& o, double length) {
    if (c.handover) return c.handover->reference_energy;
    return tubule::reference_energy(c, free_energy(c, o, length), own_scale(c, o, length));
}

Eigen::VectorXd start_H0(const Problem& c, const StartMesh& start) {
    if (!c.energy.H0_varies() || c.energy.H0_from_points()) return start.H0;
    const CurvedMesh& mesh = start.mesh;
    constexpr double rounding = 1e-6;
    const auto at = [&](const Eigen::Vector3d& x) {
        const double value = evaluate(*c.energy.H0_formula, x.data());
        if (!std::isfinite(value))
            throw complaint(c, "energy.H0", "is no number at " + words_of_place(x) + " of the initial shape");
        return value;
    };
    Eigen::VectorXd out(mesh.size());
    for (int i = 0; i < mesh.size(); ++i) {
        const Eigen::Vector3d& x = mesh.nodes[i];
        out[i] = at(x);
        if (!(mesh.period > 0)) continue;
        const double further = at(x + Eigen::Vector3d(0, 0, mesh.period));
        if (std::abs(further - out[i]) > rounding * (1 + std::abs(out[i])))
            throw complaint(
                c, "energy.H0",
                fmt::format("must repeat itself with the period {:.6g} along z, but is {:.6g} and {:.6g} at "
                            "z = {:.4g} and a period further; such as -1 + 0.1*cos(2*pi*z/{:.6g})",
                            mesh.period, out[i], further, x[2], mesh.period));
    }
    return out;
}

void require_defined(const Problem& c, const CurvedMesh& mesh, const Eigen::VectorXd& H, const Eigen::VectorXd& K,
                     const Eigen::VectorXd& H0) {
    DensityDomain domain(c.energy);
    if (!domain.restricted()) return;
    for (int i = 0; i < mesh.size(); ++i) domain.look(H0.size() > 0 ? H0[i] : c.energy.H0, H[i], K[i], i);
    const FormulaDomain::Margin margin = domain.margin();
    tubule::require_defined(c, margin, words_of_place(mesh.nodes[static_cast<std::size_t>(margin.place)]));
}

void remember_start(const Problem& c, const StartMesh& start, const SurfaceSpace& space, MotionMemory& memory) {
    const MotionFields fields = motion_fields(space, start.mesh, Projection(space, start.mesh));
    memory.H0 = start_H0(c, start);
    const Observables o = observe(space, start.mesh, {fields.normal, {}, fields.H, fields.K}, c.energy, memory.H0);
    require_defined(c, start.mesh, fields.H, fields.K, memory.H0);
    require_pressure(c, o.volume);
    const bool closed = start.mesh.period == 0;
    refuse_potentials(c, start.mesh.period, o.potential, wall_distance(start.mesh, c.energy.potentials).value);
    const double length = start_length(c, start.mesh);
    if (c.law.beads) {
        require_beads(c, closed, length);
        memory.scale.bead_distance = length;
        if (c.law.beads->extension) memory.scale.bead_distance -= c.law.beads->extension->at(c.begin_time);
    }
    memory.scale.area = o.area, memory.scale.volume = o.volume;
    memory.balance.work = c.handover ? c.handover->work : 0;
    memory.scale.reference_energy = reference_energy(c, o, length);
    memory.scale.relaxation = c.surface.relaxation.value_or(
        relaxes_in * time_to_change(c.law, o, start.mesh.period == 0, own_scale(c, o, length)));
    memory.scale.least_variation = std::max(same_everywhere, times_noise * noise_of_H(space, start.mesh, fields));
}

}  // namespace tubule::surface3d
