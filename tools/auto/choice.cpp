#include "tools/auto/choice.hpp"

#include <fmt/format.h>

#include <utility>

#include "common/case/keys.hpp"
#include "surface3d/run/motion_settings.hpp"
#include "surface3d/run/motion_start.hpp"

namespace tubule {
namespace {

// So few triangles are accurate to `few_reach` where they have the energy of the start to `few_start`: of the scenes of
// docs/both_tiers and of tests/studies/command/advice_study.py those with 3e-4 and less are, while a neck with 1.3e-3
// states no error and a rough fluid with 3e-3 is lost.
constexpr double few_reach = 1e-2, few_start = 5e-4;

}  // namespace

bool few_triangles_do(const Problem& c, const surface3d::Start& start) {
    if (c.accuracy.energy < few_reach || !start.resizable() || c.surface.order || c.surface_resolution_given() ||
        c.law.beads)
        return false;
    const surface3d::StartMesh mesh = start.mesh(surface3d::least_triangles, c.element_order);
    const surface3d::Observables o = surface3d::observe_start(c, mesh);
    const double energy = surface3d::free_energy(c, o, mesh.mesh.period);
    return surface3d::error_of_start(c, start, surface3d::least_triangles, energy, false) <=
           few_start * surface3d::reference_energy(c, o, mesh.mesh.period);
}

Choice choice_for(const Problem& c) {
    if (const auto [key, complaint] = not_axisymmetric(c.shape); !key.empty())
        return {false,
                fmt::format("the initial shape is not axisymmetric: {} {}", key,
                            std::holds_alternative<MeshFile>(c.shape) ? "is a mesh" : "breaks the symmetry"),
                surface3d::Start(c.of_surface())};
    if (std::holds_alternative<ResultFrame>(c.shape))
        if (surface3d::Start start(c.of_surface()); !start.resizable())
            return {false,
                    "the initial shape is not axisymmetric: the frame of shape.path is a surface in three dimensions",
                    std::move(start)};
    return {true, "the initial shape and the model are axisymmetric", {}};
}

}  // namespace tubule
