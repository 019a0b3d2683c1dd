// INT f dt along steps, from the values of f at their ends: that of the polynomial through the last five.
#pragma once

#include <algorithm>
#include <array>

namespace tubule::axisym {

class StepIntegral {
public:
    void begin(double t, double f) {
        times_[0] = t, values_[0] = f;
        points_ = 1;
        before_ = 0;
    }

    // The next step ends at `t`.
    void add(double t, double f) {
        before_ = at(times_[points_ - 1]);
        if (points_ == most) {
            std::shift_left(times_.begin(), times_.end(), 1);
            std::shift_left(values_.begin(), values_.end(), 1);
            --points_;
        }
        times_[points_] = t, values_[points_++] = f;
    }

    // From the begin to a time within the last step; Gauss' rule is exact for the polynomial.
    double at(double t) const {
        if (points_ < 2) return before_;
        const double from = times_[points_ - 2], h = t - from, offset = 0.3872983346207417 * h, middle = from + h / 2;
        return before_ + h / 18 * (5 * value(middle - offset) + 8 * value(middle) + 5 * value(middle + offset));
    }

private:
    // Neville's scheme.
    double value(double t) const {
        auto p = values_;
        for (int k = 1; k < points_; ++k)
            for (int i = 0; i + k < points_; ++i)
                p[i] = ((t - times_[i + k]) * p[i] + (times_[i] - t) * p[i + 1]) / (times_[i] - times_[i + k]);
        return p[0];
    }

    static constexpr int most = 5;
    std::array<double, most> times_{}, values_{};
    int points_ = 0;
    double before_ = 0;  // until the last step
};

}  // namespace tubule::axisym
