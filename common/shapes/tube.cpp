#include "common/shapes/tube.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <complex>
#include <map>
#include <numeric>

namespace tubule {

namespace {

// Golden section: a minimum of r0 in [low, high], which holds one.
double minimise(const Tube& tube, double low, double high) {
    const double golden = (std::sqrt(5.0) - 1) / 2;
    double a = high - golden * (high - low), b = low + golden * (high - low);
    double at_a = radius_at(tube, a), at_b = radius_at(tube, b);
    for (int step = 0; step < 50; ++step) {  // 0.618^50 = 4e-11; r0 is flat there to rounding
        if (at_a < at_b) {
            high = b;
            b = a, at_b = at_a;
            a = high - golden * (high - low), at_a = radius_at(tube, a);
        } else {
            low = a;
            a = b, at_a = at_b;
            b = low + golden * (high - low), at_b = radius_at(tube, b);
        }
    }
    return (low + high) / 2;
}

}  // namespace

int common_waves(const Tube& tube) {
    int waves = 0;
    for (const TubeMode& mode : tube.modes)
        if (mode.amplitude != 0) waves = mode.m == 0 ? std::gcd(waves, mode.n) : 1;
    return waves;
}

Neck narrowest(const Tube& tube) {
    int waves = 0;
    for (const TubeMode& mode : tube.modes) waves = std::max(waves, mode.n);
    Neck best{0, radius_at(tube, 0.0)};
    if (waves == 0) return best;

    // 32 samples of the shortest wave see every minimum; each is then refined between its neighbours.
    const int samples = 32 * waves;
    const double step = tube.length / samples;
    std::vector<double> r(samples);
    for (int i = 0; i < samples; ++i) r[i] = radius_at(tube, i * step);
    for (int i = 0; i < samples; ++i) {
        if (r[i] > r[(i + samples - 1) % samples] || r[i] > r[(i + 1) % samples]) continue;
        const double z = minimise(tube, (i - 1) * step, (i + 1) * step);
        const Neck refined{z < 0 ? z + tube.length : z, radius_at(tube, z)};
        for (const Neck& neck : {Neck{i * step, r[i]}, refined})
            if (neck.radius < best.radius) best = neck;
    }
    return best;
}

std::string complaint(const Tube& given) {
    Tube tube = given;
    make_noise(tube);
    int around = 0, along = 0;
    double most = 0;  // of the modes together
    for (const TubeMode& mode : tube.modes) {
        around = std::max(around, std::abs(mode.m)), along = std::max(along, mode.n);
        most += std::abs(mode.amplitude);
    }
    if (most < tube.radius) return {};
    if (around == 0) {
        const Neck neck = narrowest(tube);
        if (neck.radius > 0) return {};
        return fmt::format("must have r0(z) > 0 everywhere, but r0 = {:.6g} at z = {:.6g}", neck.radius, neck.z);
    }
    const int columns = 16 * around, rows = 16 * std::max(along, 1);  // sees a radius that is not barely positive
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) {
            const double z = tube.length * i / rows, theta = 2 * std::numbers::pi * j / columns;
            const double r = radius_at(tube, z, theta);
            if (!(r > 0))
                return fmt::format("must have r0 > 0 everywhere, but r0 = {:.6g} at z = {:.6g}, theta = {:.6g}", r, z,
                                   theta);
        }
    return {};
}

double volume(const Tube& tube) {
    // Parseval: the complex amplitude of each wave number, all modes of that n together.
    std::map<int, std::complex<double>> waves{{0, tube.radius}};
    for (const TubeMode& mode : tube.modes) {
        if (mode.n == 0)
            waves[0] += mode.amplitude * std::cos(mode.phase);
        else
            waves[mode.n] += std::polar(1.0, mode.phase) * mode.amplitude;
    }
    double mean_square = 0;
    for (const auto& [n, amplitude] : waves) mean_square += (n == 0 ? 1 : 0.5) * std::norm(amplitude);
    return std::numbers::pi * tube.length * mean_square;
}

}  // namespace tubule
