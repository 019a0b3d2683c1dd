// A curve at the quadrature points of one group of an element, for the functionals of curves.
#pragma once

#include "axisym/splines/curve_space.hpp"
#include "axisym/splines/pack.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {

struct CurveLocal {
    Pack r{0.0}, r1{0.0}, r2{0.0}, z1, z2{0.0};
    CurveLocal(const CurveSpace& space, int e, int g, const double* x) : z1(space.rise(x)) {
        const auto& b = space.splines().basis(e, g);
        const double* z = x + space.r().size();
        for (int a = 0; a < space.splines().width(); ++a) {
            const double cr = space.r().signs(e)[a] * x[space.r().dofs(e)[a]];
            const double cz = space.z().signs(e)[a] * z[space.z().dofs(e)[a]];
            r += cr * load(b.by_point[0][a]);
            r1 += cr * load(b.by_point[1][a]);
            r2 += cr * load(b.by_point[2][a]);
            z1 += cz * load(b.by_point[1][a]);
            z2 += cz * load(b.by_point[2][a]);
        }
    }

    auto point() const { return profile_point(r, r1, r2, z1, z2); }
    // Curvatures and area as jets in (r, r', r'', z', z'').
    template <int Order>
    auto point() const {
        using J = Jet<Pack, 5, Order>;
        return profile_point(J::variable(r, 0), J::variable(r1, 1), J::variable(r2, 2), J::variable(z1, 3),
                             J::variable(z2, 4));
    }
};

// visit(e, number of the group, basis, curve there) for each group of points.
template <class Visit>
void each_group(const CurveSpace& space, const double* x, const Visit& visit) {
    const SplineSpace& splines = space.splines();
    for (int e = 0, i = 0; e < splines.elements(); ++e)
        for (int g = 0; g < splines.groups(); ++g, ++i) visit(e, i, splines.basis(e, g), CurveLocal(space, e, g, x));
}

// Derivatives that r and z enter with: of r the zeroth to second, of z the first and second.
inline constexpr int first_derivative[2] = {0, 1}, first_variable[2] = {0, 3};

}  // namespace tubule::axisym
