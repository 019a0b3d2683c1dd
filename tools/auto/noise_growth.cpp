#include "tools/auto/noise_growth.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tubule {

namespace {

// Rates that are linear from t0 to t1.
struct Linear {
    double t0, t1, s0, s1;
    double rate(double t) const { return s0 + (s1 - s0) * (t - t0) / (t1 - t0); }
    double integral(double from, double to) const { return (to - from) * (rate(from) + rate(to)) / 2; }
    // Where growth begins, ends: the zero of the rate, if it has one inside.
    std::optional<double> turn() const {
        if ((s0 < 0) == (s1 < 0) || s0 == s1) return std::nullopt;
        return t0 + (t1 - t0) * s0 / (s0 - s1);
    }
};

}  // namespace

NoiseGrowth::NoiseGrowth(double noise, int modes) : log_noise_(std::log(noise)), begin_(modes, log_noise_) {}

void NoiseGrowth::forget() {
    std::fill(begin_.begin(), begin_.end(), log_noise_);
    times_.clear(), rates_.clear(), logs_.clear(), errors_.clear();
}

void NoiseGrowth::begin_with(const std::vector<double>& amplitudes) {
    for (std::size_t i = 0; i < begin_.size() && i < amplitudes.size(); ++i)
        begin_[i] = std::max(log_noise_, std::log(amplitudes[i]));
}

void NoiseGrowth::add(double time, const std::vector<double>& rates) {
    if (rates.size() != begin_.size() || (!empty() && time <= times_.back()))
        throw std::invalid_argument("growth rates come one for each m, at increasing times");
    times_.push_back(time), rates_.push_back(rates);
    const std::size_t last = times_.size() - 1;
    logs_.push_back(begin_);
    errors_.resize(rates.size(), 0);
    if (last == 0) return;
    for (int m = 1; m <= modes(); ++m) {
        const double now = logs_[last][m - 1] = log_amplitude(m, last - 1, time);
        if (now <= log_noise_) errors_[m - 1] = 0;
        if (now <= log_noise_ || last < 2) continue;
        const auto slope = [&](std::size_t i) {
            return (rates_[i + 1][m - 1] - rates_[i][m - 1]) / (times_[i + 1] - times_[i]);
        };
        const double second = 2 * (slope(last - 1) - slope(last - 2)) / (times_[last] - times_[last - 2]);
        errors_[m - 1] += std::abs(second) * std::pow(times_[last] - times_[last - 1], 3) / 12;
    }
}

// At a time after times_[interval], by the rates there and at the next time.
double NoiseGrowth::log_amplitude(int m, std::size_t interval, double time) const {
    const Linear s{times_[interval], times_[interval + 1], rates_[interval][m - 1], rates_[interval + 1][m - 1]};
    // What grew since the beginning of the interval, or began as noise in it: where growth set in, or now.
    const double grown = logs_[interval][m - 1] + s.integral(s.t0, time);
    double fresh = log_noise_;
    if (const auto turn = s.turn(); turn && s.s1 > 0 && *turn < time) fresh += s.integral(*turn, time);
    return std::max(grown, fresh);
}

double NoiseGrowth::amplitude(int m, double time) const {
    if (empty() || time <= times_.front()) return std::exp(begin_[m - 1]);
    if (time >= times_.back()) return std::exp(logs_.back()[m - 1]);
    const auto next = std::upper_bound(times_.begin(), times_.end(), time);
    return std::exp(log_amplitude(m, static_cast<std::size_t>(next - times_.begin()) - 1, time));
}

NoiseGrowth::Peak NoiseGrowth::largest() const {
    Peak out;
    const auto look = [&](int m, double time) {
        if (const double a = amplitude(m, time); a > out.amplitude) out = {m, time, a};
    };
    for (int m = 1; m <= modes(); ++m)
        for (std::size_t i = 0; i < times_.size(); ++i) {
            look(m, times_[i]);
            if (i + 1 == times_.size()) continue;
            if (const auto turn = Linear{times_[i], times_[i + 1], rates_[i][m - 1], rates_[i + 1][m - 1]}.turn())
                look(m, *turn);
        }
    return out;
}

std::optional<NoiseGrowth::Peak> NoiseGrowth::reached(double amplitude) const {
    std::optional<Peak> first;
    const double wanted = std::log(amplitude);
    for (int m = 1; m <= modes(); ++m)
        for (std::size_t i = 0; i + 1 < times_.size(); ++i) {
            // Where growth ends in the interval, or the interval does; until there the amplitude does not fall.
            const Linear s{times_[i], times_[i + 1], rates_[i][m - 1], rates_[i + 1][m - 1]};
            const double peak = s.s0 > 0 && s.s1 < 0 ? *s.turn() : s.t1;
            if (log_amplitude(m, i, peak) < wanted) continue;
            double low = s.t0, high = peak;
            for (int halving = 0; halving < 60; ++halving) {
                const double middle = (low + high) / 2;
                (log_amplitude(m, i, middle) < wanted ? low : high) = middle;
            }
            if (!first || high < first->time) first = Peak{m, high, amplitude};
            break;
        }
    return first;
}

}  // namespace tubule
