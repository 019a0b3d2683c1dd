// Pointwise geometry of a surface from a parametrisation X(u, v): theory.md (1.7).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/geometry/jet.hpp"

namespace Eigen {

// Jets in Eigen's small vectors.
template <class T, int N, int Order>
struct NumTraits<tubule::Jet<T, N, Order>> : GenericNumTraits<tubule::Jet<T, N, Order>> {
    enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 1 };
};

}  // namespace Eigen

namespace tubule {

template <class S>
using Vector3 = Eigen::Matrix<S, 3, 1>;
template <class S>
using Matrix3 = Eigen::Matrix<S, 3, 3>;

// S is a number or a Jet. Everything dimensionless; X_u x X_v points outward, so that a sphere of radius R has
// B = -P/R, H = -2/R.
template <class S>
struct SurfacePoint {
    Vector3<S> x;
    Vector3<S> tangent[2];  // X_u, X_v
    Vector3<S> dual[2];     // tangential, dual[i].tangent[j] = 1 if i = j, else 0: grad f = f_u dual[0] + f_v dual[1]
    S metric[3];            // tangent[0]^2, tangent[0].tangent[1], tangent[1]^2
    S area;                 // dS = area du dv
    Vector3<S> normal;      // outward unit normal
    Matrix3<S> B;           // shape operator -grad nu, as a symmetric tensor of space
    S H, K;                 // trace of B, product of the principal curvatures
};

// Everything but the curvatures, which need second derivatives.
template <class S>
void set_tangents(SurfacePoint<S>& p, const Vector3<S>& x, const Vector3<S>& xu, const Vector3<S>& xv) {
    p.x = x;
    p.tangent[0] = xu, p.tangent[1] = xv;
    const S g11 = xu.dot(xu), g12 = xu.dot(xv), g22 = xv.dot(xv);
    p.metric[0] = g11, p.metric[1] = g12, p.metric[2] = g22;
    const Vector3<S> n = xu.cross(xv);
    const S det = n.dot(n), inverse_area = inverse_sqrt(det), inverse_det = inverse_area * inverse_area;
    p.area = det * inverse_area;
    p.normal = n * inverse_area;
    p.dual[0] = xu * S(g22 * inverse_det) - xv * S(g12 * inverse_det);
    p.dual[1] = xv * S(g11 * inverse_det) - xu * S(g12 * inverse_det);
}

// B, H and K from -grad nu = SUM (X_ij . nu) dual_i dual_j.
template <class S>
void set_curvature(SurfacePoint<S>& p, const Vector3<S>& xuu, const Vector3<S>& xuv, const Vector3<S>& xvv) {
    const S b11 = xuu.dot(p.normal), b12 = xuv.dot(p.normal), b22 = xvv.dot(p.normal);
    const S inverse_area = inverse(p.area), inverse_det = inverse_area * inverse_area;
    p.H = (b11 * p.metric[2] - 2.0 * (b12 * p.metric[1]) + b22 * p.metric[0]) * inverse_det;
    p.K = (b11 * b22 - b12 * b12) * inverse_det;
    const Vector3<S> b_dot_1 = p.dual[0] * b11 + p.dual[1] * b12, b_dot_2 = p.dual[0] * b12 + p.dual[1] * b22;
    p.B = p.dual[0] * b_dot_1.transpose() + p.dual[1] * b_dot_2.transpose();
}

// The point (u, v) = 0 of the surface map(p + u e1 + v e2), exactly: `map` takes and gives a Vector3 of any scalar.
// e1, e2 must not be in the kernel of its derivative. With S a Jet in the variables 0 and 1, also the derivatives of
// everything in u and v.
template <class S, class Map>
SurfacePoint<S> point_of_map(const Map& map, const Eigen::Vector3d& p, const Eigen::Vector3d& e1,
                             const Eigen::Vector3d& e2) {
    using Second = Jet<S, 2, 2>;
    Second u = Second::variable(S(0.0), 0), v = Second::variable(S(0.0), 1);
    if constexpr (!std::is_same_v<S, double>) u.v = S::variable(0.0, 0), v.v = S::variable(0.0, 1);
    Vector3<Second> q;
    for (int i = 0; i < 3; ++i) q[i] = e1[i] * u + e2[i] * v + p[i];
    const Vector3<Second> X = map(q);
    const auto part = [&](auto&& pick) { return Vector3<S>(pick(X[0]), pick(X[1]), pick(X[2])); };
    SurfacePoint<S> out;
    set_tangents<S>(out, part([](const Second& a) { return a.v; }), part([](const Second& a) { return a.d[0]; }),
                    part([](const Second& a) { return a.d[1]; }));
    set_curvature<S>(out, part([](const Second& a) { return a.dd[0]; }), part([](const Second& a) { return a.dd[1]; }),
                     part([](const Second& a) { return a.dd[2]; }));
    return out;
}

}  // namespace tubule
