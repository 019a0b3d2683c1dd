// Where frames sample a profile.
#pragma once

#include <initializer_list>
#include <utility>
#include <vector>

#include "axisym/splines/curve_space.hpp"
#include "common/result/record.hpp"

namespace tubule::axisym {

// Where to evaluate curvatures for s: at a pole the curvature around the axis is that along the profile, and just
// beside it they agree to rounding.
inline double beside_pole(const CurveSpace& space, double s) {
    constexpr double aside = 1e-5;
    if (space.begins_at_pole() && s < aside) return aside;
    return space.ends_at_pole() && s > 1 - aside ? 1 - aside : s;
}

// Samples of the whole cell or period: at(s) at several places of each element, then their images in the plane of
// symmetry, if there is one; reflect(sample) changes what besides z changes sign there.
template <class At, class Reflect>
auto sample_profile(const CurveSpace& space, At&& at, Reflect&& reflect) {
    constexpr int per_element = 6;
    const std::vector<double>& breaks = space.splines().breaks();
    std::vector<decltype(at(0.0))> samples;
    for (std::size_t e = 0; e + 1 < breaks.size(); ++e)
        for (int i = 0; i < per_element; ++i)
            samples.push_back(at(breaks[e] + (breaks[e + 1] - breaks[e]) * i / per_element));
    samples.push_back(at(1.0));
    if (space.images() == 1) return samples;
    const double plane = samples.back().z;
    for (std::size_t i = samples.size() - 1; i-- > 0;) {
        auto image = samples[i];
        image.z = 2 * plane - image.z;
        reflect(image);
        samples.push_back(image);
    }
    return samples;
}

// Columns of samples as arrays of a record.
template <class Sample>
void add_columns(Record& out, const std::vector<Sample>& samples,
                 std::initializer_list<std::pair<const char*, double Sample::*>> columns) {
    for (const auto& [name, member] : columns) {
        std::vector<double> values;
        for (const Sample& s : samples) values.push_back(s.*member);
        out.arrays.push_back(array(name, std::move(values)));
    }
}

}  // namespace tubule::axisym
