// A fourth energy term first, in the middle and last in the list of common/energy/bending.hpp: nothing but the order of
// the list changes, and terms are found by their keys. Each edited header has a namespace of its own.
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "common/energy/potential.hpp"
#include "common/formula/formula.hpp"

namespace term_first {
using namespace tubule;
}
namespace term_in_the_middle {
using namespace tubule;
}
namespace term_last {
using namespace tubule;
}

#define tubule term_first
#include "first/common/energy/bending.hpp"
#undef tubule
#define tubule term_in_the_middle
#include "middle/common/energy/bending.hpp"
#undef tubule
#define tubule term_last
#include "last/common/energy/bending.hpp"
#undef tubule

namespace {

// f = .3 (H - .5)^2 + .02 (H - .5)^4 + .1 K^2 + .7 H^2 K at (-1.2, .4), derivatives by hand.
template <class Bending>
void expect_density(const Bending& energy) {
    const double H = -1.2, K = 0.4, h = H - 0.5;
    const auto f = density(energy, H, K);
    EXPECT_NEAR(f.f, 0.3 * h * h + 0.02 * h * h * h * h + 0.1 * K * K + 0.7 * H * H * K, 1e-14);
    EXPECT_NEAR(f.H, 0.6 * h + 0.08 * h * h * h + 1.4 * H * K, 1e-14);
    EXPECT_NEAR(f.K, 0.2 * K + 0.7 * H * H, 1e-14);
    EXPECT_NEAR(f.HH, 0.6 + 0.24 * h * h + 1.4 * K, 1e-14);
    EXPECT_NEAR(f.HK, 1.4 * H, 1e-14);
    EXPECT_NEAR(f.KK, 0.2, 1e-14);
}

TEST(Terms, KeepTheirKeysWhereverOneIsAdded) {
    const auto check = [](auto energy, std::array<std::size_t, 4> number, std::array<std::size_t, 4> expected) {
        EXPECT_EQ(number, expected);
        energy.H0 = 0.5;
        energy.k[number[0]] = 0.3, energy.k[number[1]] = 0.02, energy.k[number[2]] = 0.1, energy.k[number[3]] = 0.7;
        expect_density(energy);
    };
    {
        using namespace term_first;
        check(Bending{}, {term_number("k20"), term_number("k40"), term_number("k42"), term_number("k22")},
              {1, 2, 3, 0});
    }
    {
        using namespace term_in_the_middle;
        check(Bending{}, {term_number("k20"), term_number("k40"), term_number("k42"), term_number("k22")},
              {0, 2, 3, 1});
    }
    {
        using namespace term_last;
        check(Bending{}, {term_number("k20"), term_number("k40"), term_number("k42"), term_number("k22")},
              {0, 1, 2, 3});
    }
}

}  // namespace
