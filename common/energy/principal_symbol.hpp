// Whether the energy resists the shortest waves: the principal symbol, theory.md (2.14).
#pragma once

#include <algorithm>

#include "common/energy/bending.hpp"

namespace tubule {

// f_HH + 2 f_HK x + f_KK x^2 of a density with derivatives f, for waves across which the normal curvature is x.
template <class T>
T principal_symbol(const CurvatureJet<T>& f, const T& x) {
    return f.HH + x * (2.0 * f.HK + x * f.KK);
}

// Its minimum over all x between two curvatures: of a parabola it is at an end or at the clamped vertex. T is a number
// or a pack of them.
template <class T>
T least_principal_symbol(const CurvatureJet<T>& f, const T& low, const T& high) {
    using std::clamp, std::min;
    const T vertex = clamp(-f.HK * f.KK / (f.KK * f.KK + 1e-300), low, high);
    return min(principal_symbol(f, low), min(principal_symbol(f, high), principal_symbol(f, vertex)));
}

}  // namespace tubule
