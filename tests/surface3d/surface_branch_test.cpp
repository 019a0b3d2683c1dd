// Branches of stationary surfaces, against those of the axisymmetric tier.
#include <gtest/gtest.h>

#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "surface3d/equilibrium/surface_branch.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"

namespace tubule::surface3d {
namespace surface_branch_test {

void set_reduced_volume(StationaryProblem& p, double v) {
    p.constraints = {4 * pi, v * 4 * pi / 3, {}};
}

StationaryProblem vesicle(double v) {
    StationaryProblem out{{.k = {0.5}}, {}};
    set_reduced_volume(out, v);
    return out;
}

SurfaceEquilibrium prolate_at_rest(double v) {
    return find_equilibrium(vesicle(v),
                            [](int triangles) {
                                const int n = std::max(1, static_cast<int>(std::lround(std::sqrt(triangles / 20.0))));
                                return mapped_mesh(icosphere(n), 4, [](const Eigen::Vector3d& p) {
                                    const Eigen::Vector3d q = p.normalized();
                                    return Eigen::Vector3d(0.9 * q.x(), 0.9 * q.y(), 1.4 * q.z());
                                });
                            },
                            {.accuracy = 3e-4, .first_triangles = 80});
}

// Energies of `tubule equilibrium` in tier axisym, with accuracy.energy = 1e-10.
TEST(SurfaceBranch, prolates) {
    const SurfaceEquilibrium start = prolate_at_rest(0.9);
    ASSERT_EQ(start.stop, Stop::finished) << start.message;
    BranchSettings settings;
    settings.from = 0.9, settings.to = 0.85, settings.output = {0.9, 0.85}, settings.shapes.accuracy = 3e-4;
    const Branch branch = follow_branch(vesicle(0.9), start, set_reduced_volume, settings);
    EXPECT_EQ(branch.stop, Stop::finished) << branch.message;
    ASSERT_EQ(branch.points.size(), 2);
    const double energies[]{29.899015632, 32.312561259};
    for (int i = 0; i < 2; ++i) {
        const SurfaceEquilibrium& e = branch.points[i].shape;
        EXPECT_EQ(branch.points[i].kind, PointKind::regular);
        EXPECT_EQ(branch.points[i].parameter, settings.output[i]);
        EXPECT_EQ(branch.points[i].index, 0);
        EXPECT_LE(e.estimated_error, 3e-4);
        EXPECT_NEAR(e.values.energy, energies[i], 2 * e.estimated_error * e.reference_energy) << i;  // not a bound
    }
}

}  // namespace surface_branch_test
}  // namespace tubule::surface3d
