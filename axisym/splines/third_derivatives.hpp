// Third derivatives of the active splines at the quadrature points, in the layouts of SplineSpace::Basis: for the
// gradient term alone, so that nothing else loads them.
#pragma once

#include <stdexcept>
#include <vector>

#include "axisym/splines/spline_space.hpp"

namespace tubule::axisym {

class ThirdDerivatives {
public:
    struct Group {
        alignas(32) double by_point[SplineSpace::max_width][SplineSpace::lanes] = {};
        alignas(32) double by_spline[SplineSpace::lanes][SplineSpace::max_width] = {};
    };

    // Throws std::invalid_argument where the smoothness is 1: curvature jumps at knots, and its gradient is not
    // integrable.
    explicit ThirdDerivatives(const SplineSpace& space)
        : per_element_(space.groups()), groups_(static_cast<std::size_t>(space.elements()) * space.groups()) {
        if (space.smoothness() < 2) throw std::invalid_argument("the gradient term needs splines of smoothness 2");
        double values[4 * SplineSpace::max_width];
        for (int e = 0; e < space.elements(); ++e)
            for (int g = 0; g < space.groups(); ++g)
                for (int q = 0; q < SplineSpace::lanes; ++q) {
                    Group& to = groups_[e * per_element_ + g];
                    space.splines(e, space.basis(e, g).z[q], 3, values);
                    for (int a = 0; a < space.width(); ++a)
                        to.by_point[a][q] = to.by_spline[q][a] = values[3 * space.width() + a];
                }
    }

    const Group& at(int element, int group) const { return groups_[element * per_element_ + group]; }

private:
    int per_element_;
    std::vector<Group> groups_;
};

}  // namespace tubule::axisym
