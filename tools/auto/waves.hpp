// Modes m > 0 of a profile that an axisymmetric run has computed: how fast they grow, and the surface with
// them on it.
#pragma once

#include <vector>

#include "common/case/problem.hpp"
#include "common/result/result.hpp"

namespace tubule {

struct WaveRates {
    std::vector<double> rates;  // the fastest of m = 1 ... auto.modes
    bool estimated = false;     // the shape flows or stretches: the effect on waves is neglected
    double accuracy = 0;        // relative to the larger of a rate and the slowest one
};

// Growth rates of the profile of a frame. Throws std::invalid_argument or SolveError where they cannot be computed.
WaveRates wave_rates(const Problem& c, const Record& frame);

// The rate of a wave with inertia, from those of the same model without it (viscosity and friction alone) and of the
// overdamped model (mass instead of friction): omega^2/overdamped + omega/stokes = 1, the root with the largest real
// part. As each has the flow that suits it best, a fluid with the best compromise is no faster. On shapes that move,
// the tensions of these flows differ, and so may the signs of their rates: the sign is that of what resists more.
double rate_with_inertia(double stokes, double overdamped);

// The profile of a frame with the fastest growing mode of each m on it: relative_amplitudes[m - 1] of the largest
// radius, as a normal displacement; none where that is 0. A fluid keeps its velocity.
PerturbedCurve perturbed_curve(const Problem& c, const Record& frame, const std::vector<double>& relative_amplitudes);

}  // namespace tubule
