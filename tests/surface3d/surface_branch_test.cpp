// Branches of stationary surfaces, against those of the axisymmetric tier.
#include "surface3d/equilibrium/surface_branch.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"

namespace tubule::surface3d::surface_branch_test {

void set_reduced_volume(StationaryProblem& p, double v) {
    p.constraints = {4 * pi, v * 4 * pi / 3, {}};
}

StationaryProblem vesicle(double v) {
    StationaryProblem out{{.k = {0.5}}, {}};
    set_reduced_volume(out, v);
    return out;
}

// From a spheroid of this radius and half this height.
SurfaceEquilibrium at_rest(double v, double radius, double half, const SurfaceEquilibriumSettings& settings) {
    return find_equilibrium(
        vesicle(v),
        [=](int triangles) {
            const int n = std::max(1, static_cast<int>(std::lround(std::sqrt(triangles / 20.0))));
            return mapped_mesh(icosphere(n), 4, [=](const Eigen::Vector3d& p) {
                const Eigen::Vector3d q = p.normalized();
                return Eigen::Vector3d(radius * q.x(), radius * q.y(), half * q.z());
            });
        },
        settings);
}

// Energies of `tubule equilibrium` in tier axisym, with accuracy.energy = 1e-10.
TEST(SurfaceBranchStudy, prolates) {
    const SurfaceEquilibrium start = at_rest(0.9, 0.9, 1.4, {.accuracy = 1e-3, .first_triangles = 80});
    ASSERT_EQ(start.stop, Stop::finished) << start.message;
    BranchSettings settings;
    settings.from = 0.9, settings.to = 0.85, settings.output = {0.9, 0.85}, settings.shapes.accuracy = 1e-3;
    const Branch branch = follow_branch(vesicle(0.9), start, set_reduced_volume, settings);
    EXPECT_EQ(branch.stop, Stop::finished) << branch.message;
    ASSERT_EQ(branch.points.size(), 2);
    const double energies[]{29.899015632, 32.312561259};
    for (int i = 0; i < 2; ++i) {
        const SurfaceEquilibrium& e = branch.points[i].shape;
        EXPECT_EQ(branch.points[i].kind, PointKind::regular);
        EXPECT_EQ(branch.points[i].parameter, settings.output[i]);
        EXPECT_EQ(branch.points[i].index, 0);
        EXPECT_LE(e.estimated_error, 1e-3);
        EXPECT_NEAR(e.values.energy, energies[i], 2 * e.estimated_error * e.reference_energy) << i;  // not a bound
    }
}

// Tier axisym: growth_2 of the oblates, accuracy.energy = 1e-11, vanishes at v = 0.749729. Shapes of three axes exist
// below that, with one negative direction: they separate oblates from prolates.
TEST(SurfaceBranch, triaxialFromOblates) {
    const double v = 0.745;
    SurfaceEquilibriumSettings shapes{.accuracy = 2e-3, .triangles = 180, .descend = false};
    const SurfaceEquilibrium start = at_rest(v, 1.24, 0.55, shapes);
    ASSERT_EQ(start.stop, Stop::finished) << start.message;
    EXPECT_EQ(start.spectrum.negative, 0);
    BranchSettings settings;
    settings.from = v, settings.to = 0.735, settings.shapes = shapes, settings.mode = 1;
    std::vector<double> begins;
    for (const double amplitude : {0.05, 0.1}) {
        settings.amplitude = amplitude, settings.max_steps = 0;
        const Branch branch = follow_branch(vesicle(v), start, set_reduced_volume, settings);
        ASSERT_EQ(branch.points.size(), 1) << branch.message;
        EXPECT_EQ(branch.points[0].kind, PointKind::bifurcation);
        EXPECT_EQ(branch.points[0].index, 1);
        begins.push_back(branch.points[0].parameter);
    }
    EXPECT_NEAR((4 * begins[0] - begins[1]) / 3, 0.749729, 3e-3);  // rounding chooses the phase of the mode on the mesh
    EXPECT_LT(begins[1], begins[0]);
}

}  // namespace tubule::surface3d::surface_branch_test
