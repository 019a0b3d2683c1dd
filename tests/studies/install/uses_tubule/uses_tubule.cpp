// A program of somebody else, with both tiers: a sphere in each, by its closed forms.
#include <cmath>
#include <cstdio>

#include "axisym/curve/shape_integrals.hpp"
#include "axisym/splines/arc_length.hpp"
#include "common/case/read.hpp"
#include "surface3d/run/run_surface.hpp"

int main() {
    using namespace tubule;
    const double pi = std::acos(-1.0), R = 1.5;
    const auto [area, volume] = axisym::area_and_volume(meridian(Sphere{R, {}}));
    const Case c = parse_case(
        "tier = 'surface3d'\n[energy]\nk20 = 0.5\n[shape]\nkind = 'sphere'\nradius = 1.5\n[accuracy]\nenergy = 1e-3\n",
        {}, "sphere.toml");
    RunObserver nobody;
    const RunSummary run = surface3d::run_surface(c, nobody);
    const double energy = 0.5 * 16 * pi;  // k20 INT H^2 dS with H = -2/R
    std::printf("area %.15g volume %.15g energy %.15g\n", area, volume, run.energy);
    const bool right = std::abs(area / (4 * pi * R * R) - 1) < 1e-12 &&
                       std::abs(volume / (4 * pi / 3 * R * R * R) - 1) < 1e-12 &&
                       std::abs(run.energy / energy - 1) < 1e-3;
    return right ? 0 : 1;
}
