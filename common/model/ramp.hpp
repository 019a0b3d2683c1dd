// A value that a case gives for all times: a number, or linear between given times and constant before and after them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace tubule {

class Ramp {
public:
    Ramp(double value = 0) : values_{value} {}
    // Times that ascend, with as many values, at least one. Throws std::invalid_argument for others.
    Ramp(std::vector<double> times, std::vector<double> values) : times_(std::move(times)), values_(std::move(values)) {
        if (times_.empty() || times_.size() != values_.size())
            throw std::invalid_argument("a ramp needs as many values as times");
        if (std::adjacent_find(times_.begin(), times_.end(), std::greater_equal<>()) != times_.end())
            throw std::invalid_argument("the times of a ramp must ascend");
    }

    double at(double t) const {
        const std::size_t i = piece(t);
        if (i == 0 || i == times_.size()) return i == 0 ? values_.front() : values_.back();
        const double part = (t - times_[i - 1]) / (times_[i] - times_[i - 1]);
        return values_[i - 1] + part * (values_[i] - values_[i - 1]);
    }
    // The derivative; at a kink that after it.
    double slope(double t) const {
        const std::size_t i = piece(t);
        if (i == 0 || i == times_.size()) return 0;
        return (values_[i] - values_[i - 1]) / (times_[i] - times_[i - 1]);
    }
    // The first time after t at which the slope changes, infinite if there is none.
    double next_kink(double t) const {
        const auto next = std::upper_bound(times_.begin(), times_.end(), t);
        return next == times_.end() || is_constant() ? HUGE_VAL : *next;
    }
    bool is_constant() const {
        return std::all_of(values_.begin(), values_.end(), [&](double value) { return value == values_.front(); });
    }
    bool is_zero() const { return is_constant() && values_.front() == 0; }
    // The largest magnitude at any time.
    double largest() const {
        double out = 0;
        for (const double value : values_) out = std::max(out, std::abs(value));
        return out;
    }

    const std::vector<double>& times() const { return times_; }  // none for a number
    const std::vector<double>& values() const { return values_; }

    bool operator==(const Ramp&) const = default;

private:
    // How many times are not after t; none where there are no times.
    std::size_t piece(double t) const {
        return static_cast<std::size_t>(std::upper_bound(times_.begin(), times_.end(), t) - times_.begin());
    }

    std::vector<double> times_, values_;
};

}  // namespace tubule
