// Shape "result": a frame of a result of either tier, which waves along its normal may disturb.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "common/shapes/curve.hpp"

namespace tubule {

// l for a closed surface, n for a tube or ring: which of them it is, is known once the frame is read.
struct FrameMode {
    double amplitude = 0;
    std::optional<int> l, n;
    int m = 0;
    double phase = 0;  // of n
};
struct FrameNoise {
    double amplitude = 0;
    std::optional<int> l, n;
    int around = 0, seed = 1;
};

// A mode that the frame holds, along the normal: "mode_1" of tier surface3d, "displacement_2" (m = 2) of tier axisym.
struct FrameEigenmode {
    std::string of;
    double amplitude = 0;  // largest displacement
};

struct ResultFrame {
    static constexpr const char* kind = "result";
    std::string path;  // relative to the case file
    int frame = -1;    // from 0; negative: from the end
    std::vector<FrameMode> modes = {};
    std::vector<FrameNoise> noise = {};  // becomes modes once the case is read
    std::vector<FrameEigenmode> eigenmodes = {};

    bool closed() const { return !modes.empty() && modes.front().l.has_value(); }  // what its modes take it for
};

// Adds the modes of the noise to the others, and forgets the noise.
void make_noise(ResultFrame& result);

inline Asymmetry asymmetry(const ResultFrame& result) {
    if (!result.eigenmodes.empty())
        return {"shape.eigenmode", "needs tier \"surface3d\": the mode of a frame may have no axis"};
    const Asymmetry noise = noise_around(result.noise);
    return noise.first.empty() ? mode_around(result.modes) : noise;
}

// One of l and n, and of all the same.
template <class Keys, class Waves>
void check_waves(Keys& k, const char* key, const Waves& waves, bool closed) {
    for (std::size_t i = 0; i < waves.size(); ++i)
        k.check(fmt::format("{}.{}", key, i), [&]() -> std::string {
            if (waves[i].l.has_value() == waves[i].n.has_value())
                return "needs l, if the frame is a closed surface, or n, if it is a tube or a ring; one of the two";
            return waves[i].l.has_value() == closed ? "" : "must have the same of l and n as the others";
        });
}

template <class Keys>
void keys(Keys& k, ResultFrame& result) {
    constexpr double most = std::numeric_limits<int>::max();
    k.text("path", result.path, k.required);
    k.integer("frame", result.frame, {.from = -most, .to = most});
    k.tables("mode", result.modes, [](auto& k, FrameMode& mode) {
        k.number("amplitude", mode.amplitude, {}, k.required);
        k.integer("l", mode.l, {.from = 0, .to = 1000});
        k.integer("n", mode.n, {.from = 0, .to = 10000});
        if (mode.l) {
            k.integer("m", mode.m, {.from = 0, .to = static_cast<double>(*mode.l), .note = "l"});
            k.absent("phase", "must be absent: only valid with n");
        } else {
            k.integer("m", mode.m, {.from = -10000, .to = 10000});
            k.number("phase", mode.phase);
        }
    });
    k.tables("noise", result.noise, [](auto& k, FrameNoise& noise) {
        k.number("amplitude", noise.amplitude, {.from = 0}, k.required);
        k.integer("l", noise.l, {.from = 2, .to = 100});
        k.integer("n", noise.n, {.from = 1, .to = 100});
        k.integer("m", noise.around, {.from = 0, .to = 100});
        k.integer("seed", noise.seed, {.from = 0, .to = 1e9});
    });
    k.tables("eigenmode", result.eigenmodes, [](auto& k, FrameEigenmode& mode) {
        k.text("of", mode.of, k.required);
        k.number("amplitude", mode.amplitude, {}, k.required);
    });
    const bool closed = result.modes.empty() ? !result.noise.empty() && result.noise.front().l : result.closed();
    check_waves(k, "mode", result.modes, closed);
    check_waves(k, "noise", result.noise, closed);
}

}  // namespace tubule
