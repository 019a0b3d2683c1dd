#include "surface3d/run/motion_trace.hpp"

#include <algorithm>

namespace tubule::surface3d {
namespace {

constexpr double shortest_neighbour = 0.1;  // of a step: shorter ones beside it, as on a new mesh, say nothing of it

}  // namespace

MotionTrace::MotionTrace(const Record& record, const char* name) {
    for (const Array& a : record.arrays)
        if (a.name == name)
            for (std::size_t i = 0; i + 1 < a.data.size(); i += 2) add(a.data[i], a.data[i + 1]);
}

double MotionTrace::operator()(double t) const {
    const int n = static_cast<int>(points_.size());
    const auto after =
        std::lower_bound(points_.begin(), points_.end(), t, [](const auto& p, double x) { return p[0] < x; });
    int last = std::clamp(static_cast<int>(after - points_.begin()), std::min(1, n - 1), n - 1);
    int first = std::max(last - 1, 0);
    const double least = shortest_neighbour * (points_[last][0] - points_[first][0]);
    if (first > 0 && points_[first][0] - points_[first - 1][0] > least) --first;
    if (last + 1 < n && points_[last + 1][0] - points_[last][0] > least) ++last;
    double sum = 0;
    for (int i = first; i <= last; ++i) {
        double weight = 1;
        for (int j = first; j <= last; ++j)
            if (j != i) weight *= (t - points_[j][0]) / (points_[i][0] - points_[j][0]);
        sum += weight * points_[i][1];
    }
    return sum;
}

Array MotionTrace::array(const char* name) const {
    Array out{name, {points_.size(), 2}, {}};
    for (const auto& p : points_) out.data.insert(out.data.end(), p.begin(), p.end());
    return out;
}

}  // namespace tubule::surface3d
