// Stable steps of the paper's scheme on finer meshes. A prototype was stable and unstable at 3e-3 and 4.2e-3 (320
// triangles), 7e-4 and 1e-3 (1280).
#include <gtest/gtest.h>

#include "tests/surface3d/motion_runs.hpp"

namespace tubule::surface3d {
namespace {

TEST(PaperSchemeStudy, StableStepFallsAsTheSquareOfTheMeshWidth) {
    EXPECT_LT(growth_by_the_paper(4, 0.12, 3e-3, 60), 1.1);
    EXPECT_GT(growth_by_the_paper(4, 0.12, 4.2e-3, 60), 10);
    EXPECT_LT(growth_by_the_paper(8, 0.12, 3.5e-4, 60), 1.1);
    EXPECT_GT(growth_by_the_paper(8, 0.12, 1e-3, 60), 10);
}

}  // namespace
}  // namespace tubule::surface3d
