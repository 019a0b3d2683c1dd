// Growth rates fitted to the amplitudes of a wave in a result of either tier.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "axisym/equilibrium/profile_modes.hpp"
#include "common/result/frame_profile.hpp"
#include "common/solve/pause.hpp"
#include "common/theory/growth_fit.hpp"
#include "common/theory/waves.hpp"
#include "surface3d/curvature/surface_modes.hpp"
#include "surface3d/run/mesh_record.hpp"
#include "tools/command/output.hpp"
#include "tools/command/stability.hpp"
#include "tools/command/units.hpp"

namespace tubule {

namespace {

constexpr int most_waves = 1000;

struct WaveNumbers {
    int n = 0, m = 0;
};

struct Amplitudes {
    std::vector<double> times, values;
    std::string source;
};

WaveNumbers wave_of(const std::string& text) {
    WaveNumbers wave;
    const char *at = text.data(), *const end = at + text.size();
    auto read = std::from_chars(at, end, wave.n);
    if (read.ec == std::errc{} && read.ptr != end && *read.ptr == ',')
        read = std::from_chars(read.ptr + 1, end, wave.m);
    const bool known = std::min(wave.n, wave.m) >= 0 && std::max(wave.n, wave.m) <= most_waves;
    if (read.ec != std::errc{} || read.ptr != end || !known || (wave.n == 0 && wave.m == 0))
        throw std::invalid_argument(
            fmt::format("--fit must be n or n,m with n, m from 0 to {} and not both 0, such as 1 or 2,1; not {}",
                        most_waves, text));
    return wave;
}

double amplitude_of(const Result& result, const Record& frame, WaveNumbers wave) {
    if (frame.mesh) {
        const SurfaceCells& cells = result.meshes.at(*frame.mesh);
        const surface3d::CurvedMesh surface = surface3d::frame_surface(frame, cells);
        return cells.period > 0 ? surface3d::tube_mode_amplitude(surface, wave.n, wave.m)
                                : surface3d::sphere_mode_amplitude(surface, wave.n, wave.m);
    }
    if (wave.m > 0)
        throw std::invalid_argument(
            fmt::format("--fit {},{}: a result of tier \"axisym\" has no modes m > 0", wave.n, wave.m));
    return axisym::mode_amplitude(meridian(frame_curve(frame)), wave.n);
}

// The rows have every step, the frames only what was asked for. A run of both tiers has profiles, of which nothing with
// m > 0 is known, and then surfaces, the first of them at the time of the last profile.
Amplitudes amplitudes_of(const Result& result, WaveNumbers wave) {
    const std::string name = fmt::format("mode_{}", wave.n);
    const auto series = result.series.find(name);
    if (wave.m == 0 && series != result.series.end())
        return {result.series.at("time"), series->second, fmt::format("rows ({})", name)};
    Amplitudes out;
    const bool surfaces = !result.frames.empty() && result.frames.back().mesh;
    for (const Record& frame : result.frames) {
        check_pause();
        if (surfaces && !frame.mesh && wave.m > 0) continue;
        if (!out.times.empty() && out.times.back() == frame.time) out.times.pop_back(), out.values.pop_back();
        out.times.push_back(frame.time);
        out.values.push_back(amplitude_of(result, frame, wave));
    }
    out.source = "frames";
    return out;
}

std::string words_of(WaveNumbers wave, const Amplitudes& a, const theory::GrowthFit& fit, std::optional<double> linear,
                     const std::optional<Scales>& scales) {
    const LabUnit rate = lab_unit(scales, "1/time"), time = lab_unit(scales, "time"),
                  length = lab_unit(scales, "length");
    const auto [low, high] = std::minmax_element(a.values.begin(), a.values.end());
    std::string out = fmt::format("wave {},{}: {} amplitudes from the {}, {:.4g} to {:.4g}{}\n", wave.n, wave.m,
                                  a.values.size(), a.source, *low * length.scale, *high * length.scale, length.after());
    out += fmt::format("rate {:.10g} +- {:.2g}{} for t = {:.6g} to {} ({} points), e-fold in {}\n",
                       fit.rate * rate.scale, fit.error * rate.scale, rate.after(), fit.from * time.scale,
                       with_unit(fit.to, time, 6), fit.points, with_unit(1 / std::abs(fit.rate), time, 6));
    if (!(fit.error < 0.1 * std::abs(fit.rate)))
        out += "the amplitude is nowhere exponential, hence the large error bar\n";
    if (linear)
        out += fmt::format("linear theory of the case over the same time: {}, differs by {}\n",
                           with_unit(*linear, rate, 10), with_unit(fit.rate - *linear, rate, 2));
    return out;
}

}  // namespace

std::string fit_report(const StabilityOptions& options, const StabilitySubject& subject) {
    const WaveNumbers wave = wave_of(options.fit);
    const Amplitudes a = amplitudes_of(*subject.result, wave);
    const theory::GrowthFit fit = theory::fit_growth(a.times, a.values, 0);
    const auto linear =
        subject.case_is_known ? theory::mean_rate(subject.c, wave.n, wave.m, fit.from, fit.to) : std::nullopt;
    if (options.csv) {
        std::string out = "time,amplitude\n";
        for (std::size_t i = 0; i < a.times.size(); ++i)
            out += fmt::format("{:.17g},{:.17g}\n", a.times[i], a.values[i]);
        return out;
    }
    if (options.json)
        return line_of({{"n", wave.n},
                        {"m", wave.m},
                        {"source", a.source},
                        {"rate", fit.rate},
                        {"error", fit.error},
                        {"from", fit.from},
                        {"to", fit.to},
                        {"points", fit.points},
                        {"linear_rate", or_null(linear)},
                        {"time", a.times},
                        {"amplitude", a.values}});
    return words_of(wave, a, fit, linear, subject.case_is_known ? known_scales(subject.c) : std::nullopt);
}

}  // namespace tubule
