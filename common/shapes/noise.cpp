#include "common/shapes/noise.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "common/shapes/mesh_file.hpp"
#include "common/shapes/result_frame.hpp"
#include "common/shapes/sphere.hpp"
#include "common/shapes/tube.hpp"

namespace tubule {
namespace {

// The distributions of the standard library differ from one to another; the generator does not.
class Random {
public:
    explicit Random(int seed) : generate_(static_cast<std::uint64_t>(seed)) {}
    double uniform() { return (static_cast<double>(generate_() >> 11) + 0.5) * 0x1p-53; }
    double normal() {
        const double size = std::sqrt(-2 * std::log(uniform()));
        return size * std::cos(2 * std::numbers::pi * uniform());
    }

private:
    std::mt19937_64 generate_;
};

// Scales modes so that the sum of their mean squares, `weight` times amplitude^2 each, is that of the noise.
template <class Mode, class Weight>
void scale(std::vector<Mode>& modes, double amplitude, const Weight& weight) {
    double sum = 0;
    for (const Mode& mode : modes) sum += weight(mode) * mode.amplitude * mode.amplitude;
    for (Mode& mode : modes) mode.amplitude *= amplitude / std::sqrt(sum);
}

}  // namespace

// Neither the mean radius changes (n = m = 0) nor does the tube shift (n = 0, m = 1).
void make_noise(Tube& tube) {
    for (const ShapeNoise& noise : std::exchange(tube.noise, {})) {
        Random random(noise.seed);
        std::vector<TubeMode> modes;
        for (int n = 0; n <= noise.along; ++n)
            for (int m = n == 0 ? 2 : -noise.around; m <= noise.around; ++m) {
                const double amplitude = random.normal();
                modes.push_back({amplitude, n, m, 2 * std::numbers::pi * random.uniform()});
            }
        if (noise.amplitude == 0 || modes.empty()) continue;
        scale(modes, noise.amplitude, [](const TubeMode&) { return 0.5; });
        tube.modes.insert(tube.modes.end(), modes.begin(), modes.end());
    }
}

namespace {

// Neither the mean radius changes (l = 0) nor does the sphere shift (l = 1).
template <class Shape>
void make_harmonics(Shape& sphere) {
    for (const ShapeNoise& noise : std::exchange(sphere.noise, {})) {
        Random random(noise.seed);
        std::vector<SphereMode> modes;
        for (int l = 2; l <= noise.along; ++l)
            for (int m = 0; m <= std::min(l, noise.around); ++m) modes.push_back({random.normal(), l, m});
        if (noise.amplitude == 0) continue;
        scale(modes, noise.amplitude,
              [](const SphereMode& mode) { return (mode.m == 0 ? 1 : 0.5) / (4 * std::numbers::pi); });
        sphere.modes.insert(sphere.modes.end(), modes.begin(), modes.end());
    }
}

}  // namespace

void make_noise(Sphere& sphere) {
    make_harmonics(sphere);
}
void make_noise(MeshFile& file) {
    make_harmonics(file);
}

void make_noise(ResultFrame& result) {
    for (const FrameNoise& noise : std::exchange(result.noise, {})) {
        const ShapeNoise one{noise.amplitude, noise.l ? *noise.l : *noise.n, noise.around, noise.seed};
        Sphere sphere{1, {}, {one}};
        Tube tube{1, 1, {}, {one}};
        if (noise.l) {
            make_noise(sphere);
            for (const auto& [amplitude, l, m] : sphere.modes) result.modes.push_back({amplitude, l, {}, m, 0});
        } else {
            make_noise(tube);
            for (const auto& [amplitude, n, m, phase] : tube.modes)
                result.modes.push_back({amplitude, {}, n, m, phase});
        }
    }
}

}  // namespace tubule
