// Which steps are stable from the paper's perturbed sphere at rest (k20 = .125, Re = 1, P_3 on 20 n^2 triangles)?
//   stable_steps SCHEME MODEL K42 N SMOOTHING STEP...
// SCHEME is paper or default, MODEL fluid, stokes or overdamped, SMOOTHING the paper's eps in units of h^2, h the
// longest edge (the default has none: 0). CSV, one row a step: the largest and the last total energy of 60 steps over
// that of the start, with H and K as they drive the surface. Stable: never above 1.1.
#include <fmt/core.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "surface3d/mesh/base_meshes.hpp"
#include "tests/surface3d/motion_runs.hpp"

using namespace tubule;
using namespace tubule::surface3d;

int main(int argc, char** argv) {
    if (argc < 7) return fmt::print(stderr, "stable_steps SCHEME MODEL K42 N SMOOTHING STEP...\n"), 2;
    const std::string scheme = argv[1], model = argv[2];
    const double k42 = std::atof(argv[3]), smoothing = std::atof(argv[5]);
    const CurvedMesh mesh = mapped_mesh(icosphere(std::atoi(argv[4])), 3, map_of(perturbed_sphere()));
    const double h = longest_edge(mesh);
    const ModelKind kind = model == "fluid"    ? ModelKind::fluid
                           : model == "stokes" ? ModelKind::stokes
                                               : ModelKind::overdamped;
    const MotionLaw law = motion_law({.kind = kind, .Re = 1, .gamma = {}, .keeps_volume = {}});
    const Bending bending{.k = {0.125, 0, k42}};
    fmt::print("scheme,model,k42,triangles,h,smoothing,step,steps,largest,last,stable\n");
    for (int i = 6; i < argc; ++i) {
        const double tau = std::atof(argv[i]);
        MotionControl control = kept(mesh);
        control.smoothing = smoothing * h * h;
        const auto made =
            make_scheme(scheme == "paper" ? scheme_named("paper") : scheme_named("bdf2"), mesh, law, bending, control);
        const EnergyRun run = run_steps(*made, tau, 60, 10);
        fmt::print("{},{},{},{},{:.3f},{},{},{},{:.4g},{:.4g},{}\n", scheme, model, k42, mesh.triangles(), h, smoothing,
                   tau, run.steps, run.largest / run.first, run.last / run.first,
                   run.largest < 1.1 * run.first ? "yes" : "no");
        std::fflush(stdout);
    }
}
