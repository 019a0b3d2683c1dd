// One element's quadrature points, or half of its splines, in one register.
#pragma once

#include <experimental/simd>

#include "axisym/splines/profile_space.hpp"

namespace tubule::axisym {

using Pack = std::experimental::simd<double, std::experimental::simd_abi::deduce_t<double, ProfileSpace::lanes>>;

inline Pack load(const double* p) {
    return Pack(p, std::experimental::vector_aligned);
}
inline void store(const Pack& v, double* p) {
    v.copy_to(p, std::experimental::vector_aligned);
}

}  // namespace tubule::axisym
