#include "tools/auto/waves.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "axisym/equilibrium/spectrum.hpp"
#include "common/result/frame_profile.hpp"

namespace tubule {

namespace {

// Accuracy of rates: enough for amplitudes, which depend on noise anyway. More elements are not worth their cost.
constexpr double rate_accuracy = 1e-2;
constexpr int most_elements = 60;

// Without inertia, under the loads of this time.
axisym::Spectrum spectrum_of(const Problem& c, MotionLaw law, const Curve& profile, double time) {
    axisym::SpectrumSettings settings;
    settings.first = 1, settings.last = c.automatic.modes, settings.count = 1, settings.accuracy = rate_accuracy;
    settings.max_elements = most_elements;
    law.inertia = 0;
    const Held held = axisym::held_by(law);
    axisym::set_loads(settings, law, held, time);
    return axisym::spectrum(c.energy, law, held, profile, settings);
}

double fastest(const axisym::ModeRates& mode) {
    return mode.rates.empty() ? 0 : mode.rates[0];
}

}  // namespace

double rate_with_inertia(double stokes, double overdamped) {
    if (stokes == 0 || overdamped == 0) return 0;
    const bool damped = std::abs(overdamped) > 4 * stokes * stokes;
    if (stokes * overdamped < 0) (damped ? overdamped : stokes) *= -1;
    const double b = overdamped / stokes;
    const auto root = std::sqrt(std::complex<double>(b * b + 4 * overdamped));
    return (-b + root.real()) / 2;
}

WaveRates wave_rates(const Problem& c, const Record& frame) {
    const Curve profile = meridian(frame_curve(frame));
    const MotionLaw& law = c.law;
    const axisym::Spectrum found = spectrum_of(c, law, profile, frame.time);
    WaveRates out;
    for (const axisym::ModeRates& mode : found.modes) out.rates.push_back(fastest(mode));
    out.estimated = (law.inextensible || law.free_period) && !found.at_rest();
    out.accuracy = found.estimated_error;
    if (law.inertia == 0) return out;
    MotionLaw overdamped = law;
    overdamped.viscosity = 0, overdamped.friction = 1;
    const axisym::Spectrum inert = spectrum_of(c, overdamped, profile, frame.time);
    for (std::size_t i = 0; i < out.rates.size(); ++i)
        out.rates[i] = rate_with_inertia(out.rates[i], fastest(inert.modes[i]));
    return out;
}

PerturbedCurve perturbed_curve(const Problem& c, const Record& frame, const std::vector<double>& relative_amplitudes) {
    PerturbedCurve out = frame_curve(frame);
    const std::vector<double>& r = find_array(frame, "r")->data;
    const double radius = *std::max_element(r.begin(), r.end());
    const axisym::Spectrum found = spectrum_of(c, c.law, meridian(out), frame.time);
    for (std::size_t i = 0; i < found.modes.size() && i < relative_amplitudes.size(); ++i) {
        const axisym::ModeRates& mode = found.modes[i];
        if (relative_amplitudes[i] == 0 || mode.shape.empty()) continue;
        std::vector<double> w = mode.shape;
        for (double& value : w) value *= relative_amplitudes[i] * radius;
        out.modes.push_back(normal_mode(out, mode.m, w));
    }
    if (c.law.inertia != 0) out.velocity = frame_velocity(frame, out);
    return out;
}

}  // namespace tubule
