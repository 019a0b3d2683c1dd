#include "common/run/energy_trace.hpp"

#include <algorithm>
#include <cmath>

namespace tubule {
namespace {

constexpr double shortest_neighbour = 0.1;  // of a step: shorter ones beside it, as on a new mesh, say nothing of it

}  // namespace

void EnergyTrace::add(double t, double energy, std::optional<double> slope) {
    if (!empty() && t <= end()) return;
    time_.push_back(t), energy_.push_back(energy);
    if (slope) slope_.push_back(*slope);
}

void EnergyTrace::cut_after(double t) {
    const std::size_t n = std::upper_bound(time_.begin(), time_.end(), t) - time_.begin();
    time_.resize(n), energy_.resize(n), slope_.resize(std::min(n, slope_.size()));
}

int EnergyTrace::points_after(double t) const {
    return static_cast<int>(time_.end() - std::upper_bound(time_.begin(), time_.end(), t));
}

int EnergyTrace::limited_steps(double growth, double t) const {
    int count = 0;
    for (std::size_t i = 2; i < time_.size() && time_[i] <= t; ++i)
        if (time_[i] - time_[i - 1] < 0.9 * growth * (time_[i - 1] - time_[i - 2])) ++count;
    return count;
}

double EnergyTrace::operator()(double t) const {
    const int after = static_cast<int>(std::lower_bound(time_.begin(), time_.end(), t) - time_.begin());
    if (slope_.empty()) return through_neighbours(t, after);
    if (after == 0) return energy_.front();
    if (after == static_cast<int>(time_.size())) return energy_.back();
    const int before = after - 1;
    const double h = time_[after] - time_[before], x = (t - time_[before]) / h;
    return energy_[before] + x * x * (3 - 2 * x) * (energy_[after] - energy_[before]) +
           h * x * (1 - x) * ((1 - x) * slope_[before] - x * slope_[after]);
}

double EnergyTrace::through_neighbours(double t, int after) const {
    const int n = static_cast<int>(time_.size());
    int last = std::clamp(after, std::min(1, n - 1), n - 1);
    int first = std::max(last - 1, 0);
    const double least = shortest_neighbour * (time_[last] - time_[first]);
    if (first > 0 && time_[first] - time_[first - 1] > least) --first;
    if (last + 1 < n && time_[last + 1] - time_[last] > least) ++last;
    double sum = 0;
    for (int i = first; i <= last; ++i) {
        double weight = 1;
        for (int j = first; j <= last; ++j)
            if (j != i) weight *= (t - time_[j]) / (time_[i] - time_[j]);
        sum += weight * energy_[i];
    }
    return sum;
}

std::optional<double> EnergyTrace::difference(double t, double energy) const {
    if (empty() || t > end() || (t > time_[0] && t < time_[1])) return std::nullopt;
    return std::abs(energy - (*this)(t));
}

}  // namespace tubule
