// A fourth energy term, k22 H^2 K, added to the list of common/energy/bending.hpp: the surface tier knows its energy
// and its force.
#include <gtest/gtest.h>

#include "common/geometry/profile_point.hpp"
#include "common/shapes/sphere.hpp"
#include "surface3d/curvature/bending_force.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"

namespace tubule::surface3d {
namespace {

TEST(Surface, KnowsAFourthTerm) {
    // On a sphere of radius R all gradients vanish: b = -(|B|^2 f_H + H K f_K - H f), theory.md (2.13), f = H^2 K.
    const double R = 1.5, H = -2 / R, K = 1 / (R * R), area = 4 * pi * R * R;
    const double f = H * H * K, b = -(2 * K * (2 * H * K) + H * K * (H * H) - H * f);
    const Sphere sphere{.radius = R, .modes = {}};
    const CurvedMesh mesh = mapped_mesh(icosphere(3), 4, [&](const auto& p) { return position(sphere, p); });
    const SurfaceSpace space(mesh);
    const CurvatureField field = recover(space, mesh);
    constexpr std::size_t k22 = term_number("k22");
    Bending bending{.k = {}, .H0 = -0.4};
    bending.k[k22] = 1;
    const Observables o = observe(space, mesh, field, bending);
    ASSERT_EQ(n_bending_terms, 4u);
    EXPECT_NEAR(o.energy_term[k22] / (f * area), 1, 1e-5);
    EXPECT_EQ(o.energy, o.energy_term[k22]);
    EXPECT_NEAR(bending_force(space, mesh, field, bending).cwiseProduct(field.normal).sum() / (b * area), 1, 1e-5);
}

}  // namespace
}  // namespace tubule::surface3d
