// How large noise becomes: amplitudes that grow by exp INT s_m dt, from growth rates s_m at some times.
#pragma once

#include <optional>
#include <vector>

namespace tubule {

// For m = 1, 2, ...: the amplitude a_m at the beginning, and a_m' = s_m a_m after it, but never less than the noise,
// which is always there. The rates are linear between the times at which they are known.
class NoiseGrowth {
public:
    NoiseGrowth(double noise, int modes);  // all amplitudes begin as the noise

    // The fastest rate of each m at this time, later than those before.
    void add(double time, const std::vector<double>& rates);
    // Instead of the noise, before the first rates are known: amplitudes[m - 1].
    void begin_with(const std::vector<double>& amplitudes);
    void forget();  // all but the noise

    int modes() const { return static_cast<int>(begin_.size()); }
    bool empty() const { return times_.empty(); }
    double last_rate(int m) const { return rates_.back()[m - 1]; }
    double amplitude(int m, double time) const;  // time not before the first rates; as at the last rates after them

    struct Peak {
        int m = 0;
        double time = 0, amplitude = 0;
    };
    Peak largest() const;  // of all until the last rates
    // When one of them first became so large.
    std::optional<Peak> reached(double amplitude) const;
    // Error of the logarithm of the largest amplitude of this m at the last rates: that of the trapezoidal rule, from
    // second differences of s_m.
    double error(int m) const { return errors_.empty() ? 0 : errors_[m - 1]; }

private:
    double log_amplitude(int m, std::size_t interval, double time) const;

    double log_noise_;
    std::vector<double> begin_;               // logarithms
    std::vector<double> times_;               // increasing
    std::vector<std::vector<double>> rates_;  // [time][m - 1]
    std::vector<std::vector<double>> logs_;   // of the amplitudes, likewise
    std::vector<double> errors_;
};

}  // namespace tubule
