// Where along a profile a run needed small elements: from that, the mesh of the next run.
#pragma once

#include <vector>

#include "axisym/splines/spline_space.hpp"

namespace tubule::axisym {

// Elements per parameter in equal parts of a profile, relative to equal elements. Empty: not known.
using ElementDensity = std::vector<double>;

// The mesh that the states of a run required.
struct MeshNeed {
    // `mesh_loss`: the energy lost in each element of the space, which falls with the power 2 (degree - 1) of its size.
    void add(const SplineSpace& space, const std::vector<double>& mesh_loss);
    // Half of the elements stay equal. Empty if nothing was added, or nothing is lost.
    ElementDensity density() const;

    double lost = 0;             // of the energy, absolute: the most that any state loses
    std::vector<double> wanted;  // the largest 1/size in equal parts of the profile, for a loss per length of 1
};

// Breaks of `elements` elements of that density, whose sizes change slowly along the profile.
std::vector<double> breaks_of(ElementDensity density, int elements);

}  // namespace tubule::axisym
