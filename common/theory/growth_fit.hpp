// The growth rate of a wave from its amplitudes at some times, such as those of a nonlinear run.
#pragma once

#include <vector>

namespace tubule::theory {

// The stretch of the run where log a is straightest. Of all stretches of at least 6 points over which their line changes
// by at least 1, or by a third of the whole range of log a if that is less, those with an error bar up to twice the
// smallest one are candidates; of these, the one whose line changes most is chosen. At most 200 points are used, evenly
// spaced by index.
struct GrowthFit {
    double rate = 0;
    // Standard error of the slope, plus twice the range of the slopes of the stretch's three thirds. (Once that range
    // underestimates the error where the slope peaks within the stretch: 0.44 instead of 0.6.)
    double error = 0;
    double from = 0, to = 0;  // times
    int points = 0;           // in it
};

// `amplitudes` are not negative; those below `noise` do not count. Times ascend; points of the same time count once.
// Throws std::invalid_argument if fewer than 6 points are left.
GrowthFit fit_growth(const std::vector<double>& times, const std::vector<double>& amplitudes, double noise = 0);

}  // namespace tubule::theory
