// Meshes that follow what a run has lost to its elements.
#include "axisym/curve/element_density.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "axisym/splines/breaks.hpp"
#include "axisym/splines/curve_space.hpp"
#include "common/case/read.hpp"
#include "tests/axisym/runs.hpp"

namespace tubule::axisym::element_density_test {

std::vector<double> sizes(const std::vector<double>& breaks) {
    std::vector<double> out;
    for (std::size_t e = 0; e + 1 < breaks.size(); ++e) out.push_back(breaks[e + 1] - breaks[e]);
    return out;
}

// What is lost per length falls with the power 2 (p - 1) of the size: a million times as much in one of ten elements,
// quintic ones, asks for elements smaller by 10^(6/8) there.
TEST(MeshNeed, putsSmallElementsWhereMuchIsLost) {
    const SplineSpace space(Cell{0, 1, false, 1}, equal_breaks(10), 5, 4);
    std::vector<double> defect(10, 1e-12);
    MeshNeed need;
    need.add(space, defect);
    defect[6] = 1e-6;
    need.add(space, defect);
    need.add(space, std::vector<double>(10, 1e-13));  // what was lost before counts
    EXPECT_NEAR(need.lost, 1e-6, 1e-10);
    for (const int elements : {40, 400}) {
        const std::vector<double> breaks = breaks_of(need.density(), elements);
        ASSERT_EQ(breaks.size(), std::size_t(elements) + 1);
        EXPECT_EQ(breaks.front(), 0);
        EXPECT_EQ(breaks.back(), 1);
        const std::vector<double> size = sizes(breaks);
        const auto least = std::min_element(size.begin(), size.end()) - size.begin();
        EXPECT_GT(breaks[least], 0.58);
        EXPECT_LT(breaks[least], 0.72);
        // Mean wish 0.9 + 0.1 * 5.62; half of the elements follow the wish.
        EXPECT_NEAR(size.front() / size[least], (0.5 + 0.5 * 5.62 / 1.462) / (0.5 + 0.5 / 1.462), 0.15);
        EXPECT_LT(size.front(), 2.5 / elements);  // half of the elements stay equal
        for (int e = 1; e < elements; ++e) {
            EXPECT_LT(size[e] / size[e - 1], 1.6);
            EXPECT_LT(size[e - 1] / size[e], 1.6);
        }
    }
}

TEST(MeshNeed, knowsNothingBeforeAnythingWasLost) {
    EXPECT_TRUE(MeshNeed().density().empty());
}

// A tube whose pearls hang on a thin neck: its error is that of the time steps, which the motion amplifies. A run that
// refines its mesh with each tolerance needs 1300 elements and more. Expected: 400 equal elements with a tolerance of
// 1e-12; energies that differ by 6e-8 of E_ref.
TEST(MeshNeed, leavesAFineMeshAsItIs) {
    const Case c = parse_case(
        "tier = \"axisym\"\n[energy]\nk20 = 1.0\nk42 = 0.5\nH0 = -2.0\n[model]\nkind = \"overdamped\"\nvolume = "
        "\"free\"\n"
        "[shape]\nkind = \"tube\"\nradius = 1.0\nlength = 9.0\n[[shape.mode]]\namplitude = 1e-3\nn = 1\n"
        "[accuracy]\nenergy = 1e-5\nr_min = 0.05\n[time]\nend = 20.0\noutput = [12, 14]\n",
        {}, "case.toml");
    const Outcome o = run_case(c);
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    EXPECT_LT(o.summary.elements, 500);
    EXPECT_LT(o.summary.estimated_error, 1e-5);
    const double stated = o.summary.estimated_error * o.summary.reference_energy;
    EXPECT_NEAR(o.at("energy", 12), 55.989797772, stated);
    EXPECT_NEAR(o.at("energy", 14), 51.181325740, stated);
    EXPECT_NEAR(o.last("r_min"), 0.4444188369, 1e-6);
}

}  // namespace tubule::axisym::element_density_test
