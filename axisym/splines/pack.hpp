// One element's quadrature points, or half of its splines, in one register.
#pragma once

#include <experimental/simd>
#include <type_traits>

#include "axisym/splines/spline_space.hpp"

namespace tubule::axisym {

using Pack = std::experimental::simd<double, std::experimental::simd_abi::deduce_t<double, SplineSpace::lanes>>;

inline Pack load(const double* p) {
    return Pack(p, std::experimental::vector_aligned);
}
inline void store(const Pack& v, double* p) {
    v.copy_to(p, std::experimental::vector_aligned);
}

// kernel(P) with the degree of the splines, 3, 5 or 7, as a constant.
template <class Kernel>
decltype(auto) for_degree(int degree, Kernel&& kernel) {
    switch (degree) {
        case 3:
            return kernel(std::integral_constant<int, 3>{});
        case 5:
            return kernel(std::integral_constant<int, 5>{});
        default:
            return kernel(std::integral_constant<int, 7>{});
    }
}

}  // namespace tubule::axisym
