// The numbers of the generalised alpha method of Jansen, Whiting and Hulbert (2000) for X_t = w, with steps that vary.
#pragma once

namespace tubule::surface3d {

// A step of length tau goes through a stage at `level` of it, where X = Xbar + te w and Xbar = X + kept * (carried
// rate). Its end lies on the line from its beginning to there.
struct AlphaNumbers {
    double level, te, kept;
    double renewing;  // the part of the carried rate that a step makes anew: rate += renewing * (w - rate)
    double lag;       // and the time from which it then is, before the end of the step
    double error;     // of X in a step, exact less computed, in units of its third derivative * tau^3
};

// Rates are linear between the carried one, of `lag` before the step begins, and that of the stage. `radius`: the
// spectral radius at infinity, 0 to 1.
//
// The error is that of X_t = c X. The carried rate has one, too: with equal steps it settles at 3/2 lag^2 of the third
// derivative. At that it is taken, which with uneven steps it is about.
constexpr AlphaNumbers alpha_numbers(double tau, double lag, double radius) {
    const double level = 1 / (1 + radius), before = lag / tau, next = (1 - radius) / (2 * (1 + radius));
    const double share = (0.5 + before) / (level + before);  // of the stage in the mean rate of the step
    const double linear = (1.0 / 3 + (before - level) / 2 - before * level) / 2;
    return {.level = level,
            .te = level * tau * share,
            .kept = level * tau * (1 - share),
            .renewing = (1 - next + before) / (level + before),
            .lag = next * tau,
            .error = linear - share * level * (1 - level) / 2 - (1 - share) * 1.5 * before * before};
}

}  // namespace tubule::surface3d
