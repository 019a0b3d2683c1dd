// Several small waves of a tube in time, by integrating theory.md (5.7), (5.16), (5.18).
#pragma once

#include <optional>
#include <vector>

#include "common/case/problem.hpp"
#include "common/theory/dispersion.hpp"

namespace tubule::theory {

// amplitude cos(2 pi n z/length + m theta + phase), n and |m| not both 0; for a fluid also its initial rate.
struct Wave {
    int n = 1, m = 0;
    double amplitude = 0, rate = 0;
};

struct WaveState {
    double time = 0, radius = 1, tension = 0;
    std::vector<double> amplitudes, rates;  // of each wave; rates are da/dt
};

// The waves at each of `times` (ascending, from 0), to about 1e-10 of the largest amplitude.
//   Area free, or fed from a reservoir: the tension is that of the tube, constant. Else that of tension_of, constant;
//   or
//     it keeps SUM Z a^2 constant, theory.md (5.14), and is returned; the tube's own tension is ignored.
//   The radius stays. In gradient flow that keeps neither area nor volume it drifts under the tension and the pressure
//     of t = 0, theory.md (5.3); amplitudes are multiplied by exp INT omega dt.
//   With inertia and m >= 1: the swirl that goes with a wave begins at rest and is followed as a third unknown.
// The equations neglect squares of amplitudes. Throws std::invalid_argument for invalid waves (n = m = 0,
// repeated, all without amplitude, infinitely fast), SolveError if the radius vanishes or the integrator fails.
std::vector<WaveState> waves_in_time(const UniformTube& tube, const MotionLaw& law, double length,
                                     const std::vector<Wave>& waves, const std::vector<double>& times);

// The initial tension that the constraints require, theory.md (5.17), (5.19), where area, volume and period are fixed.
double tension_of_waves(const UniformTube& tube, const MotionLaw& law, double length, const std::vector<Wave>& waves);

// A time-dependent case that starts as a tube: that tube made straight, and its waves. The tension is the initial one;
// 0 where nothing determines it (fixed volume, no waves).
struct TubeStart {
    UniformTube tube;
    double length = 1;
    std::vector<Wave> waves;  // each once: those of a case that differ by their phase alone are added
};
std::optional<TubeStart> tube_start(const Problem& c);  // empty for other cases

// The mean rate of a wave between two times by linear theory of the case: log(a(to)/a(from))/(to - from). Empty if
// unknown: where area and volume couple all waves, and the case does not contain this one; where loads change in time,
// or the radius of a tube that a reservoir feeds.
std::optional<double> mean_rate(const Problem& c, int n, int m, double from, double to);

}  // namespace tubule::theory
