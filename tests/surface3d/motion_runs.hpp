// Short runs of time schemes, and their energies.
#pragma once

#include <algorithm>
#include <limits>

#include "surface3d/curvature/bending_force.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/motion/schemes/paper.hpp"
#include "tests/surface3d/errors.hpp"

namespace tubule::surface3d {

inline double longest_edge(const CurvedMesh& mesh) {
    double h = 0;
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int c = 0; c < 3; ++c) h = std::max(h, (mesh.position(cell, (c + 1) % 3) - mesh.position(cell, c)).norm());
    return h;
}

// Initial area and volume.
inline MotionControl kept(const CurvedMesh& mesh) {
    const Extent e = extent(SurfaceSpace(mesh), mesh);
    return {.area = e.area, .volume = e.volume};
}

// Bending energy of the fields that drive the surface, and INT inertia u^2/2.
inline double total_energy(const MovingSurface& surface, const MotionState& state) {
    const SurfaceSpace& space = surface.space();
    const CurvedMesh mesh = surface.mesh(state);
    const MotionFields fields = motion_fields(space, mesh, Projection(space, mesh));
    double energy = observe(space, mesh, {fields.normal, {}, fields.H, fields.K}, surface.bending()).energy;
    if (surface.law().inertia == 0) return energy;
    const Eigen::SparseMatrix<double> mass = mass_matrix(space, mesh);
    for (int d = 0; d < 3; ++d) {
        const Eigen::VectorXd u = state.u.segment(d * space.size(), space.size());
        energy += surface.law().inertia * u.dot(mass * u) / 2;
    }
    return energy;
}

struct EnergyRun {
    double first = 0, largest = 0, last = 0;  // infinite where a step failed
    int steps = 0;
    MotionState state;
};

// So many steps from rest, fewer where the energy exceeds `limit` times the first or a step fails.
inline EnergyRun run_steps(TimeScheme& scheme, double tau, int steps,
                           double limit = std::numeric_limits<double>::infinity()) {
    EnergyRun out;
    const MovingSurface& surface = scheme.surface();
    out.state = scheme.surface().start(surface.mesh());
    out.first = out.largest = out.last = total_energy(surface, out.state);
    while (out.steps < steps && out.last <= limit * out.first) {
        try {
            out.state = scheme.step(out.state, tau).state;
            out.last = total_energy(surface, out.state);
        } catch (const SolveError&) {
            out.last = std::numeric_limits<double>::infinity();
        }
        if (!(out.last < std::numeric_limits<double>::infinity())) out.last = std::numeric_limits<double>::infinity();
        out.largest = std::max(out.largest, out.last);
        ++out.steps;
    }
    return out;
}

// The largest total energy of the steps over the first, on the paper's perturbed sphere with eps = .01 h^2.
inline double growth_by_the_paper(int n, double k42, double tau, int steps) {
    const CurvedMesh mesh = mapped_mesh(icosphere(n), 3, map_of(perturbed_sphere()));
    const Bending bending{.k = {0.125, 0, k42}, .H0 = 0};
    Paper paper(mesh, motion_law({.kind = ModelKind::fluid, .Re = 1, .gamma = 0, .keeps_volume = {}}), bending,
                {.smoothing = 0.01 * std::pow(longest_edge(mesh), 2)});
    const EnergyRun run = run_steps(paper, tau, steps, 10);
    return run.largest / run.first;
}

}  // namespace tubule::surface3d
