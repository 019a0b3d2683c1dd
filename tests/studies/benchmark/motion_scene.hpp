// The paper's perturbed sphere as a fluid, k42 = 0.12, whose steps are timed.
#pragma once

#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/motion/schemes/one_stage.hpp"
#include "tests/surface3d/errors.hpp"

namespace tubule::surface3d {

inline const Bending energy{.k = {0.125, 0, 0.12}, .H0 = 0};
inline const MotionLaw fluid = motion_law({.kind = ModelKind::fluid, .Re = 1, .gamma = 0, .keeps_volume = {}});
inline constexpr double tau = 1e-3;

inline MotionControl control_of(const CurvedMesh& mesh) {
    const Extent e = extent(SurfaceSpace(mesh), mesh);
    return {.area = e.area, .volume = e.volume};
}

// The surface after a few steps, and the system of the next one.
struct Scene {
    CurvedMesh mesh;
    std::unique_ptr<TimeScheme> scheme;
    MovingSurface& surface;
    const StepSolver& solver;
    MotionState state, before;
    MotionFields fields;
    StepBase base;
    StepSystem system;

    Scene(int n, int order)
        : mesh(mapped_mesh(icosphere(n), order, map_of(perturbed_sphere()))),
          scheme(make_scheme(scheme_named("alpha"), mesh, fluid, energy, control_of(mesh))),
          surface(scheme->surface()),
          solver(dynamic_cast<OneStageScheme&>(*scheme).solver()),
          state(surface.start(mesh)) {
        for (int i = 0; i < 3; ++i) before = std::exchange(state, scheme->step(state, tau).state);
        mesh = surface.mesh(state);
        fields = surface.fields(mesh);
        base = {&mesh, fields, state.X - before.X, state.w, state.u, state.u, tau};
        assemble(surface.space(), solver.unknowns(), fluid, energy, base, system);
    }
};

}  // namespace tubule::surface3d
