// Kernels that are made for energies without terms of a case, for those with powers, and for all.
#pragma once

#include "common/energy/bending.hpp"

namespace tubule::axisym {

// kernel<added>() of this energy.
template <class Kernel>
auto by_added(const Bending& bending, const Kernel& kernel) {
    switch (added_to(bending)) {
        case Added::none:
            return kernel.template operator()<Added::none>();
        case Added::powers:
            return kernel.template operator()<Added::powers>();
        default:
            return kernel.template operator()<Added::any>();
    }
}

}  // namespace tubule::axisym
